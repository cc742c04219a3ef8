"""Whether durations, some of which were cut off by the end of a run, are exponential in law."""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import flags, integer, numbers, shaped

LEVEL = 0.01
"""Of significance, two-sided, at which the power is stated."""


@runtime_checkable
class Distribution(Protocol):
    """A law of durations, such as those of `scipy.stats`."""

    def rvs(self, size: Any, random_state: Any) -> Any:
        """Draw durations."""
        ...

    def mean(self) -> Any:
        """The mean duration."""
        ...


class ExponentialTest(NamedTuple):
    """What `exponential_test` finds."""

    squared_variation: float
    """Squared coefficient of variation, 1 in the mean if the law is exponential; less of a law with
    a preferred duration, more of one with a heavy tail."""
    p_value: float
    """Two-sided, by Monte Carlo."""
    power: dict[str, float]
    """For each alternative, how often it is told from an exponential law at `LEVEL`."""

    @property
    def rejected(self) -> bool:
        """The law is not exponential, at `LEVEL`."""
        return self.p_value < LEVEL


@checked(finite=False)
def squared_variation(
    values: Annotated[ArrayLike, numbers(..., "N", at_least=0)],
    censored: Annotated[ArrayLike, flags(..., "N")],
) -> NDArray[np.float64]:
    """Squared coefficient of variation of durations, of which some are cut off.

    With y = value/mean, the mean that of `censored_mean`, and n durations completed:
    1 + (sum y^2 - 2 sum_completed y)/n. If none is cut off this is Greenwood's statistic, the
    squared coefficient of variation. The bracket over 2 is the score, at the exponential law, of
    the generalized Pareto law's shape.

    Parameters
    ----------
    values : array_like, shape (..., N)
        Elapsed, of those cut off as far as seen.
    censored : array_like of bool, shape (..., N)

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
    """Test of an exponential law by `squared_variation`, and its power.

    The statistic's law is found by Monte Carlo: as many durations, exponential with the mean found,
    each cut off at its limit. So is the power, of the alternatives with that mean.

    Parameters
    ----------
    values, censored : array_like, shape (N,)
        As for `squared_variation`; half at least completed, two at least.
    limits : array_like, shape (N,)
        How long each could have been seen, also of those completed.
    alternatives : mapping
        Names and laws, as of `scipy.stats`, with a mean.
    draws : int
    seed : int

    Raises
    ------
    ValueError
        Of fewer durations the end was seen, or one lasts longer than its limit.
    """
    values, limits = np.asarray(values, dtype=float), np.asarray(limits, dtype=float)
    censored = np.asarray(censored, dtype=bool)
    if not (values >= 0).all() or not values.any():
        raise reject(
            "smallest duration", float(values.min()), "must be at least 0, and not all zero"
        )
    completed = int(np.sum(~censored))
    if completed < max(2, len(values) / 2):
        raise reject(
            "number of durations completed", completed, "must be at least half of all, and 2"
        )
    if np.any(values > limits):
        raise reject(
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
