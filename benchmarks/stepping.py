"""Timing MuJoCo's steps."""

import time
from contextlib import ExitStack

import mujoco

import magmotor as mm
from magmotor.mjcf import hooks as stopwatch

TIMESTEP = 0.025
STEPS = 2000
WARM_UP = 100


class Stepper:
    """Times `mj_step(model, data, nstep=2000)`, always from the same state, in motion.

    That state is the model's own after 100 magnetised steps from its start, or another stepper's;
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
                stack.enter_context(stopwatch.stopped())
            if magnetic:
                stack.enter_context(mm.magnetism())
            begin = time.perf_counter()
            mujoco.mj_step(self.model, self.data, nstep=STEPS)
            return (time.perf_counter() - begin) / STEPS
