"""Errors and costs of MuJoCo's methods for a scene, measured on this machine by `advise`."""

from contextlib import nullcontext
from typing import NamedTuple

import mujoco

from magmotor.advice.advise import advise
from magmotor.advice.points import MARGIN
from magmotor.advice.quantities import POSITIONS
from magmotor.common.checks import reject
from magmotor.device.device import Scene
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.magnetism import magnetism
from magmotor.run.in_mujoco import build

DURATION, BUDGET = 20.0, 30.0
"""Duration of the paths (s; for the disk, units of time), and wall time in s to measure them."""


class Measured(NamedTuple):
    """The cheapest method and timestep that reach an error; see `Recommendation`."""

    method: str
    timestep: float
    error: float
    seconds: float
    duration: float


def measured(scene: Scene, error: float, methods: tuple[str, ...]) -> Measured:
    """Measure the scene's own motion from its initial state.

    Raises
    ------
    ValueError
        No method reaches the error; the message says why.
    """
    model = build(scene, visual=False)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    with magnetism() if acting_forces(model) else nullcontext():
        found = advise(
            model, data, quantity=POSITIONS, duration=DURATION, error=error, budget=BUDGET
        )
    good = [
        point for point in found.points
        if MARGIN * (point.error + found.doubt) <= error
        and f"mujoco/{point.integrator.lower()}" in methods
    ]  # fmt: skip
    if not good:
        reason = found.reason or "only methods that this package does not use reach it"
        raise reject("error", error, f"was not reached: {reason}")
    best = min(good, key=lambda point: point.seconds)
    promised = MARGIN * (best.error + found.doubt)
    method = f"mujoco/{best.integrator.lower()}"
    return Measured(method, best.timestep, promised, best.seconds, found.horizon)
