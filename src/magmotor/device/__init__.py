"""What a device is: its protocol, and what all devices share.

Who writes a device takes all from here; `examples/own_device.py` is one.
"""

from magmotor.device.device import (
    Device,
    Engine,
    Measure,
    MujocoAdapter,
    Observable,
    Scene,
    register,
)
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, LARGEST_FLUCTUATION, Fault, Guard
from magmotor.device.initial import as_given, last_record
from magmotor.device.job import Job
from magmotor.device.labels import labeled
from magmotor.device.movie import Gauge, MovieContent, between
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
    "as_given",
    "between",
    "check_fields",
    "check_step_limit",
    "labeled",
    "last_record",
    "quantity",
    "register",
]
