"""The initial state of a run of the ball: the scene's own, with parts replaced."""

from collections.abc import Mapping
from typing import Any

import xarray as xr

from magmotor.devices.initial_parts import given_parts
from magmotor.scenes import Top
from magmotor.states.ball import BallStates, start

SIZES = {"position": 3, "velocity": 3, "axis": 3, "angular_velocity": 3, "orientation": 4}


def initial_state(
    scene: Top, initial: Mapping[str, Any] | xr.Dataset | None, replicas: None = None
) -> BallStates:
    """The state that a run starts from, as one row; see `simulate` for `initial`.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    return start(scene)._replace(**given_parts(scene, SIZES, initial, 1))
