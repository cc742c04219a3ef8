"""Claims on where the motor's ball goes: its angular position, its flights and its path."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from magmotor import observables
from magmotor.devices.motor.exponential_test import LEVEL
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.observables import censored_mean, exponential_test
from paper.figure import Claim, Verdict, judged
from paper.motor.runs import DURATION, ManyRuns, Motors, in_flight, of_temperature

LONG = 6000.0
"""In s; were they exponential, those that have lasted for so long had as much left as at first."""

ALTERNATIVES = {"gamma, shape 2": stats.gamma(2), "Pareto tail of power 2.5": stats.lomax(2.5)}

ENOUGH = 0.9
"""The power for which an exponential law that is not rejected is taken as found."""

WINDOW = 100
"""In s, over which the drift of the ball round the center is taken."""


def claims_of_theta(motors: Motors) -> list[Claim]:
    """Of (fig:nctmagmotortheta) and (fig:ctmagmotortheta), and of the text on them."""
    hot, even = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    warm, cool = (
        [run for run in even if (run.scene.noises[-1] < 1e-3) == below] for below in (False, True)
    )
    many_hot, many_warm, many_cool = (
        motors.many[name] for name in ("nonuniform-a", "uniform-a", "uniform-d")
    )
    wait = float(np.median(many_cool.first))
    return [
        judged(
            "The plots show the magnetic ball transition between two metastable states:"
            " noise-driven and inertia-driven motion",
            _flown(hot, many_hot),
            _mostly(many_hot),
            figures=(3,),
        ),
        judged(
            "The same, of (a) and (b) (α = 0.001; the caption gives the α of the other figure)",
            _flown(warm, many_warm),
            _mostly(many_warm),
            figures=(4,),
        ),
        judged(
            "Realization (d) never transitions to a metastable state of the second kind"
            " (α = 0.00075)",
            f"{_flown(cool, many_cool)} within {DURATION:g} s, half of them before {wait:.0f} s: it"
            " depends on the duration, which is not told",
            not _mostly(many_cool),
            otherwise="in part",
            figures=(4,),
        ),
        claim_of_the_law(many_hot, 3),
        claim_of_the_law(many_warm, 4),
    ]


def _flown(runs: list[MotorRun], many: ManyRuns) -> str:
    counts = ", ".join(f"{run.name[-1]}: {run.flights.sizes['flight']}" for run in runs)
    longest = max(runs, key=lambda run: run.longest_turns)
    return (
        f"flights of run {counts}; the longest has {longest.longest_turns:.0f} revolutions; of"
        f" {many.runs} runs as {many.name} {many.flying} fly"
    )


def _mostly(many: ManyRuns) -> bool:
    return many.flying > many.runs / 2


def claim_of_the_law(found: ManyRuns, figure: int) -> Claim:
    """That flights are exponential in law, and how well the test tells other laws from it."""
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


def claims_of_the_path(motors: Motors) -> list[Claim]:
    """Of (fig:nctmagmotorxyplot) and (fig:ctmagmotorxyplot), and of the text on the circle."""
    return [
        _circle(of_temperature(motors.runs, kind), figure)
        for kind, figure in (("nonuniform", 26), ("uniform", 30))
    ]


def claims_of_the_position(motors: Motors) -> list[Claim]:
    """Of the two planar views."""
    return [
        _transition(of_temperature(motors.runs, kind), figure)
        for kind, figure in (("nonuniform", 27), ("uniform", 31))
    ]


def _circle(runs: Sequence[MotorRun], figure: int) -> Claim:
    flying = [run.data.position.values[in_flight(run), :2] for run in runs]
    radius = np.hypot(*np.concatenate(flying).T)
    valley = observables.motor_wells(runs[0].scene).radius
    away = abs(float(radius.mean()) - valley)
    return judged(
        "Directed motion along a circle of certain radius",
        f"in its flights in runs {', '.join(run.name[-1] for run in runs)} the ball is at"
        f" ρ = {radius.mean():.3f} ± {radius.std():.3f} m (standard deviation); the valley is at"
        f" {valley:.3f} m",
        away < 0.05 and radius.std() < 0.1,
        figures=(figure,),
    )


def _transition(runs: Sequence[MotorRun], figure: int) -> Claim:
    drifts, flying = (np.concatenate(several) for several in zip(*map(_drift, runs), strict=True))
    ratio = float(drifts[flying].mean() / drifts[~flying].mean())
    flown = sum(run.flights.sizes["flight"] > 0 for run in runs)
    return judged(
        "It is very clear from this plot that the motion transitions from noise driven to being"
        " inertia driven",
        f"over {WINDOW} s the ball goes {ratio:.1f} times as far round in flights as in between"
        f" ({flown} of {len(runs)} runs have flights)",
        ratio > 1.5,
        figures=(figure,),
    )


def _drift(run: MotorRun) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Revolutions of the ball in each window, and whether that begins in flight."""
    stride = round(WINDOW / float(run.data.time[1] - run.data.time[0]))
    drift = np.abs(np.diff(run.revolutions[::stride]))
    return drift, in_flight(run)[::stride][: len(drift)]
