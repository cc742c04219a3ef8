"""Test for an exponential distribution of durations, some of which are censored."""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import flags, integer, numbers, shaped

LEVEL = 0.01
"""Two-sided level of significance."""


@runtime_checkable
class Distribution(Protocol):
    """A distribution of durations, for example from `scipy.stats`."""

    def rvs(self, size: Any, random_state: Any) -> Any:
        """Draw durations."""
        ...

    def mean(self) -> Any:
        """The mean duration."""
        ...


class ExponentialTest(NamedTuple):
    """Result of `exponential_test`."""

    squared_variation: float
    """Squared coefficient of variation. Its expectation is 1 for an exponential distribution, less
    for one with a preferred duration, and more for one with a heavy tail."""
    p_value: float
    """Two-sided p-value, by Monte Carlo."""
    power: dict[str, float]
    """Probability that each alternative is rejected at `LEVEL`."""

    @property
    def rejected(self) -> bool:
        """Whether the exponential distribution is rejected at `LEVEL`."""
        return self.p_value < LEVEL


@checked(finite=False)
def squared_variation(
    values: Annotated[ArrayLike, numbers(..., "N", at_least=0)],
    censored: Annotated[ArrayLike, flags(..., "N")],
) -> NDArray[np.float64]:
    """Compute the squared coefficient of variation of durations, some of which are censored.

    It is 1 + (sum y^2 - 2 sum_completed y)/n for n completed durations, where y = value/mean with
    the mean of `censored_mean`. Without censoring this is Greenwood's statistic, the squared
    coefficient of variation. Half the bracket is the score of the shape parameter of the
    generalized Pareto distribution at the exponential distribution.

    Parameters
    ----------
    values : array_like, shape (..., N)
        Durations, up to the end of the observation where they are censored.
    censored : array_like of bool, shape (..., N)
        Which durations had not ended.

    Returns
    -------
    ndarray, shape (...)
        NaN where none was completed.
    """
    values, completed = np.asarray(values, dtype=float), ~np.asarray(censored, dtype=bool)
    number = completed.sum(axis=-1)
    count = np.where(number, number, np.nan)
    y = values * (count / values.sum(axis=-1))[..., np.newaxis]
    return 1 + np.sum(y**2 - 2 * y * completed, axis=-1) / count


@checked
def exponential_test(
    values: Annotated[ArrayLike, shaped("N")],
    censored: Annotated[ArrayLike, flags("N")],
    limits: Annotated[ArrayLike, shaped("N")],
    alternatives: Mapping[str, Distribution],
    *,
    draws: Annotated[int, integer(at_least=100, at_most=10**6)] = 2000,
    seed: Annotated[int, integer(at_least=0)] = 0,
) -> ExponentialTest:
    """Test for an exponential distribution by `squared_variation`, and compute the power.

    The distribution of the statistic is computed by Monte Carlo from N exponential durations with
    the observed mean, each censored at its limit. The power is computed in the same way from the
    alternatives, scaled to that mean.

    Parameters
    ----------
    values, censored : array_like, shape (N,)
        As for `squared_variation`; at least half of the durations, and at least two, are completed.
    limits : array_like, shape (N,)
        For how long each duration, completed or not, could have been observed.
    alternatives : mapping
        Names and distributions, for example from `scipy.stats`, with a finite mean.
    draws : int
        Number of Monte Carlo samples.
    seed : int

    Raises
    ------
    ValueError
        Too few durations are completed, or a duration exceeds its limit.
    """
    values, limits = np.asarray(values, dtype=float), np.asarray(limits, dtype=float)
    censored = np.asarray(censored, dtype=bool)
    if not (values >= 0).all() or not values.any():
        raise ArgumentError(
            "smallest duration",
            float(values.min()),
            "must be at least 0, and some duration must be positive",
        )
    completed = int(np.sum(~censored))
    if completed < max(2, len(values) / 2):
        raise ArgumentError(
            "number of durations completed",
            completed,
            "must be at least 2 and at least half of all",
        )
    if np.any(values > limits):
        raise ArgumentError(
            "largest duration over its limit", (values / limits).max(), "must be at most 1"
        )
    generator = np.random.default_rng(seed)
    mean = values.sum() / completed

    def drawn(scaled: NDArray[np.float64]) -> NDArray[np.float64]:
        return squared_variation(np.minimum(scaled, limits), scaled > limits)

    shape = draws, len(values)
    found = float(squared_variation(values, censored))
    null = drawn(generator.exponential(mean, shape))
    null = null[np.isfinite(null)]
    tail = min(np.sum(null <= found), np.sum(null >= found))
    p_value = min(1.0, float(2 * (tail + 1) / (len(null) + 1)))
    low, high = np.quantile(null, [LEVEL / 2, 1 - LEVEL / 2])
    power = {}
    for name, law in alternatives.items():
        other = drawn(law.rvs(size=shape, random_state=generator) * mean / law.mean())
        power[name] = float(np.mean((other < low) | (other > high)))
    return ExponentialTest(found, p_value, power)
