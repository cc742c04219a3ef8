"""Timing of MuJoCo's steps."""

from contextlib import ExitStack
from functools import partial

import mujoco

import magmotor as mm
from benchmarks.harness.records import Record
from benchmarks.harness.timing import compare, seconds_of
from magmotor.mjcf.hooks import without_stopwatch

TIMESTEP = 0.025
STEPS = 2000
WARM_UP = 100


class Stepper:
    """Times `mj_step(model, data, nstep=2000)`, always from the same moving state.

    That state is the model's after 100 magnetized steps, or another stepper's. Without magnetism,
    no force takes its place.
    """

    def __init__(
        self, model: mujoco.MjModel, start: "Stepper | None" = None, timestep: float = TIMESTEP
    ):
        self.model = model
        self.model.opt.timestep = timestep
        self.data = mujoco.MjData(model)
        if start is None:
            if model.nkey:
                mujoco.mj_resetDataKeyframe(model, self.data, 0)
            with mm.magnetism():
                mujoco.mj_step(model, self.data, nstep=WARM_UP)
            start = self
        self.start = {name: getattr(start.data, name).copy() for name in ("qpos", "qvel")}

    def seconds(self, *, magnetic: bool, stopwatch_runs: bool = False) -> float:
        """Return the seconds per step."""
        for name, value in self.start.items():
            getattr(self.data, name)[:] = value
        self.data.xfrc_applied[:] = 0.0
        with ExitStack() as stack:
            if not stopwatch_runs:
                stack.enter_context(without_stopwatch())
            if magnetic:
                stack.enter_context(mm.magnetism())
            step = partial(mujoco.mj_step, self.model, self.data, nstep=STEPS)
            return seconds_of(step) / STEPS


def cost(model: mujoco.MjModel, baseline: mujoco.MjModel, turns: int) -> Record:
    """Measure a step of 2 ms by Euler with magnetism; see `compare`."""
    own, other = (
        partial(Stepper(m, timestep=0.002).seconds, magnetic=True) for m in (model, baseline)
    )
    return compare(own, other, turns)
