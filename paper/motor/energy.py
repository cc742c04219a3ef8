"""Claims about the motor's energy: its gain, the noise's injection, friction's dissipation."""

from collections.abc import Callable, Sequence

import numpy as np

from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import PAPER, Motor
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
from paper.motor.weak_noise import SCENE, WARM, WeakNoise, axial_part, cogging


def claims_of_the_energy(motors: Motors) -> list[Claim]:
    """Return the claims of (fig:nctmagmotorenergy), (fig:ctmagmotorenergy) and the text on work."""
    nonuniform, uniform = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    change = max(
        float(np.abs(run.balance.gain).max() / run.balance.injected[-1]) for run in uniform
    )
    works = [float(run.balance.work[-1] / run.balance.injected[-1]) for run in uniform]
    many = motors.many["nonuniform-a"]
    gain, error = _ratio(many.whole, "injected", lambda run: run.work - run.heat)
    of_work, of_work_error = _ratio(many.whole, "work", lambda run: run.work - run.heat)
    gains = [float(run.balance.gain[-1] / run.balance.injected[-1]) for run in nonuniform]
    return [
        judged(
            "Although there is dissipation, the thermal fluctuations inject energy into the system",
            f"at nonuniform temperature {many.runs} runs as {many.name} gain"
            f" {gain:.2f} ± {error:.2f} of the mean energy that the noise injects, the runs of the"
            f" figure {min(gains):.2f} to {max(gains):.2f}; at uniform temperature the noise does"
            f" {min(works):.3f} to {max(works):.3f} of it as work, and friction removes as much:"
            f" the energy changes by at most {change:.4f} of it",
            gain > 0.05 + SIGNIFICANT * error and min(works) > 0.9,
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
    """Return the claims of (fig:nctmagmotorenergyloss), (fig:ctmagmotorenergyloss) and the text."""
    nonuniform, uniform = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    nonuniform_ratios, uniform_ratios = (
        [float(run.balance.heat[-1] / run.balance.injected[-1]) for run in group]
        for group in (nonuniform, uniform)
    )
    residual = max(run.residual for run in motors.runs)
    many, weak = motors.many["nonuniform-a"], motors.weak
    assert weak is not None
    return [
        judged(
            "In the constant temperature case we see an approximate balance between these energies",
            f"dissipated over injected {min(uniform_ratios):.3f} to {max(uniform_ratios):.3f}"
            " (nonuniform:"
            f" {min(nonuniform_ratios):.2f} to {max(nonuniform_ratios):.2f})",
            max(abs(ratio - 1) for ratio in uniform_ratios) < 0.02,
            figures=(29,),
        ),
        _speed_of_the_ball(many, weak.many),
        _critical_velocity(many, weak),
        _axial_rotation(weak),
        _at_uniform_temperature(uniform),
        judged(
            "E(t) - E(0) is the integral of -c V_Q² (at uniform temperature also of -c ω_R²), plus"
            " the injected energy, plus a martingale (appendix)",
            f"with the martingale summed along each path to {residual:.0e} of the total injected",
            residual < 5e-3,
        ),
    ]


def _speed_of_the_ball(*sets: ManyRuns) -> Claim:
    """Return the claim on where the noise's work goes in flights, at each strength of the noise."""
    spent = [added(many.heat_and_work) for many in sets]
    shares = [total.fastest / total.work for total in spent]
    listed = "; ".join(
        f"in {total.spans} flights of {many.runs} runs {_strength_of(many)} the noise does"
        f" {1e3 * total.work:.2f} mJ of work, the largest kinetic energies of the ball in each"
        f" flight sum to {share:.2f} of that, friction dissipates {total.heat / total.work:.2f},"
        f" and the inner ring gains {total.ring / total.work:.2f}"
        for many, total, share in zip(sets, spent, shares, strict=True)
    )
    return judged(
        "This motion is inertia-driven and the energy injected into the system by the white noise"
        " mainly adds to the speed of the top",
        listed,
        min(shares) > 0.5,
        otherwise="in part" if max(shares) > 0.5 else "wrong",
        figures=(25,),
    )


def _strength_of(many: ManyRuns) -> str:
    return f"as {many.name}" if many.name in PAPER else f"with α = {SCENE.noises[-1]:g}"


def _critical_velocity(many: ManyRuns, weak: WeakNoise) -> Claim:
    """Return the claim on balance in flight: right if it is reached at both strengths."""
    flying = [_ratio(found.heat_and_work, "injected", _heat) for found in (many, weak.many)]
    balanced = [abs(ratio - 1) < 0.1 + SIGNIFICANT * error for ratio, error in flying]
    spans = [added(found.heat_and_work).spans for found in (many, weak.many)]
    (strong, strong_error), (late, late_error) = flying
    whole, whole_error = _ratio(weak.many.whole, "injected", _heat)
    escape_radius = Motor.paper(many.name).outer_radius
    reach = max(many.reach, weak.many.reach)
    return judged(
        "Provided that the inner ring does not turn on its side, 1) the top reaches a critical"
        " velocity in which the energy dissipated is on average equal to the energy injected, or"
        " 2) it escapes from the potential well",
        f"with the paper's α = {Motor.paper(many.name).noises[-1]:g}, friction dissipates"
        f" {strong:.2f} ± {strong_error:.2f} of the mean energy that the noise injects in"
        f" {spans[0]} flights of {many.runs} runs, {many.tipped} of which end because the ring"
        f" turns on its side. With α = {weak.strength:g} the ring stays up for longer: from"
        f" {WARM:g} s on, friction dissipates {late:.2f} ± {late_error:.2f} in {spans[1]} flights"
        f" of {weak.many.runs} runs, but {whole:.2f} ± {whole_error:.2f} in all; in"
        f" the long run it is {1 - axial_part(SCENE):.2f} at most. No ball leaves ρ = {reach:.2f} m"
        f" (outer ring: {escape_radius:g} m)",
        all(balanced) or reach > escape_radius,
        otherwise="in part" if any(balanced) else "wrong",
        figures=(25,),
    )


def _heat(run: HeatAndWork) -> float:
    return run.heat


def _axial_rotation(weak: WeakNoise) -> Claim:
    """Return the claim on what the axial rotation of the ring takes."""
    part, found = axial_part(SCENE), float(weak.axial.mean())
    error = float(weak.axial.std(ddof=1)) / np.sqrt(len(weak.axial))
    sector = 2 * np.pi / SCENE.inner_dipoles
    depth = float(cogging(SCENE, np.linspace(0, sector, 41)).max())
    return judged(
        "Ours: friction never takes all: J₃⁻¹/tr(I_R⁻¹) of what the noise injects swings the inner"
        " ring about its own axis, which nothing damps",
        f"{part:.2f} by the formula, {found:.2f} ± {error:.2f} in {len(weak.axial)} runs with"
        f" α = {weak.strength:g}, including the energy in the wells, {1e6 * depth:.0f} µJ deep, in"
        f" which the outer dipoles hold the {SCENE.inner_dipoles} inner ones",
        abs(found - part) < SIGNIFICANT * error,
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
        "Conducting this same experiment at uniform temperature reveals that this phenomenon"
        " persists",
        f"dissipated over injected {ratios[0]:.3f} in {in_flight.spans} flights, and also"
        f" {ratios[1]:.3f} outside of them: the uniform temperature balances them at any velocity",
        verdict,
        (29,),
    )
