"""Claims on the motor's energy: what it gains, what the noise injects, what friction takes."""

from collections.abc import Sequence

import numpy as np

from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import Motor
from paper.figure import Claim, Verdict, judged
from paper.motor.runs import (
    ManyRuns,
    Motors,
    added,
    heat_and_work_in_flights,
    heat_and_work_of,
    of_temperature,
)


def claims_of_the_energy(motors: Motors) -> list[Claim]:
    """Of (fig:nctmagmotorenergy) and (fig:ctmagmotorenergy), and of the text on work."""
    hot, even = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    gains = np.array([float(run.balance.gain[-1]) for run in hot])
    given = np.array([float(run.balance.injected[-1]) for run in hot])
    stays = max(float(np.abs(run.balance.gain).max() / run.balance.injected[-1]) for run in even)
    ratios = [float(run.balance.gain[-1] / run.balance.work[-1]) for run in hot]
    many = motors.many["nonuniform-a"]
    total = added(many.heat_and_work)
    share = total.fastest / total.work
    return [
        judged(
            "Although there is dissipation, the thermal fluctuations inject energy into the system",
            f"all runs have gained {gains.sum() / given.sum():.2f} of what the noise injects in the"
            f" mean, each run {min(gains / given):.2f} to {max(gains / given):.2f}",
            gains.sum() > 0.05 * given.sum(),
            figures=(24,),
        ),
        judged(
            "The same at uniform temperature",
            f"they inject, and friction takes as much: the energy stays within {stays:.4f} of what"
            " is injected in all",
            stays < 0.01,
            figures=(28,),
        ),
        judged(
            "The energy injected into the system by the white noise mainly adds to the speed of the"
            " top (in inertia-driven motion)",
            f"in {total.spans} flights of {many.runs} runs as {many.name} the noise does"
            f" {1e3 * total.work:.2f} mJ of work; the ball's kinetic energy, where it is greatest"
            f" in each flight, sums up to {share:.2f} of that; friction dissipates"
            f" {total.heat / total.work:.2f}, the inner ring gains {total.ring / total.work:.2f}",
            share > 0.5,
            figures=(24,),
        ),
        judged(
            "The work performed by the random torque is equal to the change in total energy",
            f"the change is {min(ratios):.2f} to {max(ratios):.2f} of the work; the rest is heat",
            min(ratios) > 0.95,
            figures=(24,),
        ),
    ]


def claims_of_the_injection(motors: Motors) -> list[Claim]:
    """Of (fig:nctmagmotorenergyloss) and (fig:ctmagmotorenergyloss), and of the text on them."""
    hot, even = (of_temperature(motors.runs, kind) for kind in ("nonuniform", "uniform"))
    cool, warm = (
        [float(run.balance.heat[-1] / run.balance.injected[-1]) for run in some]
        for some in (hot, even)
    )
    residual = max(run.residual for run in motors.runs)
    return [
        judged(
            "In the constant temperature case we see an approximate balance between these energies",
            f"dissipated over injected {min(warm):.3f} to {max(warm):.3f} (nonuniform:"
            f" {min(cool):.2f} to {max(cool):.2f})",
            max(abs(ratio - 1) for ratio in warm) < 0.02,
            figures=(29,),
        ),
        _critical_velocity(motors.many["nonuniform-a"]),
        _at_uniform_temperature(even),
        judged(
            "dE is work minus heat along each path",
            f"to {residual:.0e} of what is injected in all",
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
    ratio = total.heat / total.injected
    # The standard error of a ratio of sums over independent runs.
    error = np.sqrt(sum((run.heat - ratio * run.injected) ** 2 for run in many.heat_and_work))
    away = Motor.paper(many.name).outer_radius
    return judged(
        CRITICAL,
        f"in {total.spans} flights of {many.runs} runs as {many.name} friction dissipates"
        f" {ratio:.2f} ± {error / total.injected:.2f} of what the noise injects in the mean, and"
        f" the ball stays within ρ = {many.reach:.2f} m (outer ring: {away:g} m); it is the ring on"
        f" its side that ends {many.tipped} of the runs",
        abs(ratio - 1) < 0.1 or many.reach > away,
        figures=(25,),
    )


def _at_uniform_temperature(runs: Sequence[MotorRun]) -> Claim:
    """An equality that holds at any velocity is not of a critical one."""
    flying = added(map(heat_and_work_in_flights, runs))
    every = added(map(heat_and_work_of, runs))
    ratios = (
        flying.heat / flying.injected,
        (every.heat - flying.heat) / (every.injected - flying.injected),
    )
    balanced, resting = (abs(ratio - 1) < 0.02 for ratio in ratios)
    verdict: Verdict = "wrong" if not balanced else "in part" if resting else "right"
    return Claim(
        "The same at uniform temperature: this phenomenon persists",
        f"dissipated over injected {ratios[0]:.3f} in {flying.spans} flights, but"
        f" {ratios[1]:.3f} outside of them, too: it is the one temperature that balances them, at"
        " any velocity",
        verdict,
        (29,),
    )
