"""Panels of one system of the disk: simulation, and theory on top of it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice
from magmotor.device.analysis import checked_run, scene_of_run
from magmotor.devices.disk.observables import flight_survival, local_slope
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.curves import DiskTheory

if TYPE_CHECKING:
    from matplotlib.axes import Axes


NEEDS = ("mean", "mean_error", "mean_square", "mean_square_error", "increment_correlation")
"""Variables that an ensemble must have."""

BEYOND = 20
"""Theory is drawn up to this multiple of the run's duration."""

THEORY: dict[str, Any] = {"color": style.INK, "lw": 1.0, "ls": "--", "zorder": 4}
GUIDE: dict[str, Any] = {"color": style.GRAY, "lw": 1.0, "ls": ":", "zorder": 3}


@dataclass(frozen=True)
class Guide:
    """Additional lines for comparison with each system, dotted and gray.

    Parameters
    ----------
    label : str
        Label in the legend.
    draw : callable
        `draw(axes, name, system)` draws the lines for a system into the panel `name`, in the style
        `GUIDE`.
    """

    label: str
    draw: "Callable[[Axes, str, System], None]"


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
        check_choice("name", self.name, tuple(style.SYSTEMS))
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


def draw_mean(axes: "Axes", system: System) -> None:
    """Draw E[x(t)] with a band of two standard errors."""
    color, _ = style.SYSTEMS[system.name]
    mean, error = system.x("mean"), 2 * system.x("mean_error")
    band = {"color": color, "alpha": 0.2, "lw": 0}
    axes.fill_between(system.times, mean - error, mean + error, **band)
    axes.plot(system.times, mean, color=color)
    axes.plot(system.times, system.theory.mean(system.times), **THEORY)
    axes.set(xlabel="t", ylabel="E[x(t)]", xlim=(0, system.end))


def draw_mean_square(axes: "Axes", system: System) -> None:
    """Draw E[x(t)^2] at evenly spaced times."""
    even = np.searchsorted(system.times, np.linspace(0, system.end, 21)[1:] * (1 - 1e-9))
    _draw_points(axes, system, system.times, system.x("mean_square"), _errors(system), even)
    t = np.linspace(0, system.end, 61)[1:]
    axes.plot(t, system.theory.mean_square(t), **THEORY)
    axes.set(xlabel="t", ylabel="E[x(t)²]", xlim=(0, 1.02 * system.end))


def draw_msd(axes: "Axes", system: System) -> None:
    """Draw E[x(t)^2] on logarithmic axes."""
    chosen = _per_decade(system.times, 6)
    _draw_points(axes, system, system.times, system.x("mean_square"), _errors(system), chosen)
    axes.plot(system.later, system.later_mean_square, **THEORY)
    axes.set(xlabel="t", ylabel="E[x(t)²]", xscale="log", yscale="log")


def draw_slope(axes: "Axes", system: System) -> None:
    """Draw the local slope of the logarithmic MSD, over a factor of two in time."""
    found = local_slope(system.rest)
    times = found.time.values
    chosen = _per_decade(times, 6)
    _draw_points(axes, system, times, found.slope.values, 2 * found.slope_error.values, chosen)
    octave = np.log2(system.later_mean_square[4:] / system.later_mean_square[:-4])
    axes.plot(system.later[2:-2], octave, **THEORY)
    axes.set(xlabel="t", ylabel="d log E[x²] / d log t", xscale="log", ylim=(0.5, 3.2))


def draw_correlation(axes: "Axes", system: System) -> None:
    """Draw the correlation of successive increments in the stationary state."""
    run = system.stationary
    lag, rho = run.lag.values, run.increment_correlation.values
    every = np.arange(len(lag))
    _draw_points(axes, system, lag, rho, 2 * run.increment_correlation_error.values, every)
    s = np.geomspace(lag[0], BEYOND * lag[-1], 80)
    axes.plot(s, system.theory.correlation(s), **THEORY)
    axes.set(xlabel="lag s", ylabel="correlation", xscale="log", ylim=(-0.15, 1.05))


def draw_correlation_from_rest(axes: "Axes", system: System) -> None:
    """Draw the same in the second half of the run from rest, as in the paper."""
    rest, (color, marker) = system.rest, style.SYSTEMS[system.name]
    points = axes.errorbar(
        rest.lag, rest.increment_correlation, 2 * rest.increment_correlation_error, color=color,
        fmt=marker, ms=6.5, mfc="none", lw=0.8, zorder=1,
    )  # fmt: skip
    axes.legend([points], [f"from rest, t > {system.end / 2:g}"])


def draw_diffusion(axes: "Axes", system: System) -> None:
    """Draw Var x(t) / t."""
    chosen = _per_decade(system.times, 6)
    error = _errors(system) / system.times
    _draw_points(axes, system, system.times, system.variance / system.times, error, chosen)
    axes.plot(system.later, system.later_variance / system.later, **THEORY)
    axes.set(xlabel="t", ylabel="var x(t) / t", xscale="log", yscale="log")


def draw_histogram(axes: "Axes", system: System) -> None:
    """Draw the density of x at the end, and a Gaussian with the variance by theory."""
    x = system.rest.x.values
    deviation = float(np.sqrt(system.theory.variance(system.end)))
    reach = max(4.5 * deviation, 1.001 * float(np.abs(x).max()))
    edges = reach * np.linspace(-1, 1, 41)
    counts = np.histogram(x, edges)[0]
    scale = 1 / (len(x) * (edges[1] - edges[0]))
    centers = (edges[:-1] + edges[1:]) / 2
    # Two standard errors of a small count would reach below zero, which has no logarithm.
    errors = scale * np.array([np.minimum(2 * counts**0.5, 0.8 * counts), 2 * counts**0.5])
    _draw_points(axes, system, centers, scale * counts, errors, np.flatnonzero(counts))
    fine = deviation * np.linspace(-4, 4, 201)
    gaussian = np.exp(-0.5 * (fine / deviation) ** 2) / (deviation * np.sqrt(2 * np.pi))
    axes.plot(fine, gaussian, **THEORY)
    axes.set(xlabel=f"x at t = {system.end:g}", ylabel="density")


def draw_flights(axes: "Axes", system: System) -> None:
    """Draw the survival probability of flights, and two slopes for comparison."""
    found = flight_survival(system.stationary)
    times, survival = found.flight_duration.values, found.survival.values
    errors = 2 * found.survival_error.values
    chosen = np.flatnonzero(errors < survival)[::2]
    if not len(chosen):
        return
    _draw_points(axes, system, times, survival, errors, chosen)
    middle = np.interp(-0.4, -survival, times)  # where 40 % still last
    last = times[chosen[-1]]
    for power, anchor, begin, end in ((-0.5, middle, 0.15, 3.0), (-1.9, last, 0.4, 2.5)):
        t = anchor * np.array([begin, end])
        height = 1.25 * np.interp(anchor, times, survival)
        axes.plot(t, height * (t / anchor) ** power, **GUIDE)
        label = f"slope −{-power:.2g}"
        begins = (t[0], height * (t[0] / anchor) ** power)
        axes.annotate(label, begins, (5, 3), textcoords="offset points", fontsize="small")
    axes.set(xlabel="duration", ylabel="survival", xscale="log", yscale="log")


def _draw_points(axes: "Axes", system: System, t, values, errors, chosen) -> None:
    color, marker = style.SYSTEMS[system.name]
    axes.errorbar(
        t[chosen], values[chosen], errors[..., chosen], color=color, fmt=marker, ms=4.5, lw=1.2,
        zorder=2,
    )  # fmt: skip


def _errors(system: System) -> Array:
    """Return two standard errors of the mean square; those of the variance are nearly the same."""
    return 2 * system.x("mean_square_error")


def _per_decade(t: Array, count: int) -> NDArray[np.int64]:
    """Return indices of about `count` times per decade, backward from the last time."""
    wanted = np.arange(np.log10(t[-1]), np.log10(t[0]) - 1e-9, -1 / count)
    return np.unique(np.abs(np.log10(t) - wanted[:, np.newaxis]).argmin(axis=1))
