"""Errors and costs of MuJoCo's methods for a scene, measured on this machine by `advise`."""

from contextlib import nullcontext

import mujoco

from magmotor.advice.advise import survey
from magmotor.advice.measured_quantities import POSITIONS
from magmotor.advice.paths import INTEGRATORS
from magmotor.advice.recommendation import Recommendation
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.magnetism import magnetism
from magmotor.run.in_mujoco import build

DURATION, BUDGET = 20.0, 30.0
"""Duration of the paths (s; for the disk, units of time), and wall time in s to measure them."""


def measured(scene: Scene, error: float, methods: tuple[str, ...]) -> Recommendation:
    """Measure the scene's own motion from its initial state.

    Raises
    ------
    ValueError
        No method reaches the error; the message says why.
    """
    names = {f"mujoco/{name.lower()}": name for name in INTEGRATORS}
    among = {names[method]: method for method in methods if method in names}
    if not among:
        raise ArgumentError("method", ", ".join(methods), f"must be one of {', '.join(names)}")
    model = build(scene, visual=False)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    with magnetism() if acting_forces(model) else nullcontext():
        found = survey(
            model, data, quantity=POSITIONS, duration=DURATION, error=error, budget=BUDGET,
            among=among, tune=False,
        )  # fmt: skip
    if not found.method:
        raise ArgumentError("error", error, f"was not reached: {found.reason}")
    return Recommendation(
        quantity=found.quantity, error=error, method=among[found.method], timestep=found.timestep,
        promised=found.promised, seconds=found.seconds, horizon=found.horizon, basis=found.basis,
        uncharted=scene.device.uncharted(scene), time_unit=scene.device.time_unit,
    )  # fmt: skip
