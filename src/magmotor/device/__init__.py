"""The protocol of devices, and the building blocks that all devices share.

A new device imports everything that it needs from here; see `examples/own_device.py`.
"""

from magmotor.device.device import (
    Device,
    Engine,
    MujocoAdapter,
    Scene,
    register,
)
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, LARGEST_FLUCTUATION, Fault, Guard
from magmotor.device.initial import initial_parts
from magmotor.device.job import Job
from magmotor.device.movie import Gauge, MovieContent, between
from magmotor.device.observable import Measure, Observable, labeled
from magmotor.device.quantities import check_fields, quantity
from magmotor.device.sliders import Slider
from magmotor.device.states import Column
from magmotor.device.step_limits import check_step_limit

__all__ = [
    "ENERGY_GREW",
    "LARGEST_ERROR",
    "LARGEST_FLUCTUATION",
    "Column",
    "Device",
    "Engine",
    "Fault",
    "Gauge",
    "Guard",
    "Job",
    "Measure",
    "MovieContent",
    "MujocoAdapter",
    "Observable",
    "Scene",
    "Slider",
    "between",
    "check_fields",
    "check_step_limit",
    "initial_parts",
    "labeled",
    "quantity",
    "register",
]
