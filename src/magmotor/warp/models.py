"""`put_model`: a model of MuJoCo Warp with magnets, and what cannot be such a model."""

import copy
import ctypes
import math
from collections.abc import Iterator
from typing import Any

import mujoco
import mujoco_warp
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.mjcf import declared, layout
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations import table
from magmotor.mjcf.declarations.marks import CONDUCTORS, HYSTERESIS, IRON, SHAPES
from magmotor.mjcf.lookup import disabled, foreign_plugins, label
from magmotor.noise import BrownianPath
from magmotor.warp.magnets import Magnets

IN_C = "step the model with mujoco.mj_step"

MEANINGLESS = mujoco.mjtDisableBit.mjDSBL_MIDPHASE | mujoco.mjtDisableBit.mjDSBL_AUTORESET
"""Flags that MuJoCo Warp refuses, though it has nothing that they disable."""

DAMPERS = (
    "dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly", "actuator_damping",
    "actuator_dampingpoly", "ngravcomp", "flg_adhesion", "nflex",
)  # fmt: skip
"""What MuJoCo Warp skips while springs and dampers are disabled, besides springs."""


@checked(finite=False)
def put_model(model: mujoco.MjModel, path: BrownianPath | None = None, **options: Any) -> Any:
    """Create a model of MuJoCo Warp on which the magnets, noise and potentials of a model act.

    It takes the place of `mujoco_warp.put_model`. What acts is what `magmotor.magnetism` describes,
    whether the model has the plugin or only a mark; iron may be a plane only, and there are no
    magnets by their geom, no conductors and no hysteresis. All numbers are read here, once. Those
    in `m.magmotor` may be changed afterwards, also for each world (see `Magnets`).

    Parameters
    ----------
    model : mujoco.MjModel
        It is left as it is.
    path : BrownianPath, optional
        That of the noise; by default that of seed 0. World w is its replica w. The numbers in
        `userdata`, which select it in C, are not read, since they are in single precision here.
    **options
        Further arguments of `mujoco_warp.put_model`.

    Returns
    -------
    mujoco_warp.Model
        Its `callback.passive`, and `callback.sensor` if there are magnetometers, belong to its
        attribute `magmotor`, an instance of `Magnets`.

    Raises
    ------
    ValueError
        Nothing acts on the model, what acts is invalid or not supported, or the model has flags
        with which nothing would act.

    Notes
    -----
    Nothing is raised while worlds step. Where MuJoCo in C would report an error, such as dipoles
    that coincide, or one outside the table of a field or below the plane of iron, the forces of
    this world are NaN, and the other worlds go on.

    MuJoCo Warp runs control callbacks after passive forces, so that coils follow such a control in
    the next step.
    """
    kinds = acting_forces(model)
    for refused in _refusals(model, kinds):
        raise InputError(f"magmotor.warp {refused}")
    if path and not math.isclose(path.timestep, timestep := model.opt.timestep):
        sentence = f"must be {timestep:g} s, that of the model"
        raise ArgumentError("timestep of path", path.timestep, sentence)
    magnets = Magnets(model, kinds, path or BrownianPath(0, model.opt.timestep))
    if not magnets.acts:
        raise InputError(
            "nothing of magmotor acts on the model: use mujoco_warp.put_model, or see what"
            " magmotor.describe(model) says"
        )
    m = mujoco_warp.put_model(_prepared(model), **options)
    m.magmotor = magnets
    m.callback.passive = magnets.add_forces
    if magnets.measures:
        m.callback.sensor = magnets.measure
    return m


def _refusals(model: mujoco.MjModel, kinds: int) -> Iterator[str]:
    """Yield what is not supported."""
    if kinds & IRON:
        for row in declared.rows(model, table.PIECES):
            yield f"has no iron but planes, which {label(model, 'geom', row.geom)} is not: {IN_C}"
    if kinds & SHAPES:
        for geom in declared.polarizations(model):
            yield (
                f"has no magnets by their geom, such as {label(model, 'geom', geom)}: {IN_C}, or"
                " let sites be dipoles, as those of magmotor.magnet"
            )
    if kinds & CONDUCTORS:
        for geom in declared.conductors(model):
            yield f"has no conductors, such as {label(model, 'geom', geom)}: {IN_C}"
    if kinds & HYSTERESIS:
        for site in declared.hysteresis(model):
            yield f"has no hysteresis, as that of {label(model, 'site', site)}: {IN_C}"
    if foreign_plugins(model):
        yield f"supports no plugins but its own: {IN_C}"
    if _skips_hook(model) and _damps(model):
        yield (
            "needs the flag spring or damper: MuJoCo Warp computes no passive forces, among which"
            " are those of magmotor, while both are disabled"
        )
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        yield f"does not wake bodies that sleep: do not enable the flag sleep, or {IN_C}"


def _skips_hook(model: mujoco.MjModel) -> bool:
    """Whether MuJoCo Warp would not call the hook of passive forces."""
    return disabled(model, "spring") and disabled(model, "damper")


def _damps(model: mujoco.MjModel) -> bool:
    """Whether a model has anything on which the flag damper has an effect."""
    numbers = [getattr(model, name, 0.0) for name in DAMPERS]
    return any(np.any(each) for each in (*numbers, model.opt.density, model.opt.viscosity))


def _prepared(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy without what MuJoCo Warp does not take.

    Magnetometers become sensors whose data a callback writes.
    """
    prepared = copy.copy(model)
    sensors = declared.rows(model, table.MAGNETOMETERS).sensor
    prepared.sensor_type[sensors] = mujoco.mjtSensor.mjSENS_USER
    prepared.sensor_plugin[:] = -1
    # MuJoCo Warp keeps this number, but drops the instances, and then compares both.
    plugins = ctypes.c_int64.from_address(prepared._address + layout.current().nplugin)
    plugins.value = 0
    prepared.opt.disableflags &= ~int(MEANINGLESS)
    if _skips_hook(model):  # and damps nothing, so that the flag means nothing else
        prepared.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
    return prepared
