"""How long the motor's flights last, of many runs at either temperature, and by which law."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from magmotor.figures.claim import Claim, Verdict
from magmotor.figures.motor.runs import DURATION, NUMERICS, simulate_run
from magmotor.observables import censored_mean, exponential_test
from magmotor.observables.exponential_law import LEVEL, ExponentialTest
from magmotor.observables.motor_flights import CensoredMean
from magmotor.scenes import Motor

SETS = {"nonuniform-a": (0.1, 64, 16), "uniform-a": (0.5, 128, 32)}
"""Step in s, and how many runs at full and at reduced size; a hot ring wants a short step."""

SEED = 1000
"""Of the first run."""

RECORD = 5.0
"""In s: the ball goes round by much less than a quarter of a sector meanwhile."""

LONG = 6000.0
"""In s; were they exponential, those that have lasted for so long had as much left as at first."""

ALTERNATIVES = {"gamma, shape 2": stats.gamma(2), "Pareto tail of power 2.5": stats.lomax(2.5)}

ENOUGH = 0.9
"""The power for which an exponential law that is not rejected is taken as found."""


class Flights(NamedTuple):
    """Flights of a set of runs, from when each has gone once round, in s; shape (N,)."""

    name: str
    runs: int
    lasts: NDArray[np.float64]
    limits: NDArray[np.float64]
    """until the end of its run"""
    censored: NDArray[np.bool_]

    def left(self, time: float) -> CensoredMean:
        """How long those go on that have lasted for this time."""
        kept = self.lasts >= time
        return censored_mean(self.lasts[kept] - time, self.censored[kept])

    def test(self) -> ExponentialTest:
        """Whether they are exponential in law."""
        return exponential_test(self.lasts, self.censored, self.limits, ALTERNATIVES)


@cache
def many_flights(quick: bool) -> list[Flights]:
    """Flights of both sets."""
    return [_flights_of(name, quick) for name in SETS]


def _flights_of(name: str, quick: bool) -> Flights:
    timestep, *counts = SETS[name]
    count = counts[quick]
    rows = []
    for seed in range(SEED, SEED + count):
        run = simulate_run(
            name, Motor.paper(name), method=NUMERICS["method"], timestep=timestep,
            duration=DURATION, record_interval=round(RECORD / timestep), seed=seed,
        )  # fmt: skip
        begin, end = run.flights.once.values, run.flights.end.values
        left = float(run.data.time[-1]) - begin
        rows.append(np.stack([end - begin, left, run.flights.censored.values]))
    lasts, limits, censored = np.concatenate(rows, axis=1)
    return Flights(name, count, lasts, limits, censored.astype(bool))


def claim_of_the_law(flights: Flights, figure: int) -> Claim:
    """That they are exponential in law, and which alternatives the test would have told."""
    found, mean, later = flights.test(), flights.left(0.0), flights.left(LONG)
    seen = f"{len(flights.lasts)} flights of {flights.runs} runs as {flights.name}"
    power = " and ".join(f"{100 * found.power[name]:.0f} % ({name})" for name in ALTERNATIVES)
    enough = min(found.power.values()) >= ENOUGH
    decided = "" if found.rejected or enough else f"; not decided by {seen}"
    verdict: Verdict = "wrong" if found.rejected else "right" if enough else "in part"
    return Claim(
        "It spins for a random amount of time, observed to be exponential in law"
        f" ({flights.name.partition('-')[0]} temperature)",
        f"{seen} last, once round, {mean.mean:.0f} ± {mean.error:.0f} s more,"
        f" {flights.censored.sum()} of them cut off by the run's end: squared coefficient of"
        f" variation {found.squared_variation:.2f}, 1 if exponential (p = {found.p_value:.1g}; at"
        f" {100 * LEVEL:g} % the test tells other laws in {power} of the cases)"
        f"; those that have lasted {LONG:g} s more have {later.mean:.0f} ± {later.error:.0f} s"
        f" left{decided}",
        verdict,
        (figure,),
    )
