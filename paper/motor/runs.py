"""The paper's seven motor runs, and sets of further runs, with their heat and work."""

from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.device.stops import PhysicalEvent
from magmotor.devices.motor.guard import TIPPED
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import PAPER, Motor
from magmotor.run.simulate import simulate

if TYPE_CHECKING:
    from paper.motor.weak_noise import WeakNoise

METHOD = "mujoco/baoab"
"""The method of the paper's runs."""

RECORDS = 100
"""Smallest number of records of a run that is kept."""

REFERENCE = "variational/baoab"
"""The method of the runs that judge those by `METHOD`."""

NUMERICS = {"method": METHOD, "timestep": 0.1, "record_interval": 10}
QUICK_NUMERICS = NUMERICS | {"timestep": 0.25, "record_interval": 4}
DURATION = 1e5
"""In s: long enough for flights; the paper does not state its duration."""

QUICK_DURATION = 4e4
"""In s; some of the paper's runs have flights in it."""


def until_tipping(scene: Motor, **arguments: Any) -> xr.Dataset:
    """Simulate a motor; if its ring tips over after `RECORDS`, the run has an attribute `stopped`.

    Arguments and errors are those of `simulate`.
    """
    try:
        return simulate(scene, **arguments)
    except PhysicalEvent as stop:
        if stop.event != TIPPED or stop.dataset.sizes["time"] < RECORDS:
            raise
        return stop.dataset.assign_attrs(stopped=f"at t = {stop.time:g} s: {stop.reason}")


def simulate_run(name: str, scene: Motor, **arguments: Any) -> MotorRun:
    """Simulate a motor until its ring tips over; see `until_tipping`."""
    return MotorRun(name, until_tipping(scene, **arguments))


@cache
def paper_runs(quick: bool) -> list[MotorRun]:
    """Simulate the paper's seven runs, with the seeds in `PAPER`."""
    duration, numerics = (QUICK_DURATION, QUICK_NUMERICS) if quick else (DURATION, NUMERICS)
    return [
        simulate_run(name, Motor.paper(name), duration=duration, seed=seed, **numerics)
        for name, (_, _, seed) in PAPER.items()
    ]


def of_temperature(runs: Sequence[MotorRun], kind: str) -> list[MotorRun]:
    """Return the runs at "uniform" or "nonuniform" temperature."""
    return [run for run in runs if run.scene.temperature == kind]


def in_flight(run: MotorRun) -> NDArray[np.bool_]:
    """Whether the ball is in flight, at each recorded time."""
    time = run.data.time.values[:, np.newaxis]
    begin, end = run.flights.begin.values, run.flights.end.values
    return np.any((begin <= time) & (time <= end), axis=1)


class HeatAndWork(NamedTuple):
    """Sums over time spans of a run, in J."""

    spans: int
    work: float
    """done by the noise"""
    injected: float
    """mean work of the noise"""
    heat: float
    """dissipated by friction"""
    ring: float
    """gained by the inner ring"""
    fastest: float
    """largest kinetic energy of the ball in each span"""


def heat_and_work_in_flights(run: MotorRun) -> HeatAndWork:
    """Return the heat and work in the flights of a run."""
    ends = np.stack([run.flights.begin.values, run.flights.end.values], axis=1)
    return _heat_and_work(run, np.searchsorted(run.data.time.values, ends))


def heat_and_work_of(run: MotorRun) -> HeatAndWork:
    """Return the heat and work in a whole run."""
    return _heat_and_work(run, np.array([[0, len(run.data.time) - 1]]))


def _heat_and_work(run: MotorRun, spans: NDArray[np.int_]) -> HeatAndWork:
    """Return the heat and work in spans from one record to another, shape (F, 2)."""
    data, scene, balance = run.data, run.scene, run.balance
    kinetic = 0.5 * (
        scene.ball_mass * (data.velocity**2).sum("space")
        + scene.ball_inertia * (data.angular_velocity**2).sum("space")
    )
    work, injected, heat, ring = (
        float(np.diff(series.values[spans], axis=1).sum())
        for series in (balance.work, balance.injected, balance.heat, data.ring_energy)
    )
    fastest = sum(float(kinetic[begin : end + 1].max()) for begin, end in spans)
    return HeatAndWork(len(spans), work, injected, heat, ring, fastest)


def added(several: Iterable[HeatAndWork]) -> HeatAndWork:
    """Return the sums of the heat and work of several runs."""
    return HeatAndWork(*(sum(values) for values in zip(*several, strict=True)))


class Size(NamedTuple):
    """Timestep and number of runs of a set."""

    timestep: float
    """in s; a hot ring needs a short one"""
    full: int
    quick: int


SETS = {
    "nonuniform-a": Size(0.1, full=64, quick=3),
    "uniform-a": Size(0.5, full=256, quick=2),
    "uniform-d": Size(0.5, full=64, quick=2),
}

SIGNIFICANT = 4
"""Standard errors of a significant difference."""

JUDGED = "uniform-a"
"""The set that the reference repeats."""

SEED = 1000
"""Seed of the first run."""

RECORD_INTERVAL = 5.0
"""Record interval, in s, in which the ball moves by much less than a quarter of a sector."""


class Flights(NamedTuple):
    """Durations of the flights of a set of runs after their first revolution, in s; shape (N,)."""

    lasts: NDArray[np.float64]
    limits: NDArray[np.float64]
    """until the end of its run"""
    censored: NDArray[np.bool_]


class ManyRuns(NamedTuple):
    """Results of a set of runs."""

    name: str
    method: str
    flights: Flights
    first: NDArray[np.float64]
    """start of the first flight of each run, in s, infinite if there is none; shape (R,)"""
    heat_and_work: list[HeatAndWork]
    """in the flights of each run"""
    whole: list[HeatAndWork]
    """in each whole run"""
    reach: float
    """largest distance of a ball from the axis, in m"""
    tipped: int
    """runs that ended because the inner ring tipped over"""

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.first)

    @property
    def flying(self) -> int:
        """Number of runs with a flight."""
        return int(np.isfinite(self.first).sum())


class Motors(NamedTuple):
    """Data of a figure of the paper's runs."""

    runs: list[MotorRun]
    """the paper's seven"""
    many: dict[str, ManyRuns]
    """further runs, by their names in `SETS`"""
    reference: ManyRuns | None = None
    """the set `JUDGED` by the reference"""
    weak: "WeakNoise | None" = None
    """runs at nonuniform temperature with a weaker noise"""
    quick: bool = False
    """whether the runs have the reduced size"""


@cache
def many_runs(name: str, quick: bool, method: str = METHOD) -> ManyRuns:
    """Simulate a set of `SETS`."""
    size = SETS[name]
    timestep = max(size.timestep, QUICK_NUMERICS["timestep"]) if quick else size.timestep
    runs = (
        simulate_run(
            name, Motor.paper(name), method=method, timestep=timestep,
            duration=DURATION, record_interval=round(RECORD_INTERVAL / timestep), seed=seed,
        )
        for seed in range(SEED, SEED + (size.quick if quick else size.full))
    )  # fmt: skip
    return collected(name, runs)


def collected(name: str, runs: Iterable[MotorRun]) -> ManyRuns:
    """Collect the results of runs, keeping only one run in memory at a time."""
    flights, first, heat_and_work, whole, reach, tipped, method = [], [], [], [], [], 0, ""
    for run in runs:
        method = run.data.attrs["method"]
        found = run.flights
        begin, end = found.once.values, found.end.values
        remaining = float(run.data.time[-1]) - begin
        flights.append(np.stack([end - begin, remaining, found.censored.values]))
        first.append(found.begin.values.min(initial=np.inf))
        heat_and_work.append(heat_and_work_in_flights(run))
        whole.append(heat_and_work_of(run))
        reach.append(float(np.hypot(*run.data.position.values[:, :2].T).max()))
        tipped += "stopped" in run.data.attrs
    lasts, limits, censored = np.concatenate(flights, axis=1)
    all_flights = Flights(lasts, limits, censored.astype(bool))
    return ManyRuns(
        name, method, all_flights, np.array(first), heat_and_work, whole, max(reach), tipped
    )
