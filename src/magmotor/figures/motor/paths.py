"""Claims on where the motor's ball goes, seen from above and over time."""

from collections.abc import Sequence

import numpy as np

from magmotor import observables
from magmotor.figures.claim import Claim, judged
from magmotor.figures.motor.runs import in_flight, of_temperature
from magmotor.plots.motor_panels import MotorRun

WINDOW = 100
"""In s, over which the drift of the ball round the centre is taken."""


def claims_of_the_path(runs: list[MotorRun]) -> list[Claim]:
    """Of (fig:nctmagmotorxyplot) and (fig:ctmagmotorxyplot), and of the text on the circle."""
    return [
        _circle(of_temperature(runs, kind), figure)
        for kind, figure in (("nonuniform", 26), ("uniform", 30))
    ]


def claims_of_the_position(runs: list[MotorRun]) -> list[Claim]:
    """Of the two planar views."""
    return [
        _transition(of_temperature(runs, kind), figure)
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
    ratios = []
    for run in (run for run in runs if run.flights.sizes["flight"]):
        stride = round(WINDOW / float(run.data.time[1] - run.data.time[0]))
        drift = np.abs(np.diff(run.revolutions[::stride]))
        flying = in_flight(run)[::stride][: len(drift)]
        ratios.append(float(drift[flying].mean() / drift[~flying].mean()))
    return judged(
        "It is very clear from this plot that the motion transitions from noise driven to being"
        " inertia driven",
        f"over {WINDOW} s the ball goes {min(ratios):.1f} to {max(ratios):.1f} times as far"
        f" round in flights as in between ({len(ratios)} of {len(runs)} runs have flights)",
        min(ratios) > 1.5,
        figures=(figure,),
    )
