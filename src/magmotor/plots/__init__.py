"""Plots: figures drawn from datasets."""

from magmotor.plots.overview import overview

__all__ = ["overview"]
