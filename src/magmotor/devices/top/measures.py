"""Measures of the top: numbers that are read off a run."""

import numpy as np
import xarray as xr

from magmotor.device.device import Measure
from magmotor.devices.top.observables import momentum_balance
from magmotor.devices.top.scene import Top

LATE = 0.1
"""The part of a run, at its end, in which a top is looked at for where it has settled."""


def _spin(run: xr.Dataset, scene: Top) -> xr.DataArray:
    return run.momentum_map / scene.inertia[2]


def _late(run: xr.Dataset) -> xr.Dataset:
    first, last = run.time.values[[0, -1]]
    return run.isel(time=run.time >= last - LATE * (last - first))


def _radius(run: xr.Dataset) -> xr.DataArray:
    x, y = run.position.sel(space="x"), run.position.sel(space="y")
    return np.hypot(x, y)


def _speed(run: xr.Dataset) -> xr.DataArray:
    return np.sqrt((run.velocity**2).sum("space"))


def _momentum_residual(run: xr.Dataset, scene: Top) -> float:
    residual = np.abs(momentum_balance(run, scene).residual).max()
    largest = np.abs(run.momentum_map).max()
    return float(residual / largest) if largest else 0.0


MEASURES: dict[str, Measure] = {
    "max_spin": Measure(
        lambda run, scene: abs(_spin(run, scene)).max("time"), "rad/s", "largest |J|/I_3"
    ),
    "final_spin": Measure(
        lambda run, scene: _spin(run, scene).isel(time=-1), "rad/s", "J/I_3 at the end"
    ),
    "max_momentum_map": Measure(
        lambda run, scene: abs(run.momentum_map).max("time"), "kg m^2/s", "largest |J|"
    ),
    "settling_radius": Measure(
        lambda run, scene: _radius(_late(run)).mean("time"),
        "m",
        "mean distance from the center in the last tenth of the run",
    ),
    "settling_speed": Measure(
        lambda run, scene: _speed(_late(run)).mean("time"),
        "m/s",
        "mean speed of the ball in the last tenth of the run",
    ),
    "momentum_residual": Measure(
        _momentum_residual, "1", "J against the integral of friction's torque, over max |J|"
    ),
}
