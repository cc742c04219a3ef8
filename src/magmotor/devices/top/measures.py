"""Measures of the top."""

import numpy as np
import xarray as xr

from magmotor.device.observable import Measure
from magmotor.devices.top.observables import (
    DISTANCE,
    MOMENTUM_MAP,
    SPEED,
    SPIN,
    momentum_balance,
)
from magmotor.devices.top.scene import Top

LATE = 0.1
"""The last part of a run, by which time the top has settled."""


def _largest(values: xr.DataArray) -> xr.DataArray:
    return abs(values).max("time")


def _late_mean(values: xr.DataArray) -> xr.DataArray:
    first, last = values.time.values[[0, -1]]
    return values.isel(time=values.time >= last - LATE * (last - first)).mean("time")


def _momentum_residual(run: xr.Dataset, scene: Top) -> float:
    residual = np.abs(momentum_balance(run, scene).residual).max()
    largest = np.abs(run.momentum_map).max()
    return float(residual / largest) if largest else 0.0


MEASURES: dict[str, Measure] = {
    "max_spin": SPIN.measure("largest magnitude of the {}", _largest),
    "final_spin": SPIN.measure("{} at the end", lambda spin: spin.isel(time=-1)),
    "max_momentum_map": MOMENTUM_MAP.measure("largest magnitude of the {}", _largest),
    "settling_radius": DISTANCE.measure("mean {} in the last tenth of the run", _late_mean),
    "settling_speed": SPEED.measure("mean {} in the last tenth of the run", _late_mean),
    "momentum_residual": Measure(
        _momentum_residual, "1", "residual of the momentum balance over the largest |J|"
    ),
}
