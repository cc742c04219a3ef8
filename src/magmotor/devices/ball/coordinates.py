"""Conversion of a ball's states to MuJoCo's joint coordinates, with spins in the body frame."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from magmotor.common.arrays import Array


@dataclass(frozen=True)
class BallCoordinates:
    """Joints of a planar ball (two slides and a ball joint) or of a free ball (a free joint)."""

    surface: str
    ball_radius: float

    @property
    def linear(self) -> int:
        """Number of translational coordinates; the quaternion follows them."""
        return 2 if self.surface == "planar" else 3

    def joints(self, states: Any) -> tuple[Array, Array]:
        """Return `qpos` and `qvel` of the ball in the last row."""
        n = self.linear
        assert states.orientation is not None, "engine states always have orientations here"
        orientation = states.orientation[-1]
        spin = rot_vec_quat(neg_quat(orientation), states.angular_velocity[-1])
        qpos = np.concatenate([states.position[-1][..., :n], orientation], axis=-1)
        return qpos, np.concatenate([states.velocity[-1][..., :n], spin], axis=-1)

    def vectors(self, qpos: Array, qvel: Array) -> dict[str, Array]:
        """Return the ball's vectors and orientations from joint coordinates of shape (..., n)."""
        n = self.linear
        position = np.full((*qpos.shape[:-1], 3), self.ball_radius)
        velocity = np.zeros_like(position)
        position[..., :n], velocity[..., :n] = qpos[..., :n], qvel[..., :n]
        orientation = qpos[..., n:]
        spin = rot_vec_quat(orientation, qvel[..., n:])
        return {
            "position": position,
            "velocity": velocity,
            "angular_velocity": spin,
            "orientation": orientation,
        }


def rot_vec_quat(orientation: Array, vector: Array) -> Array:
    """Rotate vectors (..., 3) by unit quaternions (..., 4); NaN if they are not finite."""
    w, u = orientation[..., :1], orientation[..., 1:]
    with np.errstate(invalid="ignore"):
        across = 2 * np.cross(u, vector)
        return vector + w * across + np.cross(u, across)


def neg_quat(orientation: Array) -> Array:
    """Return the inverse of unit quaternions (..., 4)."""
    return orientation * [1.0, -1.0, -1.0, -1.0]
