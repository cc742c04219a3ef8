"""What a step costs each method: one replica, one core."""

import time
from functools import partial

from case import Case, Record
from speed_accuracy_subjects import SUBJECTS, stepping_methods
from step_cost import seconds_a_step

import magmotor as mm

LONG = {"variational": 400_000, "mujoco": 80_000}
"""Steps of runs of some 0.1 s and more."""

REPEATS, QUICK_REPEATS = 5, 3


def cases(quick: bool) -> list[Case]:
    """One for each subject and method."""
    return [
        Case(f"cost/{name}/{method}", partial(_step, name, method, quick), 0.5 if quick else 2.0)
        for name in SUBJECTS
        for method in stepping_methods(name)
    ]


def _step(name: str, method: str, quick: bool) -> Record:
    long = LONG[method.partition("/")[0]] // (4 if quick else 1)
    repeats = QUICK_REPEATS if quick else REPEATS
    cost = seconds_a_step(partial(_seconds, name, method), long, repeats)
    return {"subject": name, "method": method, "seconds_a_step": cost}


def _seconds(name: str, method: str, steps: int) -> float:
    scene, timestep = SUBJECTS[name]
    begin = time.perf_counter()
    mm.simulate(
        scene, method=method, timestep=timestep, duration=timestep * steps, record_interval=steps
    )
    return time.perf_counter() - begin
