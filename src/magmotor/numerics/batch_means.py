"""Standard errors of stationary series from the means of batches."""

import numpy as np

from magmotor.common.arrays import Array

BATCHES, MOST = 16, 8
"""Number of batches in total, and the largest number for each replica; their means are treated as
independent.

For fast modes, a summed autocorrelation function would yield a more precise error. The
autocorrelation of slow modes oscillates long before it decays, and common cutoff rules truncate
the sum much too early.
"""


def batch_means(series: Array) -> Array:
    """Return the means (n,) of the batches of stationary series, shape (T,) or (replicas, T)."""
    rows = np.atleast_2d(series)
    pieces = min(MOST, -(-BATCHES // len(rows)))
    batches = [part.mean(axis=1) for part in np.array_split(rows, pieces, axis=1)]
    return np.concatenate(batches)


def mean_and_error(series: Array) -> tuple[float, float]:
    """Return mean and standard error of stationary series, shape (T,) or (replicas, T)."""
    return float(np.mean(series)), _error(batch_means(series))


def ratio_and_error(above: Array, below: Array) -> tuple[float, float]:
    """Return the ratio of the means of two series, and its standard error by the delta method."""
    scale = np.mean(below)
    ratio = np.mean(above) / scale
    return float(ratio), _error(batch_means(above - ratio * below)) / abs(float(scale))


def _error(batches: Array) -> float:
    return float(batches.std(ddof=1) / np.sqrt(batches.size))
