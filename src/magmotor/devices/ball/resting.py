"""The state of rest of a ball under its ring, and the matrices of small motions about it."""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import attitude, minimum, packed_sources, total_field
from magmotor.devices.ball.scene import BallScene

DISPLACEMENT = 1e-4
"""Step of the differences for the stiffness, in rad, or relative to the ball's radius."""


@checked
@lru_cache
def resting_ball(scene: BallScene) -> tuple[Array, Array]:
    """Return center (m) and axis of a ball at rest in the deepest minimum of V_e, shape (3,) each.

    For the motor, this is under the first outer dipole, with the inner ring level.

    Raises
    ------
    ValueError
        V_e has no minimum near the ring, for example since the floor is too steep.
    """
    if any(scene.floor_tilt):
        minimum(scene)  # of the motor, too, whose ball would roll off otherwise
    center = np.array([*scene.resting_place(), scene.ball_radius])
    field = total_field(scene, center, packed_sources(scene))
    return center, attitude(scene, field)[:, 0]


def slip_friction(friction: float, radius: float, size: int) -> Array:
    """Return the matrix of the friction -c V, V_x = v_x - r omega_y, V_y = v_y + r omega_x."""
    slip = np.zeros((2, size))
    slip[0, [0, 3]], slip[1, [1, 2]] = (1.0, -radius), (1.0, radius)
    return friction * slip.T @ slip


def background_drag(scene: BallScene, size: int) -> Array:
    """Return the matrix of the drag on the velocity and the rotation of the ball."""
    drags = [scene.drag] * 2 + [scene.rotational_drag] * 3
    return np.diag(drags + [0.0] * (size - len(drags)))


def scales(scene: BallScene, size: int) -> Array:
    """Return the steps in x, y and rotations of the differences for the stiffness."""
    return DISPLACEMENT * np.array([scene.ball_radius] * 2 + [1.0] * (size - 2))


def moved(scene: BallScene, center: Array, axis: Array, q: Array) -> tuple[Array, Array]:
    """Return centers and moments of a ball after displacements q of x, y and rotations, (k, n)."""
    from scipy.spatial.transform import Rotation

    centers = center + q[:, :2] @ np.eye(2, 3)
    return centers, scene.moment * Rotation.from_rotvec(q[:, 2:5]).apply(axis)


def stiffness(force: Callable[[Array], Array], scales: Array) -> Array:
    """Return -d force/d q by central differences, symmetrized."""
    changes = np.diag(scales)
    before, after = np.split(force(np.vstack([-changes, changes])), 2)
    columns = (before - after) / (2 * scales[:, np.newaxis])
    return (columns + columns.T) / 2


def split_by(spin: float, swing: float) -> float:
    """Return the higher of the two frequencies into which a spin, times J_3/J, splits a swing."""
    return abs(spin) / 2 + math.hypot(spin / 2, swing)
