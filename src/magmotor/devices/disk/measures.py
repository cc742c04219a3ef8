"""Measures of the disk and of the Langevin particle: numbers that are read off a run."""

import xarray as xr

from magmotor.device.device import Measure
from magmotor.devices.disk.scene import Disk, LangevinParticle


def _displacement(run: xr.Dataset, scene: Disk | LangevinParticle) -> xr.DataArray:
    return run.x.isel(time=-1) - run.x.isel(time=0)


def _slip_temperature(run: xr.Dataset, scene: Disk) -> xr.DataArray:
    return ((run.v + run.omega) ** 2).mean("time") / (1 + 1 / scene.sigma)


OF_LANGEVIN: dict[str, Measure] = {
    "displacement": Measure(_displacement, "1", "x at the end less x at the start"),
    "square_displacement": Measure(
        lambda run, scene: _displacement(run, scene) ** 2, "1", "square displacement of x"
    ),
    "largest_displacement": Measure(
        lambda run, scene: abs(run.x - run.x.isel(time=0)).max("time"),
        "1",
        "largest |x - x(0)|",
    ),
    "temperature": Measure(
        lambda run, scene: (run.v**2).mean("time"), "1", "mean of v^2, kT at equilibrium"
    ),
    "mean_energy": Measure(lambda run, scene: run.energy.mean("time"), "1", "mean energy"),
}

OF_DISK: dict[str, Measure] = {
    **OF_LANGEVIN,
    "slip_temperature": Measure(
        _slip_temperature, "1", "mean of s^2/(1 + 1/sigma), kT at equilibrium"
    ),
}
