"""Claims on the angular position of the ball, at nonuniform temperature and at uniform."""

import numpy as np

from magmotor.devices.motor.panels import MotorRun
from paper.claim import Claim, judged
from paper.motor.flight_law import claim_of_the_law
from paper.motor.many_runs import ManyRuns, Motors
from paper.motor.runs import DURATION, of_temperature


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
            _told(hot, many_hot),
            _mostly(many_hot),
            figures=(3,),
        ),
        judged(
            "The same, of (a) and (b) (α = 0.001; the caption gives the α of the other figure)",
            _told(warm, many_warm),
            _mostly(many_warm),
            figures=(4,),
        ),
        judged(
            "Realization (d) never transitions to a metastable state of the second kind"
            " (α = 0.00075)",
            f"{_told(cool, many_cool)} within {DURATION:g} s, half of them before {wait:.0f} s: it"
            " depends on the duration, which is not told",
            not _mostly(many_cool),
            otherwise="in part",
            figures=(4,),
        ),
        claim_of_the_law(many_hot, 3),
        claim_of_the_law(many_warm, 4),
    ]


def _told(runs: list[MotorRun], many: ManyRuns) -> str:
    counts = ", ".join(f"{run.name[-1]}: {run.flights.sizes['flight']}" for run in runs)
    longest = max(runs, key=lambda run: run.longest_turns)
    return (
        f"flights of run {counts}; the longest has {longest.longest_turns:.0f} revolutions; of"
        f" {many.runs} runs as {many.name} {many.flying} fly"
    )


def _mostly(many: ManyRuns) -> bool:
    return many.flying > many.runs / 2
