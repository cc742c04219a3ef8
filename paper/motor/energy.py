"""Claims about the motor's energy: its gain, the noise's injection, friction's dissipation."""

from collections.abc import Callable, Sequence

import numpy as np

from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import Motor
from paper.figure import Claim, Verdict, judged
from paper.motor.runs import (
    SIGNIFICANT,
    HeatAndWork,
    ManyRuns,
    Motors,
    added,
    heat_and_work_in_flights,
    heat_and_work_of,
    of_temperature,
)


def claims_of_the_energy(motors: Motors) -> list[Claim]:
    """Return the claims of (fig:nctmagmotorenergy), (fig:ctmagmotorenergy) and the text on work."""
    nonuniform, uniform = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    largest_change = max(
        float(np.abs(run.balance.gain).max() / run.balance.injected[-1]) for run in uniform
    )
    many = motors.many["nonuniform-a"]
    total = added(many.heat_and_work)
    gain, error = _ratio(many.whole, "injected", lambda run: run.work - run.heat)
    of_work, of_work_error = _ratio(many.whole, "work", lambda run: run.work - run.heat)
    gains = [float(run.balance.gain[-1] / run.balance.injected[-1]) for run in nonuniform]
    kinetic_share = total.fastest / total.work
    return [
        judged(
            "Although there is dissipation, the thermal fluctuations inject energy into the system",
            f"{many.runs} runs as {many.name} gain {gain:.2f} ± {error:.2f} of the mean energy that"
            f" the noise injects, the runs of the figure {min(gains):.2f} to {max(gains):.2f}",
            gain > 0.05 + SIGNIFICANT * error,
            figures=(24,),
        ),
        judged(
            "The same at uniform temperature",
            "they inject energy, and friction removes as much: the energy changes by at most"
            f" {largest_change:.4f} of the total injected",
            largest_change < 0.01,
            figures=(28,),
        ),
        judged(
            "The energy injected into the system by the white noise mainly adds to the speed of the"
            " top (in inertia-driven motion)",
            f"in {total.spans} flights of {many.runs} runs as {many.name} the noise does"
            f" {1e3 * total.work:.2f} mJ of work; the largest kinetic energies of the ball in each"
            f" flight sum to {kinetic_share:.2f} of that; friction dissipates"
            f" {total.heat / total.work:.2f}, the inner ring gains {total.ring / total.work:.2f}",
            kinetic_share > 0.5,
            figures=(24,),
        ),
        judged(
            "The work performed by the random torque is equal to the change in total energy",
            f"in {many.runs} runs as {many.name} the change is {of_work:.2f} ± {of_work_error:.2f}"
            " of the work; the rest is heat",
            of_work + SIGNIFICANT * of_work_error > 0.95,
            figures=(24,),
        ),
    ]


def claims_of_the_injection(motors: Motors) -> list[Claim]:
    """Return the claims of (fig:nctmagmotorenergyloss) and (fig:ctmagmotorenergyloss)."""
    nonuniform, uniform = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    nonuniform_ratios, uniform_ratios = (
        [float(run.balance.heat[-1] / run.balance.injected[-1]) for run in group]
        for group in (nonuniform, uniform)
    )
    residual = max(run.residual for run in motors.runs)
    return [
        judged(
            "In the constant temperature case we see an approximate balance between these energies",
            f"dissipated over injected {min(uniform_ratios):.3f} to {max(uniform_ratios):.3f}"
            " (nonuniform:"
            f" {min(nonuniform_ratios):.2f} to {max(nonuniform_ratios):.2f})",
            max(abs(ratio - 1) for ratio in uniform_ratios) < 0.02,
            figures=(29,),
        ),
        _critical_velocity(motors.many["nonuniform-a"]),
        _at_uniform_temperature(uniform),
        judged(
            "dE is work minus heat along each path",
            f"to {residual:.0e} of the total injected",
            residual < 5e-3,
        ),
    ]


CRITICAL = (
    "Provided that the inner ring does not turn on its side, 1) the top reaches a critical velocity"
    " in which the energy dissipated is on average equal to the energy injected, or 2) it escapes"
    " from the potential well"
)


def _critical_velocity(many: ManyRuns) -> Claim:
    total = added(many.heat_and_work)
    ratio, error = _ratio(many.heat_and_work, "injected", lambda run: run.heat)
    escape_radius = Motor.paper(many.name).outer_radius
    return judged(
        CRITICAL,
        f"in {total.spans} flights of {many.runs} runs as {many.name} friction dissipates"
        f" {ratio:.2f} ± {error:.2f} of the mean energy that the noise injects,"
        f" and the ball stays within ρ = {many.reach:.2f} m (outer ring: {escape_radius:g} m);"
        f" {many.tipped} of the runs end because the inner ring turns on its side",
        abs(ratio - 1) < 0.1 or many.reach > escape_radius,
        figures=(25,),
    )


def _ratio(
    runs: Sequence[HeatAndWork], whole: str, part: Callable[[HeatAndWork], float]
) -> tuple[float, float]:
    """Return the ratio of sums over independent runs, and its standard error."""
    parts, wholes = np.array([(part(run), getattr(run, whole)) for run in runs]).T
    ratio = parts.sum() / wholes.sum()
    return ratio, float(np.linalg.norm(parts - ratio * wholes) / wholes.sum())


def _at_uniform_temperature(runs: Sequence[MotorRun]) -> Claim:
    """Return the claim at uniform temperature; balance at any velocity shows no critical one."""
    in_flight = added(map(heat_and_work_in_flights, runs))
    whole = added(map(heat_and_work_of, runs))
    ratios = (
        in_flight.heat / in_flight.injected,
        (whole.heat - in_flight.heat) / (whole.injected - in_flight.injected),
    )
    balanced, resting = (abs(ratio - 1) < 0.02 for ratio in ratios)
    verdict: Verdict = "wrong" if not balanced else "in part" if resting else "right"
    return Claim(
        "The same at uniform temperature: this phenomenon persists",
        f"dissipated over injected {ratios[0]:.3f} in {in_flight.spans} flights, and also"
        f" {ratios[1]:.3f} outside of them: the uniform temperature balances them at any velocity",
        verdict,
        (29,),
    )
