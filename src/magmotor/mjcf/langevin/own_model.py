"""The copy of a model on which the compiled loop runs: without what the loop does itself."""

import copy
import ctypes
from collections.abc import Sequence

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf import layout
from magmotor.mjcf.langevin.friction import AFFINE, ON_JOINTS, Friction
from magmotor.mjcf.langevin.tree import coupling_constraints
from magmotor.mjcf.lookup import label
from magmotor.numerics.splittings import Scheme, kicks_that_evaluate

SMALLEST_INERTIA = 1e-14
"""Least inertia of a joint in kg or kg m^2; MuJoCo replaces smaller ones than 1e-15 by that."""

CODES = "ABOKRS"
"""Parts of schemes, in the order of their codes in the compiled loop."""


def copy_with(model: mujoco.MjModel, disable: Sequence[str]) -> mujoco.MjModel:
    """Return a copy of a model in which some features are disabled."""
    flags = [flag for flag in mujoco.mjtDisableBit.__members__ if flag.startswith("mjDSBL_")]
    names = tuple(flag.removeprefix("mjDSBL_").lower() for flag in flags)
    own = copy.copy(model)
    for flag in disable:
        check_choice("disable", flag, names)
        own.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    return own


def check_inertia(model: mujoco.MjModel) -> None:
    """Check that every joint moves some inertia at `qpos0`."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    for dof in np.flatnonzero(data.qLDiagInv > SMALLEST_INERTIA**-1):
        name = label(model, "joint", model.dof_jntid[dof])
        sentence = "must be positive: give its body a mass, or the joint an armature"
        raise ArgumentError(f"{name}: inertia at qpos0", 0.0, sentence)


def check_damped(model: mujoco.MjModel, friction: Friction) -> None:
    """Check that something damps, since else the noise has no power."""
    if model.nv == 0:
        raise ArgumentError("number of joints", 0, "must be at least one: nothing can move")
    if not (friction.rate or any(part.any() for part in (*friction[:4], friction.rows))):
        sentence = (
            "must damp something, or else kT is never reached: add damping to joints or viscosity"
            " to the model's options, or give a rate such as friction=1.0"
        )
        raise ArgumentError("friction", 0.0, sentence)


def couplings(model: mujoco.MjModel, friction: Friction) -> tuple[bool, list[list[int]]]:
    """Return whether dampers may couple any velocities, and those that tendons couple."""
    on_joints = np.isin(model.actuator_trntype, ON_JOINTS)[friction.actuators > 0]
    damped = np.flatnonzero(friction.tendons)
    spans = zip(model.ten_J_rowadr[damped], model.ten_J_rownnz[damped], strict=True)
    coupled = [model.ten_J_colind[start : start + count].tolist() for start, count in spans]
    full = coupling_constraints(model) or len(friction.rows) > 0 or not on_joints.all()
    return bool(full), coupled


def without_friction(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model without any friction, also of its actuators."""
    own = copy.copy(model)
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
    _remove_drag_and_servo_damping(own)
    return own


def _remove_drag_and_servo_damping(own: mujoco.MjModel) -> None:
    own.actuator_biasprm[own.actuator_biastype == AFFINE, 2] = 0
    own.opt.viscosity = own.opt.density = 0


def leave_to_us(own: mujoco.MjModel, *, mujoco_steps: bool, all_friction: bool) -> None:
    """Remove from a model what the compiled loop does itself: friction, gravity, plugins.

    If not `all_friction`, that of actuators and of the fluid remains.
    """
    own.dof_damping[:] = 0
    own.dof_dampingpoly[:] = 0
    own.tendon_damping[:] = 0
    own.tendon_dampingpoly[:] = 0
    own.actuator_damping[:] = 0
    own.actuator_dampingpoly[:] = 0
    if all_friction:
        _remove_drag_and_servo_damping(own)
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    own.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    if mujoco_steps:
        own.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    else:
        own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)


def skip_plugins(own: mujoco.MjModel) -> None:
    """Set the number of plugins to zero, which makes MuJoCo's functions skip them."""
    ctypes.c_int64.from_address(own._address + layout.current().nplugin).value = 0


def table_of(scheme: Scheme, timestep: float) -> Array:
    """Return the parts of a scheme as a table for the compiled loop."""
    kicks = any(part in "BK" for part in scheme.parts)
    at_rest = -1 if "S" in scheme.parts else 0
    evaluate = kicks_that_evaluate(scheme.parts) if kicks else [False] * len(scheme.parts)
    takers = [i for i, part in enumerate(scheme.parts) if part in "OK"]
    halves = {takers[0]: 1, takers[1]: -1} if len(takers) == 2 else {}
    return np.array(
        [
            (CODES.index(part), fraction * timestep, new if kicks else at_rest, halves.get(i, 0))
            for i, (part, fraction, new) in enumerate(
                zip(scheme.parts, scheme.fractions, evaluate, strict=True)
            )
        ],
        dtype=float,
    )
