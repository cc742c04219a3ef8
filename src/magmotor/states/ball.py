"""Recorded states of the ball."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from magmotor.arguments import shaped
from magmotor.scenes import Top

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
    axis = np.array([scene.axis]) / np.linalg.norm(scene.axis)
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
    rotation = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0]
    return rotation.as_quat(scalar_first=True)


def axes(orientation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The body's z axis in the world frame; shapes (..., 4) -> (..., 3)."""
    w, x, y, z = np.moveaxis(orientation, -1, 0)
    square = w * w + x * x + y * y + z * z
    third = [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z]
    return np.stack(third, axis=-1) / square[..., np.newaxis]
