"""Timing in turns, so that disturbances affect all cases equally; minimum times count."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import magmotor as mm
from benchmarks.harness.records import Record

Name = TypeVar("Name")


clock = time.perf_counter
"""The clock of all measurements."""


def seconds_of(call: Callable[[], object], count: int = 1) -> float:
    """Return the time per call, over `count` calls."""
    begin = clock()
    for _ in range(count):
        call()
    return (clock() - begin) / count


def cores_of(call: Callable[[], object]) -> float:
    """Return the number of cores that a call gets: processor time over wall time."""
    wall, processor = time.perf_counter(), time.process_time()
    call()
    return (time.process_time() - processor) / (time.perf_counter() - wall)


def in_turns(cases: Mapping[Name, Callable[[], float]], turns: int) -> dict[Name, list[float]]:
    """Return the seconds of each case, measured in turns so that disturbances affect all equally.

    Each case first runs once unmeasured, since the first run compiles.
    """
    for case in cases.values():
        case()
    times: dict[Name, list[float]] = {name: [] for name in cases}
    for _ in range(turns):
        for name, case in cases.items():
            times[name].append(case())
    return times


def compare(own: Callable[[], float], other: Callable[[], float], turns: int) -> Record:
    """Return the minimum seconds of the first function, and their ratio to the second's.

    Both are measured in turns, so that records made under different loads can be compared.
    """
    times = in_turns({"own": own, "other": other}, turns)
    return {"seconds": min(times["own"]), "ratio": min(times["own"]) / min(times["other"])}


SHORT = 5_000
"""Steps of the short run, which measures the set-up."""


def run_seconds(steps: int, scene: Any, method: str, timestep: float) -> float:
    """Return the wall time of a run that records only its last step."""
    return seconds_of(partial(
        mm.simulate, scene, method=method, timestep=timestep, duration=timestep * steps,
        record_interval=steps,
    ))  # fmt: skip


def seconds_a_step(
    runs: Mapping[str, Callable[[int], float]], long: Mapping[str, int], turns: int
) -> dict[str, float]:
    """Return the seconds per step from the difference of the fastest long and short runs.

    Parameters
    ----------
    runs : mapping of callables
        Each returns the wall time of a run of a given number of steps. They are measured in turns,
        so that the results of one call can be compared even if the machine's speed varies.
    long : mapping of int
        Steps that take at least 0.1 s, long compared with interruptions.
    turns : int
        Minimum number of turns; if a busy machine delays the short runs more than the long ones,
        turns are added until it does not.
    """
    for run in runs.values():
        run(SHORT)  # the first run compiles
    least = dict.fromkeys(((name, steps) for name in runs for steps in (SHORT, long[name])), 1e300)
    done = 0
    while done < turns or any(least[name, SHORT] >= least[name, long[name]] for name in runs):
        for name, steps in least:
            least[name, steps] = min(least[name, steps], runs[name](steps))
        done += 1
    return {
        name: (least[name, long[name]] - least[name, SHORT]) / (long[name] - SHORT) for name in runs
    }
