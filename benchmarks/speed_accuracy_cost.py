"""What a step costs each method: one replica, one core, without compilation and set-up."""

import time
from functools import partial

from case import Case, Record
from speed_accuracy_subjects import SUBJECTS, stepping_methods

import magmotor as mm

SHORT = 5_000
LONG = {"variational": 400_000, "mujoco": 80_000}
"""Steps of runs of some 0.1 s and more, against which set-up and interruptions are short."""

REPEATS, QUICK_REPEATS = 5, 3


def cases(quick: bool) -> list[Case]:
    """One for each subject and method."""
    return [
        Case(f"cost/{name}/{method}", partial(_step, name, method, quick), 0.5 if quick else 2.0)
        for name in SUBJECTS
        for method in stepping_methods(name)
    ]


def _step(name: str, method: str, quick: bool) -> Record:
    """Seconds a step: the difference of a long and a short run, each the least over repeats."""
    repeats = QUICK_REPEATS if quick else REPEATS
    long = LONG[method.partition("/")[0]] // (4 if quick else 1)
    _seconds(name, method, SHORT)
    turns: list[list[float]] = []
    seconds = 0.0
    while len(turns) < repeats or seconds <= 0:  # a busy machine may even delay the shorter more
        turns.append([_seconds(name, method, steps) for steps in (SHORT, long)])
        short_time, long_time = (min(times) for times in zip(*turns, strict=True))
        seconds = (long_time - short_time) / (long - SHORT)
    return {"subject": name, "method": method, "seconds_a_step": seconds}


def _seconds(name: str, method: str, steps: int) -> float:
    scene, timestep = SUBJECTS[name]
    begin = time.perf_counter()
    mm.simulate(
        scene, method=method, timestep=timestep, duration=timestep * steps, record_interval=steps
    )
    return time.perf_counter() - begin
