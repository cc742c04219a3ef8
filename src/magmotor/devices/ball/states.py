"""Recorded states of the ball."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import shaped
from magmotor.devices.top.scene import Top

Rows = Annotated[NDArray[np.float64], shaped("T", 3)]


class BallStates(NamedTuple):
    """Recorded states, one row a time; vectors are in the world frame.

    `orientation` (w, x, y, z) is None from engines that follow the axis alone.
    """

    time: Annotated[NDArray[np.float64], shaped("T")]
    position: Rows
    velocity: Rows
    axis: Rows
    angular_velocity: Rows
    orientation: Annotated[NDArray[np.float64], shaped("T", 4)] | None


def start(scene: Top) -> BallStates:
    """The scene's own initial state, as one row."""
    axis = np.array([scene.axis]) / np.linalg.norm([scene.axis], axis=1)
    return BallStates(
        time=np.zeros(1),
        position=np.array([[*scene.position, scene.ball_radius]]),
        velocity=np.array([[*scene.velocity, 0.0]]),
        axis=axis,
        angular_velocity=scene.spin * axis,
        orientation=smallest_turn(axis[0])[np.newaxis],
    )


def smallest_turn(axis: ArrayLike) -> NDArray[np.float64]:
    """Orientation (w, x, y, z) that brings e_z to `axis` by the smallest turn."""
    vector = np.asarray(axis, dtype=float)
    x, y, z = vector / np.linalg.norm(vector, axis=-1)
    across = math.sqrt(x * x + y * y)
    if z >= 0:
        half = math.sqrt(0.5 * (1.0 + z))  # the cosine of half the angle
        return np.array([half, 0.0 - 0.5 * y / half, 0.5 * x / half, 0.0])  # no minus zero
    half = math.sqrt(0.5 * (1.0 - z))  # its sine
    along = (-y / across, x / across) if across else (1.0, 0.0)
    return np.array([0.5 * across / half, half * along[0], half * along[1], 0.0])


def axes(orientation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The body's z axis in the world frame; shapes (..., 4) -> (..., 3)."""
    w, x, y, z = np.moveaxis(orientation, -1, 0)
    square = w * w + x * x + y * y + z * z
    third = [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z]
    return np.stack(third, axis=-1) / square[..., np.newaxis]
