"""When the motor's ball passes from well to well, and the barrier ahead of it around that time."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.devices.motor.flights import CORE, directed_spans, well_changes
from paper.motor.azimuths import RECORD_INTERVAL, Azimuths
from paper.motor.barriers import Valley

LAGS = np.linspace(-624.0, 624.0, 25)
"""Times from a crossing, in s: multiples of the time between records."""

WAITING = 4000
"""Number of random times in a well."""


class Places(NamedTuple):
    """A ball beside a barrier; each of shape (n,)."""

    run: NDArray[np.int_]
    record: NDArray[np.int_]
    well: NDArray[np.int_]
    """number of the well that the ball is in, or leaves"""
    step: NDArray[np.int_]
    """1 if the next well counterclockwise is ahead, -1 if the next one clockwise is"""

    def some(self, count: int) -> "Places":
        """Return at most `count` of the places, drawn at random."""
        size = len(self.run)
        chosen = np.random.default_rng(1).permutation(size)[:count]
        return Places(*(column[chosen] for column in self))

    def inside(self, azimuths: Azimuths, lags: Array, other: int = 0) -> "Places":
        """Return those at which `barriers` with these lags does not go beyond the run."""
        records = np.rint(lags / RECORD_INTERVAL).astype(int)
        lengths = np.array([len(leans) for leans in azimuths.leans])
        length = lengths[(self.run + other) % len(lengths)]
        kept = (self.record + records.min() >= 0) & (self.record + records.max() < length)
        return Places(*(column[kept] for column in self))


class Crossings(NamedTuple):
    """The passages from one well to its neighbor, at the time at which the ball passes halfway.

    The ball then reaches the core of the neighbor before it returns to the one that it has left.
    """

    hops: Places
    """outside of flights"""
    passes: Places
    """in flights"""
    waiting: Places
    """for comparison: a random time in the core of a well, and a random side"""


def crossings(azimuths: Azimuths, seed: int = 0) -> Crossings:
    """Find the crossings of an ensemble."""
    count = azimuths.scene.outer_dipoles
    sector = 2 * np.pi / count
    hops, passes, waiting = [], [], []
    random = np.random.default_rng(seed)
    for run, row in enumerate(azimuths.rows):
        flying = np.zeros(len(row), dtype=bool)
        for begin, _, end in directed_spans(row, CORE * sector, 2 * np.pi):
            flying[begin : end + 1] = True
        for left, reached, well, step in well_changes(row, count):
            if abs(step) == 1:
                way = step * (row[left:reached] / sector - (well - step / 2))
                record = left + int(np.flatnonzero(way <= 0)[-1])
                found = passes if flying[record] else hops
                found.append((run, record, well - step, step))
        sectors = row / sector
        resting = np.flatnonzero(np.abs(sectors - np.rint(sectors)) <= CORE)
        records = random.choice(resting, WAITING // len(azimuths.rows))
        sides = random.choice([-1, 1], len(records))
        wells = np.rint(sectors[records])
        waiting += [*zip(np.full_like(records, run), records, wells, sides, strict=True)]
    return Crossings(*map(_places, (hops, passes, waiting)))


def _places(rows: Iterable[tuple[float, ...]]) -> Places:
    return Places(*np.array([*rows], dtype=int).reshape(-1, 4).T)


def barriers(
    valley: Valley,
    places: Places,
    azimuths: Azimuths,
    lags: Array,
    other: int = 0,
) -> Array:
    """Return the barriers ahead in J at some times from these places, shape (n, lags).

    By the symmetry of the rings, the well is turned to azimuth 0, and what is clockwise is
    reflected.

    Parameters
    ----------
    valley : Valley
    places : Places
        None of them is too near to the begin or end of a run.
    azimuths : Azimuths
        The ensemble in which they are.
    lags : ndarray, shape (lags,)
        In s.
    other : int
        If not 0, the lean of the ring is that of the run with a number higher by this.
    """
    records = np.rint(lags / RECORD_INTERVAL).astype(int)
    found = []
    for run, record, well, step in zip(*places, strict=True):
        leans = azimuths.leans[(run + other) % len(azimuths.leans)]
        x, y = leans[record + records].T
        cosine, sine = np.cos(valley.sector * well), np.sin(valley.sector * well)
        turned = np.stack([cosine * x + sine * y, step * (cosine * y - sine * x)], axis=1)
        found.append(valley.ahead(valley.energies(turned)))
    return np.array(found).reshape(-1, len(lags))
