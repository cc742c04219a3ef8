"""What a sweep will cost, measured before it runs: its wall time and its size on disk."""

import io
import math
import os
import time
import warnings
from contextlib import redirect_stderr
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.exceptions import InputError
from magmotor.common.hints import Count, integer
from magmotor.common.integrity import with_checksum
from magmotor.device.provenance import scene_from
from magmotor.device.stops import SimulationStopped
from magmotor.run.simulate import check_memory, simulate
from magmotor.sweep.compute import ARGUMENTS
from magmotor.sweep.definition import Sweep
from magmotor.sweep.measures import TRAJECTORY

LONG_ENOUGH = 0.3
"""Wall time in s that a probe must take to be extrapolated."""

FIRST_STEPS = 16
"""Steps of the first run of a probe, which also compiles; its time counts as the set-up's."""


@dataclass(frozen=True)
class Estimate:
    """What a sweep will cost on this machine.

    Attributes
    ----------
    seconds : float
        Wall time of all cases in s, without the start of the workers.
    seconds_per_case : float
        Mean wall time of a case on one core, in s.
    workers : int
        Number of processes.
    size : float
        Bytes of all files.
    probed : int
        Number of cases that were run for a short time, from whose steps the times follow.
    """

    seconds: float
    seconds_per_case: float
    workers: int
    size: float
    probed: int


@checked
def estimate(
    sweep: Sweep, *, workers: Count | None = None, probes: Annotated[int, integer(at_least=1)] = 3
) -> Estimate:
    """Estimate the cost of a sweep from short runs of a few of its cases; writes nothing.

    The cases are spread evenly over the sweep. Measures are not computed, and runs that end early
    count in full.

    Parameters
    ----------
    sweep : Sweep
    workers : int, optional
        Number of processes; by default one per core.
    probes : int
        Number of cases to probe, each for a second or two.

    Returns
    -------
    Estimate

    Raises
    ------
    ValueError
        None of these cases can run; the message is that of the last one.
    """
    workers = workers or os.cpu_count() or 1
    chosen = sorted({*np.linspace(0, len(sweep) - 1, probes).round().astype(int).tolist()})
    found, failure = [], None
    for index in chosen:
        try:
            found.append(_probe(sweep, index))
        except (ValueError, SimulationStopped) as error:
            failure = error
    if not found:
        raise InputError(f"none of the probed cases can run: {failure}")
    seconds, size = np.mean(found, axis=0).tolist()
    rounds = math.ceil(len(sweep) / workers)
    return Estimate(seconds * rounds, seconds, workers, size * len(sweep), len(found))


def _probe(sweep: Sweep, index: int) -> tuple[float, float]:
    """Return the seconds and bytes of a case, extrapolated from a part of it."""
    spec = sweep.case(index).spec
    scene = scene_from(spec["scene"], spec["scene_fields"])
    arguments = {name: spec[name] for name in ARGUMENTS}
    every = spec["record_interval"]
    last = max(1, round(spec["duration"] / spec["timestep"]))

    def run(steps: int):
        duration = steps * spec["timestep"]
        with redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            began = time.perf_counter()
            records = simulate(scene, **arguments | {"duration": duration})
        return time.perf_counter() - began, records

    few = min(last, every * math.ceil(FIRST_STEPS / every))
    run(few)
    set_up, records = run(few)
    steps, taken = few, set_up
    while steps < last and taken < LONG_ENOUGH:
        steps = min(last, 4 * steps)
        taken, records = run(steps)
    recorded = records.nbytes * last / steps
    check_memory(recorded, every)
    per_step = max(0.0, taken - set_up) / max(1, steps - few)
    return set_up + (last - few) * per_step, _size(sweep, spec, recorded)


def _size(sweep: Sweep, spec: dict, recorded: float) -> float:
    """Return the bytes of a case's file, and of its part of the combined dataset."""
    if sweep.measure == (TRAJECTORY,):
        return 2 * recorded
    number = math.pi if sweep.replicas is None else [math.pi] * sweep.replicas
    values = dict.fromkeys(map(str, sweep.measure), number)
    content = with_checksum({"case": spec, "values": values, "warnings": []})
    return len(content) + 8.0 * len(values) * (sweep.replicas or 1)
