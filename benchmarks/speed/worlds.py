"""Steps in MuJoCo Warp, with and without magnets and noise, on the default device of Warp."""

from collections.abc import Callable
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.warp import put_model

TARGETS = {("top", 1): None, ("top", 64): None, ("top", 1024): 1.15, ("motor", 1024): 1.4}
"""Target ratios by scene and number of worlds."""

STEPS, TURNS, AT_LEAST = 4, 20, 4096
"""Steps from the same states, turns, and steps of all worlds in a turn."""

STATE = ("qpos", "qvel", "qacc_warmstart")


def main() -> None:
    models = {"top": mm.build(mm.Top.paper(4)), "motor": mm.build(mm.Motor())}
    cases = {
        (name, count, acts): _case(models[name], count, acts)
        for name, count in TARGETS
        for acts in (True, False)
    }
    times = in_turns(cases, TURNS)
    rows = [
        Row(f"{name}, worlds: {count}", times[name, count, True], times[name, count, False],
            at_most=target)
        for (name, count), target in TARGETS.items()
    ]  # fmt: skip
    note = f"""\
A step of one world, as a captured graph, on {warp.get_device().name}: {STEPS} steps
  from the same random velocities, with magnets and noise (the motor has 125 pairs) and without."""
    show("MuJoCo Warp", note, ("magnets", "none", "ratio"), rows)


def _case(model: mujoco.MjModel, count: int, acts: bool) -> Callable[[], float]:
    """Return a function that measures a step of one world."""
    m: Any = put_model(model)
    m.opt.warn_overflow = 0  # one iteration is enough for the exact solution
    if not acts:
        m.callback.passive = None
    d = mujoco_warp.make_data(model, nworld=count)
    d.qvel.assign(np.random.default_rng(1).normal(0.0, 0.1, (count, model.nv)))
    mujoco_warp.step(m, d)
    with warp.ScopedCapture() as capture:
        mujoco_warp.step(m, d)
    graph: Any = capture.graph
    start = {name: warp.clone(getattr(d, name)) for name in STATE}

    def steps() -> None:
        for _ in range(STEPS):
            warp.capture_launch(graph)
        warp.synchronize()

    def measured() -> float:
        total, repeats = 0.0, max(1, AT_LEAST // (STEPS * count))
        for _ in range(repeats):
            for name, array in start.items():
                warp.copy(getattr(d, name), array)
            total += seconds_of(steps)
        return total / (repeats * STEPS * count)

    return measured
