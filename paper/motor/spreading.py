"""How an ensemble of azimuths spreads: mean squares, local slopes, correlations, diffusion.

Replicas are independent; so errors come from their differences, whatever the correlations in time.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arrays import Array


class Measured(NamedTuple):
    """A number or an array of numbers, with standard errors."""

    value: Any
    error: Any

    def __str__(self) -> str:
        """Return a single value with its error, to two digits of the error."""
        digits = max(0, 1 - int(np.floor(np.log10(self.error)))) if self.error > 0 else 2
        return f"{float(self.value):.{digits}f} ± {float(self.error):.{digits}f}"


def over_replicas(values: ArrayLike) -> Measured:
    """Return the mean over the replicas, along the first axis, and its standard error."""
    values = np.asarray(values, dtype=float)
    return Measured(values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def half_octaves(count: int) -> NDArray[np.int_]:
    """Return lags up to a third of `count` records, each about sqrt(2) times the previous one."""
    powers = np.arange(2 * np.log2(count / 3))
    return np.unique(np.rint(2 ** (powers / 2)).astype(int))


def square_increments(azimuth: Array, lags: NDArray[np.int_]) -> Array:
    """Return the mean square increments of each replica.

    Parameters
    ----------
    azimuth : ndarray, shape (R, N)
        In rad.
    lags : ndarray of int, shape (L,)
        In records.

    Returns
    -------
    ndarray, shape (R, L)
        In rad^2.
    """
    squares = [np.mean((azimuth[:, lag:] - azimuth[:, :-lag]) ** 2, axis=1) for lag in lags]
    return np.stack(squares, axis=1)


class Slopes(NamedTuple):
    """Local slopes of the mean square over the lag, both logarithmic."""

    lag: Array
    """Geometric means of the two lags of each slope, in their unit."""
    slope: Array
    error: Array
    """By the jackknife over replicas."""


def local_slopes(squares: Array, lags: Array) -> Slopes:
    """Return the slopes between each lag and the next but one.

    Parameters
    ----------
    squares : ndarray, shape (R, L)
        Mean square increments of each replica.
    lags : ndarray, shape (L,)

    Returns
    -------
    Slopes
        Each of shape (L - 2,).
    """
    total, count = squares.sum(axis=0), len(squares)
    without_one = logarithmic_slope(total - squares, lags)
    error = np.sqrt(count - 1) * without_one.std(axis=0)
    return Slopes(np.sqrt(lags[2:] * lags[:-2]), logarithmic_slope(total, lags), error)


def logarithmic_slope(squares: Array, lags: Array) -> Array:
    """Return the slopes of a curve between each lag and the next but one, shape (..., L - 2)."""
    return np.log(squares[..., 2:] / squares[..., :-2]) / np.log(lags[2:] / lags[:-2])


def correlations(rate: Array, count: int) -> Array:
    """Return the correlations of each replica's rate at the first `count` lags.

    Parameters
    ----------
    rate : ndarray, shape (R, N)
        Of mean zero, in rad/s.
    count : int

    Returns
    -------
    ndarray, shape (R, count)
        In rad^2/s^2.
    """
    length = rate.shape[1]
    padded = 2 ** int(np.ceil(np.log2(length + count)))
    rows = []
    for row in rate:  # one at a time, for the memory
        spectrum = np.abs(np.fft.rfft(row, padded)) ** 2
        rows.append(np.fft.irfft(spectrum)[:count] / (length - np.arange(count)))
    return np.array(rows)


def green_kubo(correlation: Array, interval: float) -> Array:
    """Return the integral of the correlation from 0 to each lag, by the trapezoidal rule.

    Parameters
    ----------
    correlation : ndarray, shape (R, L)
    interval : float
        Between two lags, in s.

    Returns
    -------
    ndarray, shape (R, L)
        Half the growth rate of the mean square, in rad^2/s; in the end the diffusion coefficient.
    """
    steps = 0.5 * interval * (correlation[:, 1:] + correlation[:, :-1])
    return np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))


def rotor_square(rate: float, memory: float, lag: Array) -> Array:
    """Return the mean square increment, in rad^2, of an Ornstein-Uhlenbeck rotor.

    Parameters
    ----------
    rate : float
        Root mean square, in rad/s.
    memory : float
        In s.
    lag : ndarray
        In s.
    """
    x = lag / memory
    return 2 * (rate * memory) ** 2 * (x + np.expm1(-x))
