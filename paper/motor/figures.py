"""The paper's figures of the motor, at nonuniform temperature and at uniform."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from magmotor.devices.motor.scene import PAPER
from paper.figure import Claim, Figure
from paper.motor.energy import claims_of_the_energy, claims_of_the_injection
from paper.motor.pictures import motor_figure
from paper.motor.position import claims_of_the_path, claims_of_the_position, claims_of_theta
from paper.motor.runs import (
    DURATION,
    JUDGED,
    METHOD,
    NUMERICS,
    REFERENCE,
    SETS,
    Motors,
    many_runs,
    paper_runs,
)
from paper.motor.weak_noise import BATCHES, REPLICAS, SCENE, weak_noise
from paper.motor.weak_noise import NUMERICS as NUMERICS_OF_WEAK_NOISE


class Series(NamedTuple):
    """One figure of the paper's seven runs, with the claims that it decides."""

    title: str
    claims: Callable[[Motors], list[Claim]]
    numbers: tuple[int, ...]
    caption: str = ""
    sets: tuple[str, ...] = ()
    """Names in `SETS` of the further runs that the claims need."""
    with_reference: bool = False
    """Whether the claims need the set `JUDGED` by the reference."""
    with_weak_noise: bool = False
    """Whether the claims need the runs of `weak_noise`."""
    undecided: tuple[int, ...] = ()

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods of all runs."""
        return (METHOD, REFERENCE) if self.with_reference or self.with_weak_noise else (METHOD,)


def _strengths(kind: str) -> str:
    strengths = [f"{alpha:g}" for temperature, alpha, _ in PAPER.values() if temperature == kind]
    return f"({kind}-a, b, ... with α = {', '.join(strengths)})"


RUNS = (
    f"Top: noise on the inner ring only {_strengths('nonuniform')}. Bottom: uniform temperature"
    f" {_strengths('uniform')}. All by `{METHOD}` at h = {NUMERICS['timestep']} s, up to T ="
    f" {DURATION:g} s or until the inner ring tips over. The parameters are the paper's, except"
    " that the ball's axis starts along the field instead of upright (see Start in the"
    " [errata](errata.md#the-fluctuation-driven-motor)). The realizations are our own. A"
    " *flight* circles at least once without turning back by more than a quarter of a well's"
    " sector; it begins and ends where the ball turns back."
)

SERIES = {
    "theta": Series(
        "angular position of the ball", claims_of_theta, (3, 4),
        "Flights are timed from the end of their first revolution.", tuple(SETS),
        with_reference=True, undecided=(0, 1, 2, 3, 4, 5),
    ),
    "energy": Series(
        "total and inner ring energy", claims_of_the_energy, (24, 28),
        "Lines: means over 1/150 of the duration. Bands: from the smallest to the largest"
        " value. Below each: the difference of the two energies, which is the ball's kinetic"
        " energy plus its energy in the field of both rings. It is near or below zero where the"
        " ring has all of the gain.", ("nonuniform-a",), undecided=(0, 1),
    ),
    "injected": Series(
        "energy injected and dissipated", claims_of_the_injection, (25, 29),
        "Friction acts on the ball's slip, the velocity of its contact point over the floor,"
        " and, at uniform temperature, on the rotating ring.", ("nonuniform-a",),
        with_weak_noise=True, undecided=(1, 2, 3, 4),
    ),
    "path": Series("path of the ball from above", claims_of_the_path, (26, 30)),
    "xy": Series("x and y of the ball", claims_of_the_position, (27, 31), undecided=(0, 1)),
}  # fmt: skip


def _compute(series: Series, quick: bool) -> Motors:
    many = {name: many_runs(name, quick) for name in series.sets}
    reference = many_runs(JUDGED, quick, REFERENCE) if series.with_reference else None
    weak = weak_noise(quick) if series.with_weak_noise else None
    return Motors(paper_runs(quick), many, reference, weak, quick)


def _draw(name: str, motors: Motors, path: Path) -> None:
    motor_figure(motors.runs, name, path)


def _caption(series: Series) -> str:
    sizes = [f"{SETS[name].full} as {name} (h = {SETS[name].timestep} s)" for name in series.sets]
    if series.with_weak_noise:
        sizes.append(
            f"{REPLICAS * BATCHES} at nonuniform temperature with α = {SCENE.noises[-1]:g}"
            f" (`{REFERENCE}`, h = {NUMERICS_OF_WEAK_NOISE['timestep']} s)"
        )
    further = f"Further runs, not shown, decide some claims: {', '.join(sizes)}."
    return " ".join(filter(None, (RUNS, series.caption, further if sizes else "")))


FIGURES = [
    Figure(
        f"motor_{name}",
        f"Motor: {series.title}",
        _caption(series),
        partial(_compute, series),
        series.claims,
        partial(_draw, name),
        series.numbers,
        series.methods,
        series.undecided,
    )
    for name, series in SERIES.items()
]
