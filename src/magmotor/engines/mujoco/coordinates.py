"""The ball's state in MuJoCo's joint coordinates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor.states.ball import BallStates


@dataclass(frozen=True)
class BallCoordinates:
    """Joints of the planar ball (two slides and a ball joint) or of the free one (a free joint)."""

    surface: str
    ball_radius: float

    @property
    def linear(self) -> int:
        """Number of translational coordinates; the quaternion follows them."""
        return 2 if self.surface == "planar" else 3

    def joints(self, states: BallStates) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """`qpos` and `qvel` of the last of the states; MuJoCo's spin is in the body's frame."""
        n = self.linear
        assert states.orientation is not None, "engine states always have orientations here"
        orientation = states.orientation[-1]
        turn = Rotation.from_quat(orientation, scalar_first=True)
        spin = turn.inv().apply(states.angular_velocity[-1])
        qpos = np.concatenate([states.position[-1, :n], orientation])
        return qpos, np.concatenate([states.velocity[-1, :n], spin])

    def states(self, time, qpos, qvel) -> BallStates:
        """The ball's states from rows of joint coordinates."""
        n = self.linear
        position = np.full((len(time), 3), self.ball_radius)
        velocity = np.zeros((len(time), 3))
        position[:, :n], velocity[:, :n] = qpos[:, :n], qvel[:, :n]
        orientation = qpos[:, n:]
        # A diverged run leaves quaternions that are no rotations; its axis is recorded as NaN.
        broken = ~(np.linalg.norm(orientation, axis=1) > 0)
        identity = [1.0, 0.0, 0.0, 0.0]
        usable = np.where(broken[:, np.newaxis], identity, orientation)
        turn = Rotation.from_quat(usable, scalar_first=True)
        axis = turn.apply([0.0, 0.0, 1.0])
        axis[broken] = np.nan
        return BallStates(time, position, velocity, axis, turn.apply(qvel[:, n:]), orientation)
