"""Mean durations of flights, with errors from the differences between runs."""

import numpy as np
import xarray as xr

from paper.motor.spreading import Measured


def lasting(found: xr.Dataset, replicas: int, unit: float = 1.0) -> Measured:
    """Return how long flights last after their first revolution, NaN if none ended.

    The mean is that of `censored_mean`: the time of all flights over the number of those that
    ended. Its error is that of a ratio of two sums over runs.

    Parameters
    ----------
    found : xarray.Dataset
        From `flights`.
    replicas : int
    unit : float
        Of the mean, in s.
    """
    run = found.replica.values
    time = np.bincount(run, (found.end - found.once).values / unit, minlength=replicas)
    ended = np.bincount(run, ~found.censored.values, minlength=replicas)
    if not ended.sum():
        return Measured(np.nan, np.nan)
    mean = time.sum() / ended.sum()
    squares = np.sum((time - mean * ended) ** 2) * replicas / (replicas - 1)
    return Measured(float(mean), float(np.sqrt(squares) / ended.sum()))


def times_apart(first: Measured, second: Measured) -> float:
    """Return the logarithm of the ratio of two positive numbers in standard errors."""
    errors = np.hypot(first.error / first.value, second.error / second.value)
    return float(np.log(first.value / second.value) / errors)
