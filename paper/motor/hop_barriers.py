"""What is measured at the hops of the motor's ball: means, and the barriers ahead of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from paper.motor.barriers import Valley
from paper.motor.crossings import LAGS


class Mean(NamedTuple):
    """A mean over independent values, and its standard error."""

    value: float
    error: float

    @classmethod
    def of(cls, values: Array) -> "Mean":
        """Average an array of shape (n,)."""
        return cls(float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))))

    def above(self, other: "Mean") -> float:
        """Return by how many standard errors this mean is above another one."""
        return (self.value - other.value) / float(np.hypot(self.error, other.error))

    def said(self, unit: float = 1.0, digits: int = 2) -> str:
        """Return the mean and its error in some unit, as text."""
        return f"{self.value / unit:.{digits}f} ± {self.error / unit:.{digits}f}"


class Ahead(NamedTuple):
    """Barriers ahead of the ball, in J, in the runs of one temperature."""

    now: dict[str, NDArray[np.float64]]
    """at the crossings of each kind, or random times in a well; each of shape (n,)"""
    around: dict[str, NDArray[np.float64]]
    """at `LAGS` from the crossings, of each kind or with the lean of another ring; (n, lags)"""

    def rank(self, kind: str) -> Mean:
        """Part of the times around a crossing at which the barrier is lower than at the crossing.

        Its mean is 1/2 if crossings do not depend on the barrier.
        """
        found = self.around[kind]
        middle = len(LAGS) // 2
        others, now = np.delete(found, middle, axis=1), found[:, middle, np.newaxis]
        return Mean.of(((others < now) + 0.5 * (others == now)).mean(axis=1))


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
