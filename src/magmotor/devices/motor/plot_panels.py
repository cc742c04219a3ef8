"""A run of the motor with its observables, and functions that draw it in one panel."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.common.checks import check_type
from magmotor.device.analysis import checked_run, scene_of_run
from magmotor.devices.motor.energy import motor_energy_balance
from magmotor.devices.motor.flights import dwell_times, flights
from magmotor.devices.motor.modes import mode_temperatures
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor

if TYPE_CHECKING:
    from matplotlib.axes import Axes


NEEDS = (
    *("position", "velocity", "slip_velocity", "momentum_map", "ring_orientation"),
    *("ring_angular_velocity", "energy", "ring_energy", "heat", "work"),
)
"""The variables that a run must have."""

BINS = 150
"""Number of bins of a long series; the extremes of each bin are drawn."""

THOUSAND = 1e-3
"""Factor from seconds to the unit of the time axes."""

THEORY: dict[str, Any] = {"color": style.ORANGE, "ls": "--", "lw": 1.6}
BACKGROUND: dict[str, Any] = {"color": style.GRAY, "lw": 0.8, "zorder": 1}

MODES = {
    "radial": "ball, radial",
    "slip": "ball, slip",
    "rolling": "ball, rolling around",
    "spin": "ball, about its dipole",
    "ring_1": "ring, across, 1",
    "ring_2": "ring, across, 2",
    "ring_3": "ring, about its axis",
}
"""Names of the modes in figures, from top to bottom."""


@dataclass(frozen=True)
class MotorRun:
    """A run and its observables.

    Parameters
    ----------
    name : str
    data : xarray.Dataset
        From `simulate`, without replicas. A run with the attribute `stopped` ended early. Variables
        that no picture needs are not checked, and may contain NaN.
    """

    name: str
    data: xr.Dataset

    def __post_init__(self) -> None:
        """Check that the data are a run."""
        check_type("name", self.name, str)
        checked_run("data", self.data, NEEDS, (Motor,), records=2, replicas=False)
        scene_of_run(self.data, None, (Motor,))

    @cached_property
    def scene(self) -> Motor:
        """The scene of the run."""
        return scene_of_run(self.data, None, (Motor,))

    @property
    def title(self) -> str:
        """Name, strength of the noise, and end time of a run that ended early."""
        early = f", ended at {self.data.time[-1]:.0f} s" if "stopped" in self.data.attrs else ""
        return f"{self.name}: α = {self.scene.noises[-1]:g}{early}"

    @property
    def times(self) -> Array:
        """The recorded times in 1000 s."""
        return THOUSAND * self.data.time.values

    @cached_property
    def revolutions(self) -> Array:
        """Azimuth of the ball in revolutions."""
        return azimuth(self.data).values / (2 * np.pi)

    @cached_property
    def flights(self) -> xr.Dataset:
        """Flights of the ball."""
        return flights(self.data, self.scene)

    @cached_property
    def dwell_times(self) -> xr.Dataset:
        """Dwell times between the flights."""
        return dwell_times(self.data, self.scene)

    @cached_property
    def balance(self) -> xr.Dataset:
        """Energy balance of the run."""
        return motor_energy_balance(self.data, self.scene)

    @cached_property
    def temperatures(self) -> xr.Dataset:
        """Temperatures of the modes over the second half."""
        burn_in = self.middle - float(self.data.time[0])
        return mode_temperatures(self.data, self.scene, burn_in=burn_in)

    @property
    def middle(self) -> float:
        """The time in s at which the second half begins."""
        return float(self.data.time[[0, -1]].mean())

    @property
    def longest(self) -> xr.Dataset | None:
        """The flight with the most revolutions, if there is a flight."""
        revolutions = np.abs(self.flights.revolutions.values)
        return self.flights.isel(flight=int(revolutions.argmax())) if len(revolutions) else None

    @property
    def longest_turns(self) -> float:
        """Unsigned revolutions of the longest flight; 0 without a flight."""
        return 0.0 if self.longest is None else abs(float(self.longest.revolutions))

    @property
    def flights_in_words(self) -> str:
        """Number of flights and length of the longest one, as text."""
        count, longest = self.flights.sizes["flight"], self.longest
        if longest is None:
            return "no flight"
        which = "one flight" if count == 1 else f"{count} flights, the longest"
        lasts = float(longest.end - longest.begin)
        return f"{which} of {self.longest_turns:.1f} revolutions in {lasts:.0f} s"

    @property
    def residual(self) -> float:
        """Largest residual of the energy balance as a fraction of the mean injected energy."""
        return float(abs(self.balance.residual).max() / self.balance.injected[-1])


def draw_injected(axes: "Axes", run: MotorRun) -> None:
    """Draw the work of the noise, its mean in theory, and the heat."""
    balance = run.balance
    _draw_series(axes, run, balance.work, color=style.BLUE, label="work of the noise", lw=4)
    _draw_series(axes, run, balance.heat, color=style.GREEN, label="dissipated by friction", lw=2.2)
    label = "injected in the mean: theory"
    _draw_series(axes, run, balance.injected, label=label, **THEORY | {"lw": 1.0})
    axes.set(ylabel="energy (J)")


def draw_path(axes: "Axes", run: MotorRun) -> None:
    """Draw the path of the ball from above, under the two rings."""
    scene = run.scene
    x, y = _thinned(run.data.position.values, 8000)[:, :2].T
    around = np.linspace(0, 2 * np.pi, 181)
    rings = (("inner ring", scene.inner_radius, "--"), ("outer ring", scene.outer_radius, "-"))
    for name, radius, dashes in rings:
        circle = radius * np.cos(around), radius * np.sin(around)
        axes.plot(*circle, ls=dashes, label=name, **BACKGROUND)
    dipoles = scene.outer_sources()[0][:, :2]
    axes.plot(*dipoles.T, "o", color=style.ORANGE, ms=6, label="its dipoles", zorder=3)
    axes.plot(x, y, color=style.BLUE, lw=0.4, label="path of the ball", zorder=2)
    reach = 1.08 * max(scene.outer_radius, np.abs(x).max(), np.abs(y).max())
    axes.set(xlabel="x (m)", ylabel="y (m)", xlim=(-reach, reach), ylim=(-reach, reach))
    axes.set_aspect("equal")
    axes.grid(visible=False)


def draw_theta(axes: "Axes", run: MotorRun) -> None:
    """Draw the azimuth over time, with flights shaded."""
    _draw_series(axes, run, run.revolutions, color=style.BLUE, label="azimuth of the ball")
    for flight in range(run.flights.sizes["flight"]):
        begin, end = (run.flights[name].values[flight] for name in ("begin", "end"))
        axes.axvspan(
            THOUSAND * begin, THOUSAND * end, color=style.GREEN, alpha=0.18, lw=0, label="flight"
        )
    axes.set(ylabel="azimuth (revolutions)")


def draw_onset(axes: "Axes", run: MotorRun) -> None:
    """Draw the azimuth around the beginning of the longest flight, or all of it without flight."""
    times, revolutions = run.times, run.revolutions
    first, last = 0, len(times)
    if run.longest is not None:
        begin = int(np.searchsorted(run.data.time.values, float(run.longest.begin)))
        once = begin + int(np.argmax(np.abs(revolutions[begin:] - revolutions[begin]) >= 1))
        first, last = max(0, 2 * begin - once), once
    shown = slice(first, last)
    count, turns = run.scene.outer_dipoles, revolutions[shown]
    low, high = count * np.array([turns.min(), turns.max()])
    wells = np.arange(np.floor(low), np.ceil(high) + 1) / count
    axes.hlines(wells, times[first], times[last - 1], label="wells", **BACKGROUND)
    axes.plot(*extremes(times[shown], turns), color=style.BLUE)
    axes.grid(visible=False)
    axes.set(xlabel="t (1000 s)", ylabel="azimuth (revolutions)")


def draw_temperatures(axes: "Axes", run: MotorRun, others: Sequence[MotorRun]) -> None:
    """Draw the temperature of each mode, ± 2 standard errors, also of other runs, and theory."""
    rows = np.arange(len(MODES))[::-1]
    uniform = run.scene.temperature == "uniform"
    runs = [run, *(other for other in others if other.scene.temperature == run.scene.temperature)]
    labels = ["this run, ± 2 standard errors", "other runs", *[None] * len(runs)]
    for number, (each, label) in enumerate(zip(runs, labels, strict=False)):
        found = each.temperatures.sel(mode=[*MODES])
        unit = each.scene.kT if uniform else 1e-6
        axes.errorbar(
            found.temperature / unit, rows - 0.15 * number, xerr=2 * found.temperature_error / unit,
            fmt="o", color=style.GRAY if number else style.BLUE, ms=4, label=label,
        )  # fmt: skip
    if uniform:
        axes.axvline(1, label="theory", **THEORY)
    else:
        axes.set_xscale("log")
    axes.set_yticks(rows, list(MODES.values()))
    label = "temperature / kT, kT = α²/2c" if uniform else "temperature (µJ)"
    axes.set(xlabel=label, ylim=(-3.7, len(MODES) - 0.4))


def _draw_series(axes: "Axes", run: MotorRun, values: Any, **line_style: Any) -> None:
    axes.plot(*extremes(run.times, np.asarray(values)), **line_style)
    axes.set(xlabel="t (1000 s)", xlim=(run.times[0], run.times[-1]))


def extremes(times: Array, values: Array, bins: int = BINS) -> tuple[Array, Array]:
    """Return the smallest and largest value in each bin of a long series, in order of time."""
    chosen = {0, len(times) - 1}
    for part in slices(len(times), bins):
        chosen |= {part.start + int(values[part].argmin()), part.start + int(values[part].argmax())}
    kept = sorted(chosen)
    return times[kept], values[kept]


def slices(count: int, bins: int) -> list[slice]:
    """Return the slices of a series of this length into bins."""
    length = -(-count // bins)
    return [slice(start, start + length) for start in range(0, count, length)]


def _thinned(values: Array, count: int) -> Array:
    """Return about `count` of the values, evenly spaced."""
    return values[:: max(1, len(values) // count)]
