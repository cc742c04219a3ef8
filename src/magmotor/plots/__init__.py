"""Plots: figures drawn from datasets."""

from magmotor.plots.disk import disk_figure, disk_overview
from magmotor.plots.overview import overview

__all__ = ["disk_figure", "disk_overview", "overview"]
