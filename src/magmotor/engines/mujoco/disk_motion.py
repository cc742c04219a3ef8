"""What is particular to runs of the disk: its replicas, each with a Brownian path of its own."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco.disk_coordinates import disk_states, joints


class DiskMotion:
    """See `magmotor.engines.mujoco.run.Motion`."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)
    states = staticmethod(disk_states)

    def __init__(self, job: Job):
        self.driven = job.scene.noise > 0 or len(job.scene.coefficients) > 0
        self.start = np.hstack(joints(job.initial))
        path, replicas = job.path, np.arange(len(self.start))
        chosen = (path.seed, replicas, path.factor, path.level, job.first_step)
        self.userdata = np.stack(np.broadcast_arrays(*chosen), axis=-1).astype(float)

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64]:
        """What the Brownian wrenches are told, the same in each step."""
        return self.userdata[:, np.newaxis]
