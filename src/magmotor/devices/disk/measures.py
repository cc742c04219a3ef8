"""Measures of the disk and of the Langevin particle, which are dimensionless."""

import xarray as xr

from magmotor.device.observable import Measure, Observable
from magmotor.devices.disk.scene import Disk

DISPLACEMENT = Observable(
    lambda run, scene: run.x - run.x.isel(time=0), "1", "displacement x - x(0)"
)
VELOCITY = Observable(lambda run, scene: run.v, "1", "velocity v")
ENERGY = Observable(lambda run, scene: run.energy, "1", "energy")


def _slip_temperature(run: xr.Dataset, scene: Disk) -> xr.DataArray:
    return ((run.v + run.omega) ** 2).mean("time") / (1 + 1 / scene.sigma)


OF_LANGEVIN: dict[str, Measure] = {
    "displacement": DISPLACEMENT.measure("{} at the end", lambda x: x.isel(time=-1)),
    "square_displacement": DISPLACEMENT.measure(
        "square of the {} at the end", lambda x: x.isel(time=-1) ** 2, unit="1"
    ),
    "largest_displacement": DISPLACEMENT.measure(
        "largest magnitude of the {}", lambda x: abs(x).max("time")
    ),
    "temperature": VELOCITY.measure(
        "mean of v^2, kT at equilibrium", lambda v: (v**2).mean("time"), unit="1"
    ),
    "mean_energy": ENERGY.measure("mean {}", lambda energy: energy.mean("time")),
}

OF_DISK: dict[str, Measure] = {
    **OF_LANGEVIN,
    "slip_temperature": Measure(
        _slip_temperature, "1", "mean of s^2/(1 + 1/sigma), kT at equilibrium"
    ),
}
