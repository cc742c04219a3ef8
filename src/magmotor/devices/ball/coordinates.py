"""States of ball and motor in MuJoCo's joint coordinates, whose spins are in the bodies' frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.ball.states import BallStates, axes
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BallCoordinates:
    """Joints of the planar ball (two slides and a ball joint) or of the free one (a free joint)."""

    surface: str
    ball_radius: float

    @property
    def linear(self) -> int:
        """Number of translational coordinates; the quaternion follows them."""
        return 2 if self.surface == "planar" else 3

    def joints(self, states: BallStates | MotorStates) -> tuple[Array, Array]:
        """`qpos` and `qvel` of the ball in the last of the states."""
        n = self.linear
        assert states.orientation is not None, "engine states always have orientations here"
        orientation = states.orientation[-1]
        spin = _turned(_conjugate(orientation), states.angular_velocity[-1])
        qpos = np.concatenate([states.position[-1][..., :n], orientation], axis=-1)
        return qpos, np.concatenate([states.velocity[-1][..., :n], spin], axis=-1)

    def vectors(self, qpos: Array, qvel: Array) -> dict[str, Array]:
        """What the states have in common, from joint coordinates of any shape (..., n)."""
        n = self.linear
        position = np.full((*qpos.shape[:-1], 3), self.ball_radius)
        velocity = np.zeros_like(position)
        position[..., :n], velocity[..., :n] = qpos[..., :n], qvel[..., :n]
        orientation = qpos[..., n:]
        spin = _turned(orientation, qvel[..., n:])
        return {
            "position": position,
            "velocity": velocity,
            "angular_velocity": spin,
            "orientation": orientation,
        }

    def states(self, time: Array, qpos: Array, qvel: Array) -> BallStates:
        """The ball's states from rows of joint coordinates."""
        vectors = self.vectors(qpos, qvel)
        return BallStates(time=time, axis=axes(vectors["orientation"]), **vectors)


class MotorCoordinates:
    """The ball's joints, and after them the inner ring's, a ball joint."""

    def __init__(self, scene: Motor):
        self.ball = BallCoordinates(scene.surface, scene.ball_radius)

    def joints(self, states: MotorStates) -> tuple[Array, Array]:
        """`qpos` and `qvel` of the last of the states, shapes (replicas, nq) and (replicas, nv)."""
        qpos, qvel = self.ball.joints(states)
        orientation = states.ring_orientation[-1]
        spin = _turned(_conjugate(orientation), states.ring_angular_velocity[-1])
        whole = np.concatenate([qpos, orientation], axis=-1)
        return whole, np.concatenate([qvel, spin], axis=-1)

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> MotorStates:
        """The motor's states from joint coordinates and sums, shape (replicas, T, n)."""
        qpos, qvel, sums = (np.swapaxes(rows, 0, 1) for rows in (qpos, qvel, sums))
        orientation = qpos[..., -4:]
        ball_heat, ring_heat, ball_work, ring_work = np.moveaxis(sums, -1, 0)
        return MotorStates(
            time=time,
            **self.ball.vectors(qpos[..., :-4], qvel[..., :-3]),
            ring_angular_velocity=_turned(orientation, qvel[..., -3:]),
            ring_orientation=orientation,
            ball_heat=ball_heat,
            ring_heat=ring_heat,
            ball_work=ball_work,
            ring_work=ring_work,
        )


def _turned(orientation: Array, vector: Array) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4); of what is not finite, NaN."""
    w, u = orientation[..., :1], orientation[..., 1:]
    with np.errstate(invalid="ignore"):
        across = 2 * np.cross(u, vector)
        return vector + w * across + np.cross(u, across)


def _conjugate(orientation: Array) -> Array:
    return orientation * [1.0, -1.0, -1.0, -1.0]
