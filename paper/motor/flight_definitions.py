"""What counts as a flight, by five definitions, and how long each flight then still lasts."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.flights import CORE, directed_spans
from magmotor.devices.motor.scene import Motor
from paper.motor.azimuths import RECORD_INTERVAL
from paper.motor.exponential_test import squared_variation
from paper.motor.rotor import rate_and_memory

Row = NDArray[np.float64]

SECTOR = 2 * np.pi / Motor().outer_dipoles
"""Angle between two wells, in rad."""

AVERAGED, LASTED = 200.0, 2000.0
"""Times in s over which a rate is averaged, and for which it has been high."""

Spans = Iterator[tuple[int, int]]
"""Records from which the rest of a flight counts, and of its end."""


class Definition(NamedTuple):
    """A definition of a flight, for a path and the root mean square of all rates (rad/s)."""

    label: str
    spans: Callable[[Row, float], Spans]


def _directed(back: float, far: float) -> Callable[[Row, float], Spans]:
    """Flights that go `far` and never move back by more than `back`, in rad."""

    def spans(row: Row, _rate: float) -> Spans:
        for _, gone, end in directed_spans(row, back, far):
            yield gone, end

    return spans


def _fast(row: Row, rate: float) -> Spans:
    """Flights in which the mean rate stays above half of the root mean square."""
    window, lasted = round(AVERAGED / RECORD_INTERVAL), round(LASTED / RECORD_INTERVAL)
    mean = np.abs(row[window:] - row[:-window]) / (window * RECORD_INTERVAL)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mean > rate / 2, [False]])))
    for begin, end in edges.reshape(-1, 2).tolist():
        if end - begin > lasted:
            yield begin + lasted + window, end - 1 + window


DEFINITIONS = {
    "once": Definition(
        "once around, back by less than ¼ sector", _directed(CORE * SECTOR, 2 * np.pi)
    ),
    "sector": Definition("once around, back by less than a sector", _directed(SECTOR, 2 * np.pi)),
    "two": Definition(
        "two sectors, back by less than ¼ sector", _directed(CORE * SECTOR, 2 * SECTOR)
    ),
    "thrice": Definition(
        "three times around, back by less than ¼ sector", _directed(CORE * SECTOR, 6 * np.pi)
    ),
    "fast": Definition(f"rate above half its rms for {LASTED:g} s", _fast),
}
"""The first one is that of the other figures."""


class Remaining(NamedTuple):
    """How long the flights of some runs last, from where they count as flights; shapes (F,)."""

    run: NDArray[np.int_]
    """number of the run"""
    lasts: NDArray[np.float64]
    """in s"""
    censored: NDArray[np.bool_]
    """whether the run ended first"""
    direction: NDArray[np.int_]
    """1 counterclockwise, -1 clockwise"""

    @property
    def squared_variation(self) -> tuple[float, float]:
        """Squared coefficient of variation, and its error by the jackknife over runs."""
        whole = float(squared_variation(self.lasts, self.censored))
        runs = np.unique(self.run)
        without = [
            float(squared_variation(self.lasts[kept], self.censored[kept]))
            for kept in (self.run != run for run in runs)
        ]
        return whole, float(np.std(without) * np.sqrt(len(runs) - 1))

    @property
    def survival(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times in s, and the part that lasts longer (E. L. Kaplan and P. Meier, 1958)."""
        order = np.argsort(self.lasts)
        at_risk = np.arange(len(order), 0, -1)
        ended = ~self.censored[order]
        return self.lasts[order], np.cumprod(1.0 - ended / at_risk, dtype=np.float64)


def remaining(rows: Sequence[Row], definition: Definition) -> Remaining:
    """Return what is left of the flights in paths of azimuths, recorded at `RECORD_INTERVAL`."""
    rate = rate_and_memory(rows, RECORD_INTERVAL).rate
    found = [
        (run, RECORD_INTERVAL * (end - begin), end == len(row) - 1,
         np.sign(row[end] - row[begin]))
        for run, row in enumerate(rows)
        for begin, end in definition.spans(row, rate)
    ]  # fmt: skip
    run, lasts, censored, direction = np.array(found, dtype=float).reshape(-1, 4).T
    return Remaining(run.astype(int), lasts, censored.astype(bool), direction.astype(int))
