"""Cost of a call of `simulate` beyond its steps, for a new scene."""

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, run_seconds, seconds_of

DURATION, TURNS = 60.0, 20
CASES = {
    ("top", "variational/verlet"): (lambda new: mm.Top(friction=0.3 + new), 0.0125),
    ("top", "mujoco/rk4"): (lambda new: mm.Top(friction=0.3 + new), 0.0125),
    ("motor", "variational/baoab"): (lambda new: mm.Motor(inner_mass=6 + new), 0.005),
    ("disk", "variational/verlet"): (lambda new: mm.Disk(friction=1 + new), 0.0125),
}
"""Scenes as functions of a small number, and a timestep."""

_new = itertools.count(1)


def main() -> None:
    rows = [row for (name, method), case in CASES.items() for row in _rows(name, method, *case)]
    note = f"""\
A call of one step with a new scene, and the time of the other steps of {DURATION:g} s (for the
  disk: units of time). Below: the checks in that call, and the whole call."""
    show("The fixed cost of a call", note, ("time", "of", "ratio"), rows)


def _rows(name: str, method: str, scene: Callable[[float], Any], timestep: float) -> Iterator[Row]:
    def run(steps: int) -> float:
        return run_seconds(steps, scene(1e-6 * next(_new)), method, timestep)

    def check() -> float:
        fresh = scene(1e-6 * next(_new))
        return seconds_of(partial(fresh.device.check_run, fresh, method, timestep, None))

    cases = {"call": lambda: run(1), "long": lambda: run(int(DURATION / timestep)), "check": check}
    times = in_turns(cases, TURNS)
    while min(times["long"]) <= min(times["call"]):  # on a busy machine
        times = in_turns(cases, TURNS)
    call = min(times["call"])
    yield Row(f"{name}, {method}: a call, {DURATION:g} s", [call], [min(times["long"]) - call])
    yield Row("  checks, a call", times["check"], times["call"])
