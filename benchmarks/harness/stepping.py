"""Timing MuJoCo's steps."""

from contextlib import ExitStack
from functools import partial

import mujoco

import magmotor as mm
from benchmarks.harness.records import Record
from benchmarks.harness.timing import beside, seconds_of
from magmotor.mjcf.hooks import without_stopwatch

TIMESTEP = 0.025
STEPS = 2000
WARM_UP = 100


class Stepper:
    """Times `mj_step(model, data, nstep=2000)`, always from the same state, in motion.

    That state is the model's own after 100 magnetized steps from its start, or another stepper's;
    its `xfrc_applied` stays, as a constant wrench, where magnetism is off.
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
        self.start = {
            name: getattr(start.data, name).copy() for name in ("qpos", "qvel", "xfrc_applied")
        }

    def seconds(self, *, magnetic: bool, stopwatch_runs: bool = False) -> float:
        """Seconds a step."""
        for name, value in self.start.items():
            getattr(self.data, name)[:] = value
        with ExitStack() as stack:
            if not stopwatch_runs:
                stack.enter_context(without_stopwatch())
            if magnetic:
                stack.enter_context(mm.magnetism())
            step = partial(mujoco.mj_step, self.model, self.data, nstep=STEPS)
            return seconds_of(step) / STEPS


def cost(model: mujoco.MjModel, baseline: mujoco.MjModel, turns: int) -> Record:
    """Of a step of 2 ms by Euler with magnetism; see `beside`."""
    own, other = (
        partial(Stepper(m, timestep=0.002).seconds, magnetic=True) for m in (model, baseline)
    )
    return beside(own, other, turns)
