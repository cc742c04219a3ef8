"""What is measured at the hops of the motor's ball: means, and the barriers ahead of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from paper.motor.barriers import Valley
from paper.motor.crossings import LAGS


class Mean(NamedTuple):
    """A mean and its standard error."""

    value: float
    error: float

    def said(self, unit: float = 1.0, digits: int = 2) -> str:
        """Return the mean and its error in some unit, as text."""
        return f"{self.value / unit:.{digits}f} ± {self.error / unit:.{digits}f}"


class Sample(NamedTuple):
    """Values from several runs; runs are independent, but values of one run need not be."""

    values: Array
    """of shape (n,) or (n, lags)"""
    run: NDArray[np.int_]
    """number of the run of each value, shape (n,)"""

    @property
    def mean(self) -> Mean:
        """The mean of all values of shape (n,)."""
        mean = float(self.values.mean())
        return Mean(mean, _error(self.run, (self.values - mean) / len(self.values)))

    @property
    def error(self) -> Array:
        """Standard error of the mean at each lag, of values of shape (n, lags)."""
        parts = (self.values - self.values.mean(axis=0)) / len(self.values)
        return np.array([_error(self.run, part) for part in parts.T])

    def above(self, other: "Sample") -> Mean:
        """Return the mean less that of another sample, perhaps of the same runs."""
        value = float(self.values.mean() - other.values.mean())
        here = (self.values - self.values.mean()) / len(self.values)
        there = (other.values.mean() - other.values) / len(other.values)
        return Mean(value, _error(*_together(self, other, here, there)))

    def rank_in(self, other: "Sample") -> Mean:
        """Return the part of another sample's values that is lower, on average over this one's.

        It is 1/2 if both have the same distribution, and 0 if all values of this sample are lower.
        Values of either sample add to its error.
        """
        lower, higher = (
            _part_below(other.values, self.values),
            _part_below(self.values, other.values),
        )
        value = float(lower.mean())
        here = (lower - value) / len(lower)
        there = (1 - higher - value) / len(higher)
        return Mean(value, _error(*_together(self, other, here, there)))

    def and_also(self, other: "Sample") -> "Sample":
        """Return the values of both samples."""
        values = np.concatenate([self.values, other.values])
        return Sample(values, np.concatenate([self.run, other.run]))


def _together(
    one: Sample, other: Sample, here: Array, there: Array
) -> tuple[NDArray[np.int_], Array]:
    """Return the runs of two samples, and what each value adds to an estimate."""
    return np.concatenate([one.run, other.run]), np.concatenate([here, there])


def _error(run: NDArray[np.int_], parts: Array) -> float:
    """Return the standard error of a sum to which values of independent runs add `parts`."""
    return float(np.linalg.norm(np.bincount(run, parts)))


def _part_below(values: Array, limits: Array) -> Array:
    """Return the part of values below each limit; equal ones count half."""
    ordered = np.sort(values)
    sides = [np.searchsorted(ordered, limits, "left"), np.searchsorted(ordered, limits, "right")]
    return np.mean(sides, axis=0) / len(values)


class Ahead(NamedTuple):
    """Barriers ahead of the ball, in J, in the runs of one temperature."""

    now: dict[str, Sample]
    """at the crossings of each kind, or random times in a well; each of shape (n,)"""
    around: dict[str, Sample]
    """at `LAGS` from the crossings, of each kind or with the lean of another ring; (n, lags)"""

    @property
    def rank_in_wells(self) -> Mean:
        """Part of random times in a well at which the barrier is lower than at a hop."""
        return self.now["hops"].rank_in(self.now["waiting"])

    def rank(self, kind: str) -> Mean:
        """Part of the times around a crossing at which the barrier is lower than at the crossing.

        Its mean is 1/2 if crossings do not depend on the barrier.
        """
        found, run = self.around[kind]
        middle = len(LAGS) // 2
        others, now = np.delete(found, middle, axis=1), found[:, middle, np.newaxis]
        return Sample(((others < now) + 0.5 * (others == now)).mean(axis=1), run).mean


class Found(NamedTuple):
    """What the figure shows."""

    method: str
    valley: Valley
    uniform: Ahead
    nonuniform: Ahead
    lean: Mean
    """of the inner ring at uniform temperature, in rad"""
    gibbs: list[float]
    """mean barriers in J by Gibbs' law: in the core of a well, and halfway to the next one"""
    clockwise: dict[str, tuple[Mean, int]]
    """part of the flights, and of the hops, that are clockwise, and their number"""
