"""Plots: figures drawn from datasets."""

from magmotor.devices.disk.plots import disk_figure, disk_overview
from magmotor.devices.motor.panels import MotorRun
from magmotor.devices.motor.plots import motor_figure, motor_overview
from magmotor.devices.top.plots import overview, spin_map
from magmotor.sweep.plots import sweep

__all__ = [
    "MotorRun",
    "disk_figure",
    "disk_overview",
    "motor_figure",
    "motor_overview",
    "overview",
    "spin_map",
    "sweep",
]
