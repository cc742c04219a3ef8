"""States of the top: recorded states and the initial state."""

from typing import Annotated, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.hints import shaped
from magmotor.devices.ball.states import smallest_turn
from magmotor.devices.top.scene import Top

Rows = Annotated[NDArray[np.float64], shaped("T", 3)]


class BallStates(NamedTuple):
    """Recorded states, one row for each time; vectors are in the world frame.

    `orientation` (w, x, y, z) is None if the engine integrates only the axis.
    """

    time: Annotated[NDArray[np.float64], shaped("T")]
    position: Rows
    velocity: Rows
    axis: Rows
    angular_velocity: Rows
    orientation: Annotated[NDArray[np.float64], shaped("T", 4)] | None


def start(scene: Top) -> BallStates:
    """Return the initial state of the scene as one row."""
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
    """Return the recorded states in a dataset."""
    orientation = run["orientation"].values if "orientation" in run else None
    columns = [run[name].values for name in BallStates._fields[:-1]]
    return BallStates(*columns, orientation=orientation)
