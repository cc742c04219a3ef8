"""What engines exchange with the front door: recorded states of the ball."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from magmotor.scenes import Top

CHUNK = 20_000
"""Steps, or recorded states, after which an engine hands over what it has: some 0.1 s."""


class States(NamedTuple):
    """Recorded states, one row a time; vectors are in the world frame.

    `orientation` (w, x, y, z) is None from engines that follow the axis alone.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    axis: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]
    orientation: NDArray[np.float64] | None

    def rows(self, chosen: slice) -> "States":
        """Some of the rows."""
        orientation = None if self.orientation is None else self.orientation[chosen]
        return States(*[column[chosen] for column in self[:5]], orientation=orientation)

    def finite(self) -> NDArray[np.bool_]:
        """Which rows hold finite values only."""
        columns = [c.reshape(len(self.time), -1) for c in self if c is not None]
        return np.logical_and.reduce(np.isfinite(np.hstack(columns)), axis=1)


def concatenate(blocks: Sequence[States]) -> States:
    """One block of states from several; with orientations only where all have them."""
    columns = list(zip(*blocks, strict=True))
    whole = all(column is not None for column in columns[5])
    orientation = np.concatenate(columns[5]) if whole else None
    return States(*[np.concatenate(column) for column in columns[:5]], orientation=orientation)


def start(scene: Top) -> States:
    """The scene's own initial state, as one row."""
    axis = np.array([scene.axis]) / np.linalg.norm(scene.axis)
    return States(
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
