"""Panels of one system of the disk: simulation, and theory on top of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.devices.disk.observables import flight_survival, local_slope
from paper.disk.system import BEYOND, SYSTEMS, System

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MANY = 1000
"""Number of replicas from which a histogram has 40 bins, otherwise 10."""

TIME, DURATION = "t (dimensionless)", "duration (dimensionless)"

THEORY: dict[str, Any] = {"color": style.INK, "lw": 1.0, "ls": "--", "zorder": 4}
GUIDE: dict[str, Any] = {"color": style.GRAY, "lw": 1.0, "ls": ":", "zorder": 3}
BESIDE: dict[str, Any] = {
    "color": style.INK,
    "mfc": "white",
    "ms": 3.2,
    "mew": 0.8,
    "lw": 0.8,
    "zorder": 5,
}
"""Style of another engine's points."""


class Points(NamedTuple):
    """Points of a curve with two standard errors, of shape (N,) or below and above, (2, N)."""

    t: Array
    values: Array
    errors: Array

    def at(self, chosen: NDArray[np.int64]) -> "Points":
        """Return the points with these indices."""
        return Points(self.t[chosen], self.values[chosen], self.errors[..., chosen])


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


def draw_mean(axes: "Axes", system: System) -> None:
    """Draw E[x(t)] with a band of two standard errors."""
    color, _ = SYSTEMS[system.name]
    mean, error = system.x("mean"), 2 * system.x("mean_error")
    band = {"color": color, "alpha": 0.2, "lw": 0}
    axes.fill_between(system.times, mean - error, mean + error, **band)
    axes.plot(system.times, mean, color=color)
    axes.plot(system.times, system.theory.mean(system.times), **THEORY)
    axes.set(xlabel=TIME, ylabel="mean of x(t)", xlim=(0, system.end))


def mean(system: System) -> Points:
    """Return E[x(t)] at evenly spaced times."""
    return Points(system.times, system.x("mean"), 2 * system.x("mean_error")).at(_even(system, 10))


def mean_square(system: System) -> Points:
    """Return E[x(t)^2] at evenly spaced times."""
    return _mean_square(system).at(_even(system, 20))


def draw_mean_square(axes: "Axes", system: System) -> None:
    """Draw E[x(t)^2] at evenly spaced times."""
    _draw_points(axes, system, mean_square(system))
    t = np.linspace(0, system.end, 61)[1:]
    axes.plot(t, system.theory.mean_square(t), **THEORY)
    axes.set(xlabel=TIME, ylabel="mean square of x(t)", xlim=(0, 1.02 * system.end))


def msd(system: System) -> Points:
    """Return E[x(t)^2] at logarithmically spaced times."""
    return _mean_square(system).at(_per_decade(system.times, 6))


def draw_msd(axes: "Axes", system: System) -> None:
    """Draw E[x(t)^2] on logarithmic axes."""
    _draw_points(axes, system, msd(system))
    axes.plot(system.later, system.later_mean_square, **THEORY)
    axes.set(xlabel=TIME, ylabel="mean square of x(t)", xscale="log", yscale="log")


def slope(system: System) -> Points:
    """Return the local slope of the logarithmic MSD, over a factor of two in time."""
    found = local_slope(system.rest)
    points = Points(found.time.values, found.slope.values, 2 * found.slope_error.values)
    return points.at(_per_decade(points.t, 6))


def draw_slope(axes: "Axes", system: System) -> None:
    """Draw the local slope of the logarithmic MSD."""
    _draw_points(axes, system, slope(system))
    octave = np.log2(system.later_mean_square[4:] / system.later_mean_square[:-4])
    axes.plot(system.later[2:-2], octave, **THEORY)
    axes.set(xlabel=TIME, ylabel="d log E[x²] / d log t", xscale="log", ylim=(0.5, 3.2))


def correlation(system: System) -> Points:
    """Return the correlation of successive increments in the stationary state."""
    run = system.stationary
    errors = 2 * run.increment_correlation_error.values
    return Points(run.lag.values, run.increment_correlation.values, errors)


def draw_correlation(axes: "Axes", system: System) -> None:
    """Draw the correlation of successive increments in the stationary state."""
    points = correlation(system)
    _draw_points(axes, system, points)
    s = np.geomspace(points.t[0], BEYOND * points.t[-1], 80)
    axes.plot(s, system.theory.correlation(s), **THEORY)
    axes.set(xlabel="lag s (dimensionless)", ylabel="correlation", xscale="log", ylim=(-0.15, 1.05))


def draw_correlation_from_rest(axes: "Axes", system: System) -> None:
    """Draw the same in the second half of the run from rest, as in the paper."""
    rest, (color, marker) = system.rest, SYSTEMS[system.name]
    points = axes.errorbar(
        rest.lag, rest.increment_correlation, 2 * rest.increment_correlation_error, color=color,
        fmt=marker, ms=6.5, mfc="none", lw=0.8, zorder=1,
    )  # fmt: skip
    axes.legend([points], [f"from rest, t > {system.end / 2:g}"])


def diffusion(system: System) -> Points:
    """Return Var x(t) / t; the errors of the variance are nearly those of the mean square."""
    t = system.times
    points = Points(t, system.variance / t, _mean_square(system).errors / t)
    return points.at(_per_decade(t, 6))


def draw_diffusion(axes: "Axes", system: System) -> None:
    """Draw Var x(t) / t."""
    _draw_points(axes, system, diffusion(system))
    axes.plot(system.later, system.later_variance / system.later, **THEORY)
    axes.set(xlabel=TIME, ylabel="variance of x(t), over t", xscale="log", yscale="log")


def histogram(system: System) -> Points:
    """Return the density of x at the end, with fewer bins for fewer replicas."""
    x = system.rest.x.values
    deviation = float(np.sqrt(system.theory.variance(system.end)))
    reach = max(4.5 * deviation, 1.001 * float(np.abs(x).max()))
    edges = reach * np.linspace(-1, 1, 41 if len(x) >= MANY else 11)
    counts = np.histogram(x, edges)[0]
    scale = 1 / (len(x) * (edges[1] - edges[0]))
    centers = (edges[:-1] + edges[1:]) / 2
    # Two standard errors of a small count would reach below zero, which has no logarithm.
    errors = scale * np.array([np.minimum(2 * counts**0.5, 0.8 * counts), 2 * counts**0.5])
    return Points(centers, scale * counts, errors).at(np.flatnonzero(counts))


def draw_histogram(axes: "Axes", system: System) -> None:
    """Draw the density of x at the end, and a Gaussian with the variance by theory."""
    _draw_points(axes, system, histogram(system))
    deviation = float(np.sqrt(system.theory.variance(system.end)))
    fine = deviation * np.linspace(-4, 4, 201)
    gaussian = np.exp(-0.5 * (fine / deviation) ** 2) / (deviation * np.sqrt(2 * np.pi))
    axes.plot(fine, gaussian, **THEORY)
    axes.set(xlabel="x (dimensionless)", ylabel=f"density at t = {system.end:g}")


def survival(system: System) -> Points:
    """Return the probability that a flight lasts longer, where it is known."""
    found = flight_survival(system.stationary)
    errors = 2 * found.survival_error.values
    points = Points(found.flight_duration.values, found.survival.values, errors)
    return points.at(np.flatnonzero(errors < points.values)[::2])


def draw_flights(axes: "Axes", system: System) -> None:
    """Draw the survival probability of flights, and two slopes for comparison."""
    points = survival(system)
    if not len(points.t):
        return
    _draw_points(axes, system, points)
    axes.set(xlabel=DURATION, ylabel="fraction that lasts longer", xscale="log", yscale="log")
    if axes.texts:
        return  # another system has drawn the slopes
    found = flight_survival(system.stationary)
    times, lasting = found.flight_duration.values, found.survival.values
    middle = np.interp(-0.4, -lasting, times)  # where 40 % still last
    last = points.t[-1]
    for power, anchor, begin, end in ((-0.5, middle, 0.15, 3.0), (-1.9, last, 0.4, 2.5)):
        t = anchor * np.array([begin, end])
        height = 1.25 * np.interp(anchor, times, lasting)
        axes.plot(t, height * (t / anchor) ** power, **GUIDE)
        label = f"slope −{-power:.2g}"
        begins = (t[0], height * (t[0] / anchor) ** power)
        axes.annotate(label, begins, (14, 4), textcoords="offset points", fontsize="small")
    axes.margins(x=0.12, y=0.12)


def draw_beside(axes: "Axes", system: System, points: Points) -> None:
    """Draw the points of another engine on top of those of the system."""
    axes.errorbar(*points, fmt=SYSTEMS[system.name][1], **BESIDE)


def _draw_points(axes: "Axes", system: System, points: Points) -> None:
    color, marker = SYSTEMS[system.name]
    axes.errorbar(*points, color=color, fmt=marker, ms=4.5, lw=1.2, zorder=2)


def _mean_square(system: System) -> Points:
    return Points(system.times, system.x("mean_square"), 2 * system.x("mean_square_error"))


def _even(system: System, count: int) -> NDArray[np.int64]:
    """Return the indices of evenly spaced times up to the end."""
    even = np.linspace(0, system.end, count + 1)[1:]
    return np.searchsorted(system.times, even * (1 - 1e-9))


def _per_decade(t: Array, count: int) -> NDArray[np.int64]:
    """Return indices of about `count` times per decade, backward from the last time."""
    wanted = np.arange(np.log10(t[-1]), np.log10(t[0]) - 1e-9, -1 / count)
    return np.unique(np.abs(np.log10(t) - wanted[:, np.newaxis]).argmin(axis=1))
