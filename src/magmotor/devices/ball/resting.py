"""A ball at rest under its ring, and the matrices of small motions about that."""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.devices.ball.scene import BallScene

Array = NDArray[np.float64]

DISPLACEMENT = 1e-4
"""Of the differences that find a stiffness: an angle in rad, or a part of the ball's radius."""


@checked
@lru_cache
def resting_ball(scene: BallScene) -> tuple[Array, Array]:
    """Center (m) and axis of a ball at rest in the deepest minimum of V_e, each of shape (3,).

    The motor's is under the first outer dipole, with the inner ring level.
    """
    flat = scene.resting_place()
    place = np.array([*flat, scene.ball_radius])
    field = dipoles.field(place, *scene.ring_sources())
    return place, field / np.linalg.norm(field)


def slip_friction(friction: float, radius: float, size: int) -> Array:
    """Friction -c V on the slip V_x = v_x - r omega_y, V_y = v_y + r omega_x, as a matrix."""
    slip = np.zeros((2, size))
    slip[0, [0, 3]], slip[1, [1, 2]] = (1.0, -radius), (1.0, radius)
    return friction * slip.T @ slip


def scales(scene: BallScene, size: int) -> Array:
    """Changes of x, y and of turns whose differences find a stiffness."""
    return DISPLACEMENT * np.array([scene.ball_radius] * 2 + [1.0] * (size - 2))


def moved(scene: BallScene, place: Array, axis: Array, q: Array) -> tuple[Array, Array]:
    """Places and moments of a ball at rest after changes, shape (k, n), of its place and turns."""
    moved = place + q[:, :2] @ np.eye(2, 3)
    return moved, scene.moment * Rotation.from_rotvec(q[:, 2:5]).apply(axis)


def stiffness(force: Callable[[Array], Array], scales: Array) -> Array:
    """-d force/d q by central differences; symmetric but for what is left of the force itself."""
    changes = np.diag(scales)
    before, after = np.split(force(np.vstack([-changes, changes])), 2)
    columns = (before - after) / (2 * scales[:, np.newaxis])
    return (columns + columns.T) / 2


def split_by(spin: float, swing: float) -> float:
    """The faster of the two frequencies into which a spin, times J_3/J, splits a swing."""
    return abs(spin) / 2 + math.hypot(spin / 2, swing)
