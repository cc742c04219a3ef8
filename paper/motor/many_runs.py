"""Many runs as some of the paper's, for what its few realizations do not decide."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.panels import MotorRun
from magmotor.devices.motor.scene import Motor
from paper.motor.books import Books, books_of_flights
from paper.motor.runs import DURATION, NUMERICS, simulate_run


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
    books: list[Books]
    """of the flights of each run"""
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
    flights, first, books, reach, tipped = [], [], [], [], 0
    for run in runs:
        found = run.flights
        begin, end = found.once.values, found.end.values
        left = float(run.data.time[-1]) - begin
        flights.append(np.stack([end - begin, left, found.censored.values]))
        first.append(found.begin.values.min(initial=np.inf))
        books.append(books_of_flights(run))
        reach.append(float(np.hypot(*run.data.position.values[:, :2].T).max()))
        tipped += "stopped" in run.data.attrs
    lasts, limits, censored = np.concatenate(flights, axis=1)
    every = Flights(lasts, limits, censored.astype(bool))
    return ManyRuns(name, every, np.array(first), books, max(reach), tipped)
