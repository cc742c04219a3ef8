"""By which law the motor's flights last, of many runs at either temperature."""

from scipy import stats

from magmotor.devices.motor.exponential_law import LEVEL
from magmotor.observables import censored_mean, exponential_test
from paper.claim import Claim, Verdict
from paper.motor.many_runs import ManyRuns

LONG = 6000.0
"""In s; were they exponential, those that have lasted for so long had as much left as at first."""

ALTERNATIVES = {"gamma, shape 2": stats.gamma(2), "Pareto tail of power 2.5": stats.lomax(2.5)}

ENOUGH = 0.9
"""The power for which an exponential law that is not rejected is taken as found."""


def claim_of_the_law(found: ManyRuns, figure: int) -> Claim:
    """That flights are exponential in law, and which alternatives the test would have told."""
    lasts, limits, censored = found.flights
    test = exponential_test(lasts, censored, limits, ALTERNATIVES)
    mean = censored_mean(lasts, censored)
    long = lasts >= LONG
    later = censored_mean(lasts[long] - LONG, censored[long])
    seen = f"{len(lasts)} flights of {found.runs} runs as {found.name}"
    power = " and ".join(f"{100 * test.power[name]:.0f} % ({name})" for name in ALTERNATIVES)
    enough = min(test.power.values()) >= ENOUGH
    verdict: Verdict = "wrong" if test.rejected else "right" if enough else "not decided"
    return Claim(
        "It spins for a random amount of time, observed to be exponential in law"
        f" ({found.name.partition('-')[0]} temperature)",
        f"{seen} last, once round, {mean.mean:.0f} ± {mean.error:.0f} s more,"
        f" {censored.sum()} of them cut off by the run's end: squared coefficient of"
        f" variation {test.squared_variation:.2f}, 1 if exponential (p = {test.p_value:.1g}; at"
        f" {100 * LEVEL:g} % the test tells other laws in {power} of the cases)"
        f"; those that have lasted {LONG:g} s more have {later.mean:.0f} ± {later.error:.0f} s"
        " left",
        verdict,
        (figure,),
    )
