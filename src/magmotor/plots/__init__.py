"""Plots: figures drawn from datasets."""

from magmotor.plots.disk import disk_figure, disk_overview
from magmotor.plots.motor import motor_figure, motor_overview
from magmotor.plots.motor_panels import MotorRun
from magmotor.plots.overview import overview

__all__ = ["MotorRun", "disk_figure", "disk_overview", "motor_figure", "motor_overview", "overview"]
