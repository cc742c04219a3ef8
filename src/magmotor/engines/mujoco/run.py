"""Running a scene in MuJoCo: stepping, recording, and moving the ring along its script."""

from collections.abc import Generator

import mujoco
import numpy as np

from magmotor.engines.mujoco.build import build
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.mujoco.magnetism import magnetism
from magmotor.engines.state import States, record_chunks
from magmotor.scenes import Top

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}


def run(
    scene: Top, scheme: str, timestep: float, records: int, record_interval: int, initial: States
) -> Generator[States]:
    """Yield the recorded states that follow the initial one, in chunks.

    A scripted ring stands still within a step, where its script has it at the middle of the step:
    an error of second order.
    """
    model = build(scene)
    model.opt.timestep = timestep
    model.opt.integrator = INTEGRATORS[scheme]
    data = mujoco.MjData(model)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    data.qpos[:], data.qvel[:] = coordinates.joints(initial)
    done = 0
    with magnetism():
        for count in record_chunks(records, record_interval):
            qpos, qvel = np.empty((count, model.nq)), np.empty((count, model.nv))
            time = np.empty(count)
            for row in range(count):
                if scene.ring_script:
                    for step in range(done, done + record_interval):
                        _move_ring(scene, data, (step + 0.5) * timestep)
                        mujoco.mj_step(model, data)
                else:
                    mujoco.mj_step(model, data, nstep=record_interval)
                done += record_interval
                qpos[row], qvel[row], time[row] = data.qpos, data.qvel, done * timestep
            yield coordinates.states(time, qpos, qvel)


def _move_ring(scene: Top, data: mujoco.MjData, time: float) -> None:
    height, tilt = scene.ring_pose(time)
    data.mocap_pos[0] = 0.0, 0.0, height
    data.mocap_quat[0] = scene.ring_quaternion(tilt)
