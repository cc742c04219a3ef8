"""Plots: figures drawn from datasets."""

from magmotor.plots.disk import disk_figure, disk_overview
from magmotor.plots.motor import motor_figure, motor_overview
from magmotor.plots.motor_panels import MotorRun
from magmotor.plots.overview import overview
from magmotor.plots.spin_map import spin_map
from magmotor.plots.sweep import sweep

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
