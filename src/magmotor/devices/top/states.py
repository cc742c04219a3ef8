"""States of the top, as recorded and at the start."""

from typing import Annotated, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.hints import shaped
from magmotor.devices.ball.states import smallest_turn
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


def states_of(run: xr.Dataset) -> BallStates:
    """The recorded states in a dataset."""
    orientation = run["orientation"].values if "orientation" in run else None
    known = [run[name].values for name in BallStates._fields[:-1]]
    return BallStates(*known, orientation=orientation)
