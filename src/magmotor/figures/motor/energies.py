"""Claims on the motor's energy: what it gains, what the noise injects, what friction takes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.figures.claim import Claim, Verdict, judged
from magmotor.figures.motor.runs import of_temperature
from magmotor.plots.motor_panels import MotorRun


class Books(NamedTuple):
    """Sums over the flights of some runs, in J."""

    flights: int
    work: float
    """of the noise"""
    injected: float
    """by the noise in the mean"""
    heat: float
    """dissipated by friction"""
    ring: float
    """gained by the inner ring"""
    fastest: float
    """of each flight the greatest kinetic energy of the ball"""


def claims_of_the_energy(runs: list[MotorRun]) -> list[Claim]:
    """Of (fig:nctmagmotorenergy) and (fig:ctmagmotorenergy), and of the text on work."""
    hot, even = (of_temperature(runs, kind) for kind in ("nonuniform", "uniform"))
    gains = [float(run.balance.gain[-1] / run.balance.injected[-1]) for run in hot]
    stays = max(float(np.abs(run.balance.gain).max() / run.balance.injected[-1]) for run in even)
    ratios = [float(run.balance.gain[-1] / run.balance.work[-1]) for run in hot]
    books = _books(hot)
    share = books.fastest / books.work
    return [
        judged(
            "Although there is dissipation, the thermal fluctuations inject energy into the system",
            f"it has gained {min(gains):.2f} to {max(gains):.2f} of what the noise injects in the"
            " mean",
            min(gains) > 0.05,
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
            f"in {books.flights} flights the noise does {1e3 * books.work:.2f} mJ of work; the"
            f" ball's kinetic energy, where it is greatest in each flight, sums up to {share:.2f}"
            f" of that; friction dissipates {books.heat / books.work:.2f}, the inner ring gains"
            f" {books.ring / books.work:.2f}",
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


def claims_of_the_injection(runs: list[MotorRun]) -> list[Claim]:
    """Of (fig:nctmagmotorenergyloss) and (fig:ctmagmotorenergyloss), and of the text on them."""
    hot, even = (of_temperature(runs, kind) for kind in ("nonuniform", "uniform"))
    cool, warm = (
        [float(run.balance.heat[-1] / run.balance.injected[-1]) for run in some]
        for some in (hot, even)
    )
    residual = max(run.residual for run in runs)
    return [
        judged(
            "In the constant temperature case we see an approximate balance between these energies",
            f"dissipated over injected {min(warm):.3f} to {max(warm):.3f} (nonuniform:"
            f" {min(cool):.2f} to {max(cool):.2f})",
            max(abs(ratio - 1) for ratio in warm) < 0.02,
            figures=(29,),
        ),
        _critical_velocity(hot),
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


def _critical_velocity(runs: Sequence[MotorRun]) -> Claim:
    books = _books(runs)
    ratio = books.heat / books.injected
    reach = max(float(np.hypot(*run.data.position.values[:, :2].T).max()) for run in runs)
    away = runs[0].scene.outer_radius
    tipped = sum("stopped" in run.data.attrs for run in runs)
    return judged(
        CRITICAL,
        f"in {books.flights} flights friction dissipates {ratio:.2f} of what the noise injects in"
        f" the mean, and the ball stays within ρ = {reach:.2f} m (outer ring: {away:g} m); it is"
        f" the ring on its side that ends {tipped} of {len(runs)} runs",
        abs(ratio - 1) < 0.1 or reach > away,
        figures=(25,),
    )


def _at_uniform_temperature(runs: Sequence[MotorRun]) -> Claim:
    """An equality that holds at any velocity is not of a critical one."""
    flying = _books(runs)
    every = [_sum(run, np.array([[0, len(run.data.time) - 1]])) for run in runs]
    heat, injected = (sum(getattr(e, name) for e in every) for name in ("heat", "injected"))
    ratios = (
        flying.heat / flying.injected,
        (heat - flying.heat) / (injected - flying.injected),
    )
    balanced, resting = (abs(ratio - 1) < 0.02 for ratio in ratios)
    verdict: Verdict = "wrong" if not balanced else "in part" if resting else "right"
    return Claim(
        "The same at uniform temperature: this phenomenon persists",
        f"dissipated over injected {ratios[0]:.3f} in {flying.flights} flights, but"
        f" {ratios[1]:.3f} outside of them, too: it is the one temperature that balances them, at"
        " any velocity",
        verdict,
        (29,),
    )


def _books(runs: Sequence[MotorRun]) -> Books:
    each = [_sum(run, _flights(run)) for run in runs]
    return Books(*(sum(values) for values in zip(*each, strict=True)))


def _flights(run: MotorRun) -> NDArray[np.int_]:
    """First and last record of each, shape (F, 2)."""
    ends = np.stack([run.flights.begin.values, run.flights.end.values], axis=1)
    return np.searchsorted(run.data.time.values, ends)


def _sum(run: MotorRun, spans: NDArray[np.int_]) -> Books:
    data, scene, balance = run.data, run.scene, run.balance
    kinetic = 0.5 * (
        scene.ball_mass * (data.velocity**2).sum("space")
        + scene.ball_inertia * (data.angular_velocity**2).sum("space")
    )
    work, injected, heat, ring = (
        float(np.diff(series.values[spans], axis=1).sum())
        for series in (balance.work, balance.injected, balance.heat, data.ring_energy)
    )
    fastest = sum(float(kinetic[begin : end + 1].max()) for begin, end in spans)
    return Books(len(spans), work, injected, heat, ring, fastest)
