"""Cost that `simulate` adds to MuJoCo's steps."""

from functools import partial

import magmotor as mm
from benchmarks.harness.stepping import TIMESTEP, Stepper
from benchmarks.harness.tables import Row, seconds, show
from benchmarks.harness.timing import in_turns, seconds_of

SCENE = mm.Top()
STEPS = 100_000
INTERVALS = (1, 10)
AT_MOST = 1.3


def main() -> None:
    once = min(in_turns({"one step": partial(_simulate, 1, 1)}, turns=8)["one step"])
    cases = {interval: partial(_simulate, interval, STEPS) for interval in INTERVALS}
    cases[0] = partial(Stepper(mm.build(SCENE)).seconds, magnetic=True)
    times = in_turns(cases, turns=8)
    rows = [
        Row(f"record_interval={n}", [(t - once) / STEPS for t in times[n]], times[0], AT_MOST)
        for n in INTERVALS
    ]
    note = f"""\
A step's share of {STEPS} steps of the planar top, against a magnetized step inside one mj_step with
  the timers off. In addition, each call of simulate takes {seconds(once)} once, mostly to build."""
    show("simulate", note, ("simulate", "mj_step", "ratio"), rows)


def _simulate(interval: int, steps: int) -> float:
    return seconds_of(partial(
        mm.simulate, SCENE, method="mujoco/euler", timestep=TIMESTEP, duration=TIMESTEP * steps,
        record_interval=interval,
    ))  # fmt: skip
