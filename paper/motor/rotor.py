"""A rotor without wells, the null hypothesis for claims about the motor's ball.

Its rate is an Ornstein-Uhlenbeck process: friction and noise act on it, and nothing else. It goes
around and turns back, and so it has "flights". A statistic shows wells or two states of motion only
if this rotor does not pass it.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import check_array, check_integer, check_number
from magmotor.common.exceptions import ArgumentError

WINDOW = 100.0
"""In s, over which a rate is measured."""

SMOOTHED = 10
"""Windows over which its correlation is averaged, since the ball swings in a well in 600 s."""


def rotor(
    rate: float, memory: float, times: ArrayLike, replicas: int, seed: int
) -> NDArray[np.float64]:
    """Draw azimuths of independent rotors at given times, with their exact joint distribution.

    The rate w obeys dw = -w dt/memory + rate sqrt(2/memory) dW and is stationary: its mean square
    is rate^2, and its correlation is exp(-t/memory). Between two times, given the rates at both,
    the change of the azimuth is Gaussian (G. E. Uhlenbeck and L. S. Ornstein, Phys. Rev. 36, 823,
    1930).

    Parameters
    ----------
    rate : float
        Root mean square of the rate, in rad/s.
    memory : float
        Correlation time of the rate, in s.
    times : array_like, shape (T,)
        In s, increasing.
    replicas : int
        Number of rotors R.
    seed : int

    Returns
    -------
    ndarray, shape (R, T)
        Unwrapped azimuths in rad; the first ones are 0.

    Raises
    ------
    ValueError
        A number is out of bounds, or the times do not increase.
    """
    check_number("rate", rate, above=0, unit="rad/s")
    check_number("memory", memory, above=0, unit="s")
    check_integer("replicas", replicas, at_least=1)
    spans = np.diff(check_array("times", times, "times")) / memory
    if spans.min(initial=math.inf) <= 0:
        raise ArgumentError(
            "smallest step of times", memory * spans.min(), "must be greater than 0 s"
        )
    generator = np.random.default_rng(seed)
    kept = np.exp(-spans)
    kicks = np.sqrt(-np.expm1(-2 * spans)) * generator.normal(size=(replicas, len(spans)))
    rates = np.empty((replicas, len(spans) + 1))
    rates[:, 0] = generator.normal(size=replicas)
    for k, (factor, kick) in enumerate(zip(kept, kicks.T, strict=True)):
        rates[:, k + 1] = factor * rates[:, k] + kick
    half = np.tanh(spans / 2)
    spread = np.sqrt(np.maximum(2 * spans - 4 * half, 0))
    changes = half * (rates[:, :-1] + rates[:, 1:]) + spread * generator.normal(size=kicks.shape)
    azimuths = np.zeros_like(rates)
    np.cumsum(rate * memory * changes, axis=1, out=azimuths[:, 1:])
    return azimuths


class RateAndMemory(NamedTuple):
    """What a rotor shares with the motor that it is compared with."""

    rate: float
    """Root mean square of the rate over `WINDOW`, in rad/s."""
    memory: float
    """Time in s in which the correlation of the rate falls to 1/e, without the swing in a well."""


def rate_and_memory(rows: Sequence[NDArray[np.float64]], step: float) -> RateAndMemory:
    """Measure the rate of a ball, or of a rotor, over `WINDOW`, and its memory.

    Parameters
    ----------
    rows : sequence of ndarray, each of shape (T,)
        Azimuths in rad, unwrapped; they may have different lengths.
    step : float
        Time between two records, in s.
    """
    stride = round(WINDOW / step)
    window = stride * step
    rates = [np.diff(row[::stride]) / window for row in rows]
    square = np.mean(np.concatenate(rates) ** 2)
    correlation: list[float] = []
    while True:
        lag = len(correlation) + 1
        products = [rate[lag:] * rate[:-lag] for rate in rates if len(rate) > lag]
        correlation.append(float(np.concatenate(products).mean() / square) if products else 0.0)
        last = correlation[-SMOOTHED:]
        if len(last) == SMOOTHED and np.mean(last) < math.exp(-1):
            return RateAndMemory(float(np.sqrt(square)), (lag - (SMOOTHED - 1) / 2) * window)
