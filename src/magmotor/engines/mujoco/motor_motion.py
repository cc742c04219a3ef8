"""What is particular to runs of the motor: its replicas, and the heat and work along each path."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco.brownian import userdata
from magmotor.engines.mujoco.coordinates import MotorCoordinates
from magmotor.engines.mujoco.motor_sums import heat_and_work_sums
from magmotor.states.motor import MotorStates

Array = NDArray[np.float64]


class MotorMotion:
    """See `magmotor.engines.mujoco.run.Motion`; the sums are heat of ball and ring, then work."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)
    driven = True

    def __init__(self, job: Job):
        self.job = job
        self.coordinates = MotorCoordinates(job.scene)
        first = job.initial
        sums = [first.ball_heat[-1], first.ring_heat[-1], first.ball_work[-1], first.ring_work[-1]]
        self.start = np.hstack([*self.coordinates.joints(first), np.stack(sums, axis=-1)])
        self.userdata = userdata(job, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> Array:
        """What the Brownian wrenches are told, the same in each step."""
        return self.userdata[:, np.newaxis]

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Heat and work after each step."""
        return heat_and_work_sums(self.job, self.coordinates.ball.linear, before, paths, first)

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> MotorStates:
        """The motor's states from joint coordinates and sums, shape (replicas, T, n)."""
        return self.coordinates.states(time, qpos, qvel, sums)
