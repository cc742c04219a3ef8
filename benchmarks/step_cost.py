"""What a step costs: without compilation and set-up, on an otherwise idle machine."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import magmotor as mm

SHORT = 5_000
"""Steps of the run that shows what set-up takes."""


def run_seconds(
    steps: int, scene: Any, method: str, timestep: float, allow_unstable: bool = False
) -> float:
    """Wall time of a run that keeps its last step."""
    begin = time.perf_counter()
    mm.simulate(
        scene, method=method, timestep=timestep, duration=timestep * steps, record_interval=steps,
        allow_unstable=allow_unstable,
    )  # fmt: skip
    return time.perf_counter() - begin


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
