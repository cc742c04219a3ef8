"""Claims about the motion of the motor's ball: angular position, flights and path."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from magmotor import observables
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.observables import censored_mean
from paper.figure import Claim, Verdict, judged
from paper.motor.exponential_test import LEVEL, exponential_test
from paper.motor.rotor import WINDOW
from paper.motor.runs import (
    DURATION,
    SIGNIFICANT,
    ManyRuns,
    Motors,
    in_flight,
    of_temperature,
)
from paper.motor.two_states import ROTORS, Rotors, States, rotors_beside, states_of

LONG = 6000.0
"""In s; exponential flights that have lasted this long have the same mean remaining duration."""

ALTERNATIVES = {"gamma, shape 2": stats.gamma(2), "Pareto tail of power 2.5": stats.lomax(2.5)}

ENOUGH = 0.9
"""Power of the test from which an exponential law that is not rejected counts as confirmed."""


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
    rotors = {
        3: rotors_beside("nonuniform", len(nonuniform), motors.quick),
        4: rotors_beside("uniform", len(warm), motors.quick),
    }
    return [
        _two_states(
            "The plots show the magnetic ball transition between two metastable states:"
            " noise-driven and inertia-driven motion",
            nonuniform, many_nonuniform, rotors[3], 3,
        ),
        _two_states(
            "The same, of (a) and (b) (α = 0.001; the caption gives the α of the other figure)",
            warm, many_warm, rotors[4], 4,
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
        claim_of_the_law(many_nonuniform, 3, rotors[3].squared_variation),
        claim_of_the_law(many_warm, None, rotors[4].squared_variation),
        *([claim_of_agreement(many_warm, motors.reference)] if motors.reference else []),
    ]  # fmt: skip


def _two_states(
    says: str, runs: list[MotorRun], many: ManyRuns, rotors: Rotors, figure: int
) -> Claim:
    """Return the claim of two states, which needs flights, and wells that hold the ball.

    A rotor without wells has flights, too, but is near a well as often in flight as otherwise.
    """
    found = states_of(runs)
    if not _most_fly(many):
        verdict: Verdict = "wrong"
    else:
        verdict = "right" if _held(found, rotors) else "in part"
    return Claim(
        says,
        f"{_flight_counts(runs, many)}; so do {rotors.flying} of {ROTORS} rotors without wells that"
        f" have the ball's rate and memory. What they do not do: {_residence(found, rotors)}",
        verdict,
        (figure,),
    )


def _held(found: States, rotors: Rotors) -> bool:
    spread = np.hypot(rotors.spread.cores_between, rotors.spread.cores_in_flight)
    return bool(found.held > rotors.mean.held + SIGNIFICANT * spread)


def _residence(found: States, rotors: Rotors) -> str:
    between, flying = rotors.mean.cores_between, rotors.mean.cores_in_flight
    return (
        f"between flights the ball is for {found.cores_between:.2f} of the time in the cores of"
        f" wells, in flight for {found.cores_in_flight:.2f} (rotors {between:.2f} ±"
        f" {rotors.spread.cores_between:.2f} and {flying:.2f} ±"
        f" {rotors.spread.cores_in_flight:.2f})"
    )


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


def claim_of_the_law(found: ManyRuns, figure: int | None, rotors: tuple[float, float]) -> Claim:
    """Return the claim that flights are exponential, with the power of the test.

    The paper says so of one figure, otherwise the claim is ours. `rotors` are the squared variation
    of flights of rotors without wells, and its error.
    """
    lasts, limits, censored = found.flights
    test = exponential_test(lasts, censored, limits, ALTERNATIVES)
    mean = censored_mean(lasts, censored)
    long = lasts >= LONG
    later = censored_mean(lasts[long] - LONG, censored[long])
    seen = f"{len(lasts)} flights of {found.runs} runs as {found.name}"
    power = " and ".join(f"{100 * test.power[name]:.0f} % ({name})" for name in ALTERNATIVES)
    enough = min(test.power.values()) >= ENOUGH
    verdict: Verdict = "wrong" if test.rejected else "right" if enough else "not decided"
    says = "It spins for a random amount of time, observed to be exponential in law"
    if figure is None:
        says = "Ours: at uniform temperature, flights are exponential in law, too"
    return Claim(
        says,
        f"{seen} last, after the first revolution, {mean.mean:.0f} ± {mean.error:.0f} s more,"
        f" {censored.sum()} of them cut off by the run's end: squared coefficient of variation"
        f" {test.squared_variation:.2f}, 1 if exponential (p = {test.p_value:.1g}; at"
        f" {100 * LEVEL:g} % the test detects other laws in {power} of the cases); those that have"
        f" lasted {LONG:g} s more have {later.mean:.0f} ± {later.error:.0f} s left. Flights of"
        f" rotors without wells: {rotors[0]:.2f} ± {rotors[1]:.2f}. By other definitions of a"
        " flight: see the law of its flights, below",
        verdict,
        () if figure is None else (figure,),
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
        _transition(of_temperature(motors.runs, kind), figure, motors.quick)
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


def _transition(runs: Sequence[MotorRun], figure: int, quick: bool) -> Claim:
    """Return the claim of a clear transition, which a rotor must not show as clearly."""
    found = states_of(runs)
    rotors = rotors_beside(runs[0].scene.temperature, len(runs), quick)
    mean, spread = rotors.mean.contrast, rotors.spread.contrast
    clear = found.contrast > mean + SIGNIFICANT * spread
    verdict: Verdict = "right" if clear else "in part" if _held(found, rotors) else "wrong"
    flown = sum(run.flights.sizes["flight"] > 0 for run in runs)
    return Claim(
        "It is very clear from this plot that the motion transitions from noise driven to being"
        " inertia driven",
        f"over {WINDOW:g} s the ball moves {found.contrast:.1f} times as far around the ring in"
        f" flights as between them ({flown} of {len(runs)} runs have flights); rotors without wells"
        f" of the same rate and memory ({rotors.measured.memory:.0f} s) move {mean:.1f} ±"
        f" {spread:.1f} times as far, since flights are selected as parts without reversal. What"
        f" rotors do not do: {_residence(found, rotors)}",
        verdict,
        (figure,),
    )
