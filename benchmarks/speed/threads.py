"""Many tops or motors on one thread and on two threads."""

from functools import partial

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.harness.stepping import TIMESTEP
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import cores_of, in_turns, seconds_of
from magmotor.mjcf.hooks import without_stopwatch

COPIES, STEPS = 256, 200
SCENES = {"a top's step": mm.Top(), "a motor's step": mm.Motor()}


def main() -> None:
    batches = {
        (name, threads): _batch(scene, threads)
        for name, scene in SCENES.items()
        for threads in (1, 2)
    }
    cases = {key: partial(_seconds, batch, batch.bind("qpos")) for key, batch in batches.items()}
    with mm.magnetism(), without_stopwatch():
        times = in_turns(cases, turns=20)
        cores = max(cores_of(cases[name, 2]) for name in SCENES for _ in range(5))
    rows = []
    for name in SCENES:
        if not np.array_equal(batches[name, 1].state, batches[name, 2].state):
            raise AssertionError(f"{name}: one thread and two led to different states")
        rows.append(Row(name, times[name, 1], times[name, 2], at_least=1.8))
    note = f"""\
{COPIES} planar models from as many starting points, {STEPS} magnetized steps in one call of
  mujoco.batch.Batch.step; the final states are the same to the last bit. The target is for two
  idle cores: of this machine's the two threads got {cores:.1f}."""
    show("mujoco.batch on two threads", note, ("one thread", "two", "ratio"), rows)


def _batch(scene: mm.Top | mm.Motor, threads: int) -> Batch:
    model = mm.build(scene)
    model.opt.timestep = TIMESTEP
    return Batch(model, nsim=COPIES, nthread=threads)


def _seconds(batch: Batch, qpos: NDArray[np.float64]) -> float:
    batch.reset(keyframe=0)
    qpos[:, :2] = np.random.default_rng(0).uniform(-0.1, 0.1, (COPIES, 2))
    return seconds_of(partial(batch.step, nstep=STEPS)) / COPIES / STEPS
