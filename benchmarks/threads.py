"""Many tops on one thread and on two."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray
from stepping import TIMESTEP
from table import Row, in_turns, show

import magmotor as mm
from magmotor.engines.mujoco import stopwatch

TOPS, STEPS = 256, 200


def main() -> None:
    batches = {threads: _batch(threads) for threads in (1, 2)}
    cases = {n: partial(_seconds, batch, batch.bind("qpos")) for n, batch in batches.items()}
    with mm.magnetism(), stopwatch.stopped():
        times = in_turns(cases, turns=20)
        cores = max(_cores(cases[2]) for _ in range(5))
    if not np.array_equal(batches[1].state, batches[2].state):
        raise AssertionError("one thread and two led to different states")
    rows = [Row("a top's step", times[1], times[2], at_least=1.8)]
    note = f"""\
{TOPS} planar tops from as many starting points, {STEPS} magnetised steps in one call of
  mujoco.batch.Batch.step; the final states are the same to the last bit. The target is for two
  idle cores: of this machine's the two threads got {cores:.1f}."""
    show("mujoco.batch on two threads", note, ("one thread", "two", "ratio"), rows)


def _batch(threads: int) -> Batch:
    model = mm.build(mm.Top())
    model.opt.timestep = TIMESTEP
    return Batch(model, nsim=TOPS, nthread=threads)


def _cores(run: Callable[[], float]) -> float:
    wall, processor = time.perf_counter(), time.process_time()
    run()
    return (time.process_time() - processor) / (time.perf_counter() - wall)


def _seconds(batch: Batch, qpos: NDArray[np.float64]) -> float:
    batch.reset(keyframe=0)
    qpos[:, :2] = np.random.default_rng(0).uniform(-0.1, 0.1, (TOPS, 2))
    begin = time.perf_counter()
    batch.step(nstep=STEPS)
    return (time.perf_counter() - begin) / TOPS / STEPS
