"""What is particular to runs of the disk: its replicas, each with a Brownian path of its own."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco.brownian import userdata
from magmotor.engines.mujoco.disk_coordinates import disk_states, joints
from magmotor.states.disk import DiskStates


class DiskMotion:
    """See `magmotor.engines.mujoco.run.Motion`."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)

    def __init__(self, job: Job):
        self.driven = job.scene.noise > 0 or len(job.scene.coefficients) > 0
        self.start = np.hstack(joints(job.initial))
        self.userdata = userdata(job, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64]:
        """What the Brownian wrenches are told, the same in each step."""
        return self.userdata[:, np.newaxis]

    def sums(self, before, paths, first) -> NDArray[np.float64]:
        """None."""
        return paths[..., :0]

    def states(self, time, qpos, qvel, sums) -> DiskStates:
        """The disk's states from joint coordinates, shape (replicas, T, 2)."""
        return disk_states(time, qpos, qvel)
