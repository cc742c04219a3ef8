"""Running a scene in MuJoCo: stepping all replicas, and recording."""

import os
from collections.abc import Generator
from contextlib import nullcontext
from typing import Any, Protocol

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco import stopwatch
from magmotor.engines.mujoco.ball_motion import BallMotion
from magmotor.engines.mujoco.build import build
from magmotor.engines.mujoco.disk_motion import DiskMotion
from magmotor.engines.mujoco.magnetism import magnetism
from magmotor.scenes import Disk, Top
from magmotor.states import CHUNK

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}


class Motion(Protocol):
    """What a run must know of a device; it is made from the job.

    Attributes
    ----------
    start : ndarray, shape (replicas, nq + nv)
        Joint coordinates of the initial states.
    driven : bool
        Whether anything acts through the compiled callback.
    control : int
        What `controls` holds, as bits of `mjtState`.
    """

    start: NDArray[np.float64]
    driven: bool
    control: int

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """What MuJoCo is given in these steps, shape (replicas, steps or 1, n)."""
        ...

    def states(self, time: NDArray, qpos: NDArray, qvel: NDArray) -> Any:
        """States from joint coordinates, shape (replicas, T, nq or nv)."""
        ...


MOTIONS: dict[type, Any] = {Top: BallMotion, Disk: DiskMotion}


def run(job: Job) -> Generator[Any]:
    """Yield the recorded states that follow the initial one, in chunks."""
    model = build(job.scene)
    model.opt.timestep = job.timestep
    model.opt.integrator = INTEGRATORS[job.scheme]
    motion: Motion = MOTIONS[type(job.scene)](job)
    replicas = len(motion.start)
    data = [mujoco.MjData(model) for _ in range(min(replicas, os.cpu_count() or 1))]
    state = np.hstack([np.zeros((replicas, 1)), motion.start])
    done, last = 0, job.records * job.record_interval
    with magnetism() if motion.driven else nullcontext(), stopwatch.stopped():
        while done < last:
            steps = np.arange(done, min(done + max(1, CHUNK // replicas), last))
            state[:, 0] = done * job.timestep  # the sum of timesteps would drift
            controls = motion.controls(steps)
            paths, _ = rollout(
                model, data, state, controls, control_spec=motion.control, nstep=len(steps)
            )
            # A warning of huge values ends a rollout, and its last state is repeated.
            paths[np.diff(paths[..., 0], axis=1, prepend=state[:, :1]) <= 0] = np.nan
            state = paths[:, -1].copy()
            done += len(steps)
            recorded = (steps + 1) % job.record_interval == 0
            if recorded.any():
                qpos, qvel = np.split(paths[:, recorded, 1:], [model.nq], axis=-1)
                yield motion.states((steps[recorded] + 1) * job.timestep, qpos, qvel)
