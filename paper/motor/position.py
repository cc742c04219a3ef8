"""Claims about the motion of the motor's ball: angular position, flights and path."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from magmotor import observables
from magmotor.devices.motor.exponential_test import LEVEL
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.observables import censored_mean, exponential_test
from paper.figure import Claim, Verdict, judged
from paper.motor.runs import (
    DURATION,
    SIGNIFICANT,
    ManyRuns,
    Motors,
    in_flight,
    of_temperature,
)

LONG = 6000.0
"""In s; exponential flights that have lasted this long have the same mean remaining duration."""

ALTERNATIVES = {"gamma, shape 2": stats.gamma(2), "Pareto tail of power 2.5": stats.lomax(2.5)}

ENOUGH = 0.9
"""Power of the test from which an exponential law that is not rejected counts as confirmed."""

WINDOW = 100
"""Window, in s, for the drift of the ball around the center."""


def claims_of_theta(motors: Motors) -> list[Claim]:
    """Return the claims of (fig:nctmagmotortheta), (fig:ctmagmotortheta) and their text."""
    nonuniform, uniform = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    warm, cool = (
        [run for run in uniform if (run.scene.noises[-1] < 1e-3) == below]
        for below in (False, True)
    )
    many_nonuniform, many_warm, many_cool = (
        motors.many[name] for name in ("nonuniform-a", "uniform-a", "uniform-d")
    )
    median_wait = float(np.median(many_cool.first))
    return [
        judged(
            "The plots show the magnetic ball transition between two metastable states:"
            " noise-driven and inertia-driven motion",
            _flight_counts(nonuniform, many_nonuniform),
            _most_fly(many_nonuniform),
            figures=(3,),
        ),
        judged(
            "The same, of (a) and (b) (α = 0.001; the caption gives the α of the other figure)",
            _flight_counts(warm, many_warm),
            _most_fly(many_warm),
            figures=(4,),
        ),
        judged(
            "Realization (d) never transitions to a metastable state of the second kind"
            " (α = 0.00075)",
            f"{_flight_counts(cool, many_cool)} within {DURATION:g} s, half of them before"
            f" {median_wait:.0f} s:"
            " it depends on the duration, which the paper does not state",
            not _most_fly(many_cool),
            otherwise="in part",
            figures=(4,),
        ),
        claim_of_the_law(many_nonuniform, 3),
        claim_of_the_law(many_warm, 4),
        *([claim_of_agreement(many_warm, motors.reference)] if motors.reference else []),
    ]


def claim_of_agreement(found: ManyRuns, reference: ManyRuns) -> Claim:
    """Return the claim that two methods have as many flights, which last as long.

    Of two Gaussian differences, one is beyond four standard errors in one of 8000 samples.
    """
    counts, durations = [], []
    for many in (found, reference):
        flights = np.array([spent.spans for spent in many.heat_and_work])
        counts.append((flights.mean(), flights.std(ddof=1) / np.sqrt(many.runs)))
        mean = censored_mean(many.flights.lasts, many.flights.censored)
        durations.append((mean.mean, mean.error))
    scores = [
        float((first - second) / np.hypot(error, other))
        for (first, error), (second, other) in (counts, durations)
    ]
    per_run, lasting = (
        " against ".join(f"{value:.{digits}f} ± {error:.{digits}f}" for value, error in pairs)
        for pairs, digits in ((counts, 2), (durations, 0))
    )
    return judged(
        "Ours: MuJoCo's motor flies as the reference's does",
        f"{found.runs} runs as {found.name} by `{found.method}` have {per_run} flights each by"
        f" `{reference.method}`, which last, after the first revolution, {lasting} s more: the"
        f" differences are {scores[0]:.1f} and {scores[1]:.1f} standard errors",
        max(map(abs, scores)) < SIGNIFICANT,
    )


def _flight_counts(runs: list[MotorRun], many: ManyRuns) -> str:
    counts = ", ".join(f"{run.name[-1]}: {run.flights.sizes['flight']}" for run in runs)
    longest = max(runs, key=lambda run: run.longest_turns)
    return (
        f"flights of run {counts}; the longest has {longest.longest_turns:.0f} revolutions; of"
        f" {many.runs} runs as {many.name} {many.flying} fly"
    )


def _most_fly(many: ManyRuns) -> bool:
    return many.flying > many.runs / 2


def claim_of_the_law(found: ManyRuns, figure: int) -> Claim:
    """Return the claim that flights are exponential, with the power of the test."""
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
        f"{seen} last, after the first revolution, {mean.mean:.0f} ± {mean.error:.0f} s more,"
        f" {censored.sum()} of them cut off by the run's end: squared coefficient of variation"
        f" {test.squared_variation:.2f}, 1 if exponential (p = {test.p_value:.1g}; at"
        f" {100 * LEVEL:g} % the test detects other laws in {power} of the cases); those that have"
        f" lasted {LONG:g} s more have {later.mean:.0f} ± {later.error:.0f} s left",
        verdict,
        (figure,),
    )


def claims_of_the_path(motors: Motors) -> list[Claim]:
    """Return the claims of (fig:nctmagmotorxyplot) and (fig:ctmagmotorxyplot)."""
    return [
        _circle(of_temperature(motors.runs, kind), figure)
        for kind, figure in (("nonuniform", 26), ("uniform", 30))
    ]


def claims_of_the_position(motors: Motors) -> list[Claim]:
    """Return the claims of the two planar views."""
    return [
        _transition(of_temperature(motors.runs, kind), figure)
        for kind, figure in (("nonuniform", 27), ("uniform", 31))
    ]


def _circle(runs: Sequence[MotorRun], figure: int) -> Claim:
    flying = [run.data.position.values[in_flight(run), :2] for run in runs]
    radius = np.hypot(*np.concatenate(flying).T)
    valley = observables.motor_wells(runs[0].scene).radius
    distance = abs(float(radius.mean()) - valley)
    return judged(
        "Directed motion along a circle of certain radius",
        f"in its flights in runs {', '.join(run.name[-1] for run in runs)} the ball is at"
        f" ρ = {radius.mean():.3f} ± {radius.std():.3f} m (standard deviation); the valley is at"
        f" {valley:.3f} m",
        distance < 0.05 and radius.std() < 0.1,
        figures=(figure,),
    )


def _transition(runs: Sequence[MotorRun], figure: int) -> Claim:
    drifts, flying = (np.concatenate(several) for several in zip(*map(_drift, runs), strict=True))
    ratio = float(drifts[flying].mean() / drifts[~flying].mean())
    flown = sum(run.flights.sizes["flight"] > 0 for run in runs)
    return judged(
        "It is very clear from this plot that the motion transitions from noise driven to being"
        " inertia driven",
        f"over {WINDOW} s the ball moves {ratio:.1f} times as far around the ring in flights as"
        " between them"
        f" ({flown} of {len(runs)} runs have flights)",
        ratio > 1.5,
        figures=(figure,),
    )


def _drift(run: MotorRun) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the revolutions of the ball in each window, and whether it begins in flight."""
    stride = round(WINDOW / float(run.data.time[1] - run.data.time[0]))
    drift = np.abs(np.diff(run.revolutions[::stride]))
    return drift, in_flight(run)[::stride][: len(drift)]
