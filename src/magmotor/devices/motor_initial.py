"""The initial state of a run of the motor: the scene's own, with parts replaced."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from magmotor.checks import reject
from magmotor.devices.initial_parts import given_parts
from magmotor.scenes import Motor
from magmotor.scenes.motor import LARGEST_TILT
from magmotor.states.motor import MotorStates, start_motor

SIZES = {
    "position": 3,
    "velocity": 3,
    "axis": 3,
    "angular_velocity": 3,
    "orientation": 4,
    "ring_axis": 3,
    "ring_angular_velocity": 3,
    "ring_orientation": 4,
}


def initial_state(
    scene: Motor, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
) -> MotorStates:
    """The state that a run starts from, as one row of all replicas; see `simulate` for `initial`.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    state = start_motor(scene, replicas or 1)
    parts = given_parts(scene, SIZES, initial, replicas or 1)
    if "ring_axis" in parts and (parts["ring_axis"][:, 2] < np.cos(LARGEST_TILT)).any():
        bound = f"within {np.degrees(LARGEST_TILT):g} degrees of the vertical"
        raise reject("initial['ring_axis']", parts["ring_axis"].tolist(), bound)
    kept = {name: part[np.newaxis] for name, part in parts.items() if name in state._fields}
    return state._replace(**kept)
