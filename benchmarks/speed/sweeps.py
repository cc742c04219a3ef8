"""Cost of a sweep beyond its simulations, and the share of the cores' time that these get."""

import tempfile
import time
import tracemalloc
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

import magmotor as mm
from benchmarks.harness.tables import Row, seconds, show
from magmotor.sweep import Sweep
from magmotor.sweep.process_pool import Pool

CORES = 2
CASES, TURNS = 500, 3
"""Number of cases for measuring the overhead, and number of repetitions."""

PLANNED = 20_000
"""Number of the 1e6 cases that are planned here."""

DISK: dict[str, Any] = {
    "scene": mm.Disk(),
    "measure": ["displacement"],
    "method": "variational/baoab",
    "timestep": 0.05,
}


def main() -> None:
    with closing(Pool(1)) as pool:
        overhead = _overhead(pool)
    with mm.sweep.local_cluster(1) as address, mm.sweep.dask_workers(address) as (executor, _):
        on_cluster = _overhead(executor)
    spent, busy, case = _efficiency(cases=1000, target=0.2)
    memory, planned = _plan()
    rows = [
        Row("overhead of a case, one worker", overhead, at_most=2e-3),
        Row("  on a Dask cluster", on_cluster),
        Row("1000 cases of 0.2 s, in the simulation", [busy], [CORES * spent], at_least=0.95),
        Row("planning a case of 1e6", [planned]),
    ]
    note = f"""\
The 1000 cases took {seconds(case)} each on {CORES} workers, {spent:.0f} s in all, with the start
  of the workers. Planning uses at most {memory / 1e6:.2f} MB."""
    show("Parameter sweeps", note, ("time", "against", "ratio"), rows)


def _overhead(executor: Any) -> list[float]:
    """Return the wall time of a case beyond the time of the single, always busy worker."""
    _run(10, 5.0, 1, executor)  # the worker imports and compiles
    runs = [_run(CASES, 5.0, 1, executor) for _ in range(TURNS)]
    return [(spent - busy) / CASES for spent, busy in runs]


def _efficiency(cases: int, target: float) -> tuple[float, float, float]:
    """Return wall time, time in the simulations, and time per case, which is set to `target`."""
    sample = 2e4
    run = {name: DISK[name] for name in ("method", "timestep")}
    durations = []
    for duration in (1.0, sample, sample, sample):
        begin = time.perf_counter()
        mm.simulate(DISK["scene"], duration=duration, **run)
        durations.append(time.perf_counter() - begin)
    spent, busy = _run(cases, sample * target / min(durations[1:]), CORES)
    return spent, busy, busy / cases


def _run(cases: int, duration: float, workers: int, executor: Any = None) -> tuple[float, float]:
    """Return the wall time of a sweep, and the sum of the workers' time in simulations."""
    vary = {"noise": np.linspace(1.0, 5.0, cases)}
    sweep = Sweep(**DISK, vary=vary, duration=duration)
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        tally = mm.sweep.run(sweep, Path(folder) / "sweep", workers=workers, executor=executor)
        spent = time.perf_counter() - begin
    assert tally.done == cases
    return spent, tally.seconds


def _plan() -> tuple[int, float]:
    """Return the peak memory in bytes, and seconds per case, of planning cases of 1e6."""
    line = np.linspace(0.1, 4.0, 1000)
    tracemalloc.start()
    sweep = Sweep(**DISK, vary={"noise": line, "friction": line}, duration=1.0)
    for index in range(PLANNED):
        sweep.case(index)
    _, memory = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    begin = time.perf_counter()
    for index in range(PLANNED):
        sweep.case(index)
    return memory, (time.perf_counter() - begin) / PLANNED
