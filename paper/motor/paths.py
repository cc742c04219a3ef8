"""Claims on where the motor's ball goes, seen from above and over time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magmotor import observables
from magmotor.devices.motor.panels import MotorRun
from paper.claim import Claim, judged
from paper.motor.many_runs import Motors
from paper.motor.runs import in_flight, of_temperature

WINDOW = 100
"""In s, over which the drift of the ball round the centre is taken."""


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
