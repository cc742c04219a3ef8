"""The paper's seven motors and many more runs like some of them, with their heat and work."""

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.device.stops import PhysicalEvent
from magmotor.devices.motor.guard import TIPPED
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import PAPER, Motor
from magmotor.run.simulate import simulate

RECORDS = 100
"""The least for which there are averages."""

NUMERICS = {"method": "variational/baoab", "timestep": 0.1, "record_interval": 10}
DURATION = 1e5
"""In s: long enough for flights; the paper does not tell its duration."""


def simulate_run(name: str, scene: Motor, **arguments: Any) -> MotorRun:
    """Simulate a motor; if its ring is lost after `RECORDS`, the run has an attribute `stopped`.

    Arguments and errors are those of `simulate`.
    """
    try:
        data = simulate(scene, **arguments)
    except PhysicalEvent as stop:
        if stop.event != TIPPED or stop.dataset.sizes["time"] < RECORDS:
            raise
        data = stop.dataset.assign_attrs(stopped=f"at t = {stop.time:g} s: {stop.reason}")
    return MotorRun(name, data)


@cache
def paper_runs() -> list[MotorRun]:
    """All seven, each by the realization that `PAPER` names."""
    return [
        simulate_run(name, Motor.paper(name), duration=DURATION, seed=seed, **NUMERICS)
        for name, (_, _, seed) in PAPER.items()
    ]


def of_temperature(runs: Sequence[MotorRun], kind: str) -> list[MotorRun]:
    """Those of one kind of temperature."""
    return [run for run in runs if run.scene.temperature == kind]


def in_flight(run: MotorRun) -> NDArray[np.bool_]:
    """Whether the ball is in flight, at each recorded time."""
    time = run.data.time.values[:, np.newaxis]
    begin, end = run.flights.begin.values, run.flights.end.values
    return np.any((begin <= time) & (time <= end), axis=1)


class HeatAndWork(NamedTuple):
    """Sums over some spans of a run, in J."""

    spans: int
    work: float
    """done by the noise"""
    injected: float
    """work of the noise in the mean"""
    heat: float
    """dissipated by friction"""
    ring: float
    """gained by the inner ring"""
    fastest: float
    """the greatest kinetic energy of the ball in each span"""


def heat_and_work_in_flights(run: MotorRun) -> HeatAndWork:
    """Heat and work in the flights of a run."""
    ends = np.stack([run.flights.begin.values, run.flights.end.values], axis=1)
    return _heat_and_work(run, np.searchsorted(run.data.time.values, ends))


def heat_and_work_of(run: MotorRun) -> HeatAndWork:
    """Heat and work in a whole run."""
    return _heat_and_work(run, np.array([[0, len(run.data.time) - 1]]))


def _heat_and_work(run: MotorRun, spans: NDArray[np.int_]) -> HeatAndWork:
    """Heat and work in spans from one record to another, shape (F, 2)."""
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
    """Sums of the heat and work of several runs."""
    return HeatAndWork(*(sum(values) for values in zip(*several, strict=True)))


class Size(NamedTuple):
    """How finely, and how many."""

    timestep: float
    """in s; a hot ring wants a short one"""
    full: int
    quick: int


SETS = {
    "nonuniform-a": Size(0.1, full=64, quick=8),
    "uniform-a": Size(0.5, full=256, quick=16),
    "uniform-d": Size(0.5, full=64, quick=8),
}

SEED = 1000
"""Of the first run."""

RECORD = 5.0
"""In s: the ball goes round by much less than a quarter of a sector meanwhile."""


class Flights(NamedTuple):
    """Flights of a set of runs, from when each has gone once round, in s; shape (N,)."""

    lasts: NDArray[np.float64]
    limits: NDArray[np.float64]
    """until the end of its run"""
    censored: NDArray[np.bool_]


class ManyRuns(NamedTuple):
    """What is kept of a set of runs."""

    name: str
    flights: Flights
    first: NDArray[np.float64]
    """when the first flight of each run begins, in s; infinite where there is none; shape (R,)"""
    heat_and_work: list[HeatAndWork]
    """in the flights of each run"""
    reach: float
    """largest distance of a ball from the axis, in m"""
    tipped: int
    """runs that ended because the inner ring tipped over"""

    @property
    def runs(self) -> int:
        """How many."""
        return len(self.first)

    @property
    def flying(self) -> int:
        """In how many the ball flies."""
        return int(np.isfinite(self.first).sum())


class Motors(NamedTuple):
    """What a figure of the paper's runs is made of."""

    runs: list[MotorRun]
    """the paper's seven"""
    many: dict[str, ManyRuns]
    """further runs, by their names in `SETS`"""


@cache
def many_runs(name: str, quick: bool) -> ManyRuns:
    """A set of `SETS`."""
    size = SETS[name]
    runs = (
        simulate_run(
            name, Motor.paper(name), method=NUMERICS["method"], timestep=size.timestep,
            duration=DURATION, record_interval=round(RECORD / size.timestep), seed=seed,
        )
        for seed in range(SEED, SEED + (size.quick if quick else size.full))
    )  # fmt: skip
    return collected(name, runs)


def collected(name: str, runs: Iterable[MotorRun]) -> ManyRuns:
    """What is kept of runs, of which only one is held at a time."""
    flights, first, spent, reach, tipped = [], [], [], [], 0
    for run in runs:
        found = run.flights
        begin, end = found.once.values, found.end.values
        left = float(run.data.time[-1]) - begin
        flights.append(np.stack([end - begin, left, found.censored.values]))
        first.append(found.begin.values.min(initial=np.inf))
        spent.append(heat_and_work_in_flights(run))
        reach.append(float(np.hypot(*run.data.position.values[:, :2].T).max()))
        tipped += "stopped" in run.data.attrs
    lasts, limits, censored = np.concatenate(flights, axis=1)
    every = Flights(lasts, limits, censored.astype(bool))
    return ManyRuns(name, every, np.array(first), spent, max(reach), tipped)
