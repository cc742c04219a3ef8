"""One of the four systems of the disk: its ensembles, their slopes and rates, and theory."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice
from magmotor.device.analysis import checked_run, scene_of_run
from magmotor.devices.disk.observables import local_slope
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.curves import DiskTheory

SYSTEMS = {
    "symmetric": (style.BLUE, "o"),
    "asymmetric": (style.ORANGE, "s"),
    "flat": (style.GREEN, "^"),
    "control": (style.PURPLE, "D"),
}
"""Names of the four systems, with the color and marker that each has in all figures."""

NEEDS = ("mean", "mean_error", "mean_square", "mean_square_error", "increment_correlation")
"""Variables that an ensemble must have."""

BEYOND = 20
"""Theory is drawn up to this multiple of the run's duration."""


class Slope(NamedTuple):
    """A slope between two times, its standard error, and the slope by theory."""

    begin: float
    end: float
    slope: float
    error: float
    expected: float


@dataclass(frozen=True)
class System:
    """One of the four systems: ensembles from rest and from the stationary state, and theory."""

    name: str
    rest: xr.Dataset
    stationary: xr.Dataset

    def __post_init__(self) -> None:
        """Check that both are ensembles of the system."""
        check_choice("name", self.name, tuple(SYSTEMS))
        for name in ("rest", "stationary"):
            data = checked_run(
                name, getattr(self, name), NEEDS, (Disk, LangevinParticle), records=3
            )
            scene_of_run(data, None, (Disk, LangevinParticle))

    @cached_property
    def theory(self) -> DiskTheory:
        """Theory of the scene in the dataset's attributes."""
        return DiskTheory(scene_of_run(self.rest, None, (Disk, LangevinParticle)))

    @property
    def has_varying_d(self) -> bool:
        """Whether d varies: a disk in a potential that is not flat."""
        return self.theory.has_varying_d

    @property
    def end(self) -> float:
        """Last recorded time."""
        return float(self.rest.time[-1])

    def x(self, statistic: str) -> Array:
        """Return a moment of x from rest at `times`."""
        return self.rest[statistic].sel(quantity="x").values[1:]

    @property
    def times(self) -> Array:
        """The recorded times after the start."""
        return self.rest.time.values[1:]

    @property
    def variance(self) -> Array:
        """Variance of x from rest, at `times`."""
        return self.x("mean_square") - self.x("mean") ** 2

    @property
    def last_slope(self) -> Slope:
        """Local slope of log E[x^2] against log t, over the last factor of two in time."""
        last = local_slope(self.rest).isel(time=-1)
        begin, end = float(last.begin), float(last.end)
        grown = np.log(self.theory.mean_square(end) / self.theory.mean_square(begin))
        expected = float(grown / np.log(end / begin))
        return Slope(begin, end, float(last.slope), float(last.slope_error), expected)

    def rate(self, quantity: str) -> tuple[float, float]:
        """Return Var/t of x or y from rest at the end, and its standard error."""
        last = self.rest.sel(quantity=quantity).isel(time=-1)
        variance = float(last.mean_square - last["mean"] ** 2)
        return variance / self.end, float(last.mean_square_error) / self.end

    @cached_property
    def later(self) -> Array:
        """Times for curves over logarithmic axes, four per octave, to `BEYOND` times the end."""
        octaves = np.log2(BEYOND * self.end / self.times[0])
        return self.times[0] * 2 ** np.arange(0, octaves, 0.25)

    @cached_property
    def later_mean_square(self) -> Array:
        """Mean square of x at `later`, by theory."""
        return self.theory.mean_square(self.later)

    @property
    def later_variance(self) -> Array:
        """Variance of x at `later`, by theory."""
        return self.later_mean_square - self.theory.mean(self.later) ** 2
