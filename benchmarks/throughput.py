"""What `simulate` adds to MuJoCo's steps."""

import time
from collections.abc import Callable
from functools import partial

from stepping import TIMESTEP, Stepper
from table import Row, in_turns, show

import magmotor as mm

SCENE = mm.Top()
SHORT, LONG = 20_000, 60_000
INTERVALS = (1, 10)
NOTE = f"""\
A step's share of `simulate`, from the difference of {SHORT} and {LONG} steps, against a magnetised
  step inside one mj_step, the stopwatch off. The engine yields states; `simulate` also checks them,
  adds observables and makes the dataset. "Once": what `simulate` costs besides, whatever the length."""


def main() -> None:
    cases: dict[str, Callable[[], float]] = {
        "step": partial(Stepper(mm.build(SCENE)).seconds, magnetic=True)
    }
    for interval in INTERVALS:
        for steps in (SHORT, LONG):
            cases[f"simulate {interval} {steps}"] = partial(_simulate, interval, steps)
    times = in_turns(cases, turns=8)
    rows = []
    for interval in INTERVALS:
        pairs = zip(*(times[f"simulate {interval} {n}"] for n in (SHORT, LONG)), strict=True)
        step = [(long - short) / (LONG - SHORT) for short, long in pairs]
        rows.append(Row(f"record_interval={interval}", step, times["step"], at_most=1.3))
    show("simulate, a step", NOTE, ("simulate", "mj_step", "ratio"), rows)


def _simulate(interval: int, steps: int) -> float:
    begin = time.perf_counter()
    mm.simulate(
        SCENE,
        method="mujoco/euler",
        timestep=TIMESTEP,
        duration=TIMESTEP * steps,
        record_interval=interval,
    )
    return time.perf_counter() - begin
