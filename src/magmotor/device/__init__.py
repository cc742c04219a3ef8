"""The protocol of devices, and the building blocks that all devices share.

A new device imports everything that it needs from here; see `examples/own_device.py`.
"""

from typing import TYPE_CHECKING, Any

from magmotor.common.checks import check_array, check_integer, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Device, Scene, register
from magmotor.device.engine import Engine, Equation, MujocoAdapter
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, LARGEST_FLUCTUATION, Fault, Guard
from magmotor.device.initial import initial_parts, initial_row
from magmotor.device.job import Job
from magmotor.device.movie import Gauge, MovieContent, SideView, between
from magmotor.device.observable import Measure, Observable, labeled
from magmotor.device.quantities import check_fields, quantity
from magmotor.device.readout import Readout
from magmotor.device.sliders import Slider
from magmotor.device.states import Column
from magmotor.device.step_limits import check_step_limit
from magmotor.numerics.linear_stability import SmallMotion

if TYPE_CHECKING:
    from magmotor.mjcf.forces.brownian_wrenches import userdata

__all__ = [
    "ENERGY_GREW",
    "LARGEST_ERROR",
    "LARGEST_FLUCTUATION",
    "ArgumentError",
    "Column",
    "Device",
    "Engine",
    "Equation",
    "Fault",
    "Gauge",
    "Guard",
    "Job",
    "Measure",
    "MovieContent",
    "MujocoAdapter",
    "Observable",
    "Readout",
    "Scene",
    "SideView",
    "Slider",
    "SmallMotion",
    "between",
    "check_array",
    "check_fields",
    "check_integer",
    "check_number",
    "check_step_limit",
    "initial_parts",
    "initial_row",
    "labeled",
    "quantity",
    "register",
    "userdata",
]


def __getattr__(name: str) -> Any:
    """Import `userdata` at its first use, since its module imports MuJoCo."""
    if name != "userdata":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from magmotor.mjcf.forces.brownian_wrenches import userdata

    return userdata
