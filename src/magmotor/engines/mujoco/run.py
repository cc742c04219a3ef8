"""Running a scene in MuJoCo: stepping, recording, and moving the ring along its script."""

from collections.abc import Generator

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco import stopwatch
from magmotor.engines.mujoco.build import build
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.mujoco.magnetism import magnetism
from magmotor.scenes import Top
from magmotor.states import CHUNK
from magmotor.states.ball import BallStates

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}
RING_POSE = int(mujoco.mjtState.mjSTATE_MOCAP_POS) | int(mujoco.mjtState.mjSTATE_MOCAP_QUAT)


def run(job: Job) -> Generator[BallStates]:
    """Yield the recorded states that follow the initial one, in chunks.

    A scripted ring stands still within a step, where its script has it at the middle of the step:
    an error of second order.
    """
    scene, timestep = job.scene, job.timestep
    model = build(scene)
    model.opt.timestep = timestep
    model.opt.integrator = INTEGRATORS[job.scheme]
    data = mujoco.MjData(model)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    state = np.concatenate([[0.0], *coordinates.joints(job.initial)])
    done, last = 0, job.records * job.record_interval
    with magnetism(), stopwatch.stopped():
        while done < last:
            steps = np.arange(done, min(done + CHUNK, last))
            poses = _ring_poses(scene, (steps + 0.5) * timestep)
            paths, _ = rollout(model, data, state, poses, control_spec=RING_POSE, nstep=len(steps))
            path = paths[0]
            # A warning of huge values ends a rollout, and its last state is repeated.
            path[np.diff(path[:, 0], prepend=state[0]) <= 0] = np.nan
            state = path[-1].copy()
            done += len(steps)
            recorded = (steps + 1) % job.record_interval == 0
            if recorded.any():
                qpos, qvel = np.split(path[recorded, 1:], [model.nq], axis=1)
                yield coordinates.states((steps[recorded] + 1) * timestep, qpos, qvel)


def _ring_poses(scene: Top, times: NDArray) -> NDArray[np.float64] | None:
    """Position and orientation of a scripted ring, step by step; others stay where they are."""
    if not scene.ring_script:
        return None
    poses = np.zeros((1, len(times), 7))
    for row, time in zip(poses[0], times, strict=True):
        row[2], tilt = scene.ring_pose(time)
        row[3:] = scene.ring_quaternion(tilt)
    return poses
