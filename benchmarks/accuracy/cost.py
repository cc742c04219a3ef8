"""The cost of a step with each method: one replica, one core."""

from functools import partial

from benchmarks.accuracy.scenes import SCENES, stepping_methods
from benchmarks.harness.records import Case, Record
from benchmarks.harness.timing import run_seconds, seconds_a_step

LONG = {"variational": 400_000, "mujoco": 80_000}
"""Steps of runs that take at least about 0.1 s."""

TURNS, QUICK_TURNS = 15, 2
SHORTER = 8
"""Factor by which runs are shorter with --quick."""


def cases(quick: bool) -> list[Case]:
    """Return a case for each scene, with all its methods in turns."""
    return [
        Case(f"cost/{name}", partial(_steps, name, quick), 1.0 if quick else 25.0)
        for name in SCENES
    ]


def _steps(name: str, quick: bool) -> Record:
    scene, timestep = SCENES[name]
    runs = {
        method: partial(run_seconds, scene=scene, method=method, timestep=timestep)
        for method in stepping_methods(name)
    }
    long = {m: LONG[m.split("/", maxsplit=1)[0]] // (SHORTER if quick else 1) for m in runs}
    costs = seconds_a_step(runs, long, QUICK_TURNS if quick else TURNS)
    return {"scene": name, "seconds_a_step": costs}
