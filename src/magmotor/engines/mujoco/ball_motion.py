"""What is particular to runs of the ball: its coordinates, and the ring along its script."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.scenes import Top
from magmotor.states.ball import BallStates


def placed_ring(scene: Top, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position (3,) in m and orientation (4,) of the ring's mocap body at a time (s)."""
    height, tilt = scene.ring_pose(time)
    return np.array([0.0, 0.0, height]), scene.ring_quaternion(tilt)


class BallMotion:
    """See `magmotor.engines.mujoco.run.Motion`.

    A scripted ring stands still within a step, where its script has it at the middle of the step:
    an error of second order.
    """

    control = int(mujoco.mjtState.mjSTATE_MOCAP_POS) | int(mujoco.mjtState.mjSTATE_MOCAP_QUAT)
    driven = True

    def __init__(self, job: Job):
        self.scene, self.timestep = job.scene, job.timestep
        self.coordinates = BallCoordinates(job.scene.surface, job.scene.ball_radius)
        self.start = np.concatenate(self.coordinates.joints(job.initial))[np.newaxis]

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """Position and orientation of a scripted ring, step by step; others stay where they are."""
        if not self.scene.ring_script:
            return None
        times = (steps + 0.5) * self.timestep
        return np.array([[np.concatenate(placed_ring(self.scene, time)) for time in times]])

    def sums(self, before, paths, first) -> NDArray[np.float64]:
        """None."""
        return paths[..., :0]

    def states(self, time, qpos, qvel, sums) -> BallStates:
        """The ball's states from joint coordinates, shape (1, T, n)."""
        return self.coordinates.states(time, qpos[0], qvel[0])
