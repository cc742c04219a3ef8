"""Timing: in turns, so that what disturbs the machine hits all alike; least times count."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import magmotor as mm
from benchmarks.harness.records import Record

Name = TypeVar("Name")


def seconds_of(call: Callable[[], object], count: int = 1) -> float:
    """Wall time of a call, of so many one after another."""
    begin = time.perf_counter()
    for _ in range(count):
        call()
    return (time.perf_counter() - begin) / count


def cores_of(call: Callable[[], object]) -> float:
    """How many cores a call gets, by the processor's time over the wall's."""
    wall, processor = time.perf_counter(), time.process_time()
    call()
    return (time.process_time() - processor) / (time.perf_counter() - wall)


def in_turns(cases: Mapping[Name, Callable[[], float]], turns: int) -> dict[Name, list[float]]:
    """Seconds that each case returns, in turns, so that a disturbance hits all alike.

    Before, each runs once unmeasured, as the first run compiles.
    """
    for case in cases.values():
        case()
    times: dict[Name, list[float]] = {name: [] for name in cases}
    for _ in range(turns):
        for name, case in cases.items():
            times[name].append(case())
    return times


def beside(own: Callable[[], float], other: Callable[[], float], turns: int) -> Record:
    """Seconds that the first returns, at the least, and how many times the second's they are.

    Measured in turns, so that records made under different loads can be compared.
    """
    times = in_turns({"own": own, "other": other}, turns)
    return {"seconds": min(times["own"]), "ratio": min(times["own"]) / min(times["other"])}


SHORT = 5_000
"""Steps of the run that shows what set-up takes."""


def run_seconds(steps: int, scene: Any, method: str, timestep: float) -> float:
    """Wall time of a run that keeps its last step."""
    return seconds_of(partial(
        mm.simulate, scene, method=method, timestep=timestep, duration=timestep * steps,
        record_interval=steps,
    ))  # fmt: skip


def seconds_a_step(
    runs: Mapping[str, Callable[[int], float]], long: Mapping[str, int], turns: int
) -> dict[str, float]:
    """Return the difference of a long and a short run of each, least over turns, by step.

    Parameters
    ----------
    runs : mapping of callables
        Each returns the wall time of a run of so many steps. They are measured in turns, so that
        those of one call can be compared, however fast the machine is meanwhile.
    long : mapping of int
        Steps that take 0.1 s and more, against which interruptions are short.
    turns : int
        As often at least: where a busy machine delays the short runs more than the long ones, until
        it does not.
    """
    for run in runs.values():
        run(SHORT)  # the first one compiles
    least = dict.fromkeys(((name, steps) for name in runs for steps in (SHORT, long[name])), 1e300)
    done = 0
    while done < turns or any(least[name, SHORT] >= least[name, long[name]] for name in runs):
        for name, steps in least:
            least[name, steps] = min(least[name, steps], runs[name](steps))
        done += 1
    return {
        name: (least[name, long[name]] - least[name, SHORT]) / (long[name] - SHORT) for name in runs
    }
