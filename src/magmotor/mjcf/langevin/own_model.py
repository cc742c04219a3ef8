"""The copy of a model on which the compiled loop runs: without what the loop does itself."""

import copy
import ctypes
import warnings
from collections.abc import Sequence

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice, elements, reject
from magmotor.mjcf import layout
from magmotor.mjcf.langevin.checks import colliding_geoms
from magmotor.mjcf.langevin.friction import AFFINE, ON_JOINTS, Friction
from magmotor.mjcf.langevin.tree import coupling_constraints
from magmotor.mjcf.lookup import disabled, label
from magmotor.numerics.splittings import Scheme, kicks_that_evaluate

SMALLEST_INERTIA = 1e-14
"""Least inertia of a joint in kg or kg m^2; MuJoCo replaces smaller ones than 1e-15 by that."""

FASTEST_CONSTRAINT = 0.5
"""Largest product of the timestep and of a constraint's frequency.

Several limits on one joint, and the slope of the impedance, add up to 2.5 times as much; the
contacts of one body are counted.
"""

CODES = "ABOKRS"
"""Parts of schemes, in the order of their codes in the compiled loop."""


def copy_with(model: mujoco.MjModel, disable: Sequence[str]) -> mujoco.MjModel:
    """Return a copy of a model in which some features are disabled."""
    flags = [flag for flag in mujoco.mjtDisableBit.__members__ if flag.startswith("mjDSBL_")]
    names = tuple(flag.removeprefix("mjDSBL_").lower() for flag in flags)
    own = copy.copy(model)
    for flag in elements("disable", disable, "must be a sequence of flags, such as ('contact',)"):
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
        raise reject(f"{name}: inertia at qpos0", 0.0, sentence)


def check_damped(model: mujoco.MjModel, friction: Friction) -> None:
    """Check that something damps, since else the noise has no power."""
    if model.nv == 0:
        raise reject("number of joints", 0, "must be at least one: nothing can move")
    if not (friction.rate or any(part.any() for part in (*friction[:4], friction.rows))):
        sentence = (
            "must damp something, or else kT is never reached: add damping to joints or viscosity"
            " to the model's options, or give a rate such as friction=1.0"
        )
        raise reject("friction", 0.0, sentence)


def couplings(model: mujoco.MjModel, friction: Friction) -> tuple[bool, list[list[int]]]:
    """Return whether dampers may couple any velocities, and those that tendons couple."""
    on_joints = np.isin(model.actuator_trntype, ON_JOINTS)[friction.actuators > 0]
    damped = np.flatnonzero(friction.tendons)
    spans = zip(model.ten_J_rowadr[damped], model.ten_J_rownnz[damped], strict=True)
    coupled = [model.ten_J_colind[start : start + count].tolist() for start, count in spans]
    full = coupling_constraints(model) or len(friction.rows) > 0 or not on_joints.all()
    return bool(full), coupled


def soften(own: mujoco.MjModel) -> None:
    """Make soft constraints so soft that the timestep resolves their oscillation, and warn of it.

    By the flag refsafe, MuJoCo itself does the same for its own integrators. The frequency of a
    constraint is that of its spring and of the inertia that it assumes.
    """
    # A weld has a potential only if its impedance does not depend on the residual.
    welds = own.eq_type == int(mujoco.mjtEq.mjEQ_WELD)
    own.eq_solimp[welds, 1] = own.eq_solimp[welds, 0]
    if disabled(own, "refsafe") or disabled(own, "constraint"):
        return
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    rigid = own.tendon_limited * (own.tendon_invweight0 < SMALLEST_INERTIA)
    for tendon in [] if disabled(own, "limit") else np.flatnonzero(rigid):
        sentence = "must be off, since the tendon does not move at qpos0, which makes it rigid"
        raise reject(f"{label(own, 'tendon', tendon)}: limited", True, sentence)
    contacts = _colliding(own)
    kinds = {
        "joint limits": (own.jnt_solref, own.jnt_solimp, own.jnt_limited, "limit"),
        "tendon limits": (
            own.tendon_solref_lim,
            own.tendon_solimp_lim,
            own.tendon_limited,
            "limit",
        ),
        "equalities": (own.eq_solref, own.eq_solimp, np.ones(own.neq), "equality"),
        "contacts of geoms": (own.geom_solref, own.geom_solimp, contacts, "contact"),
        "contact pairs": (own.pair_solref, own.pair_solimp, np.ones(own.npair), "contact"),
    }
    softened = []
    for kind, (solref, solimp, exists, flag) in kinds.items():
        excess = _frequencies(solref, solimp) * own.opt.timestep / FASTEST_CONSTRAINT
        if flag == "contact":
            excess *= np.sqrt(_most_contacts(own, contacts))
        stiff = (excess > 1) & (np.asarray(exists) > 0)
        if disabled(own, flag) or not stiff.any():
            continue
        standard = solref[:, 0] > 0
        solref[stiff & standard, 0] *= excess[stiff & standard]
        direct = stiff & ~standard
        solref[direct] /= np.column_stack([excess[direct] ** 2, excess[direct]])
        softened.append(f"{kind} ({stiff.sum()}, up to {excess[stiff].max():.2g} times slower)")
    if softened:
        warnings.warn(
            f"soft constraints are softened to suit the timestep {own.opt.timestep:g}:"
            f" {'; '.join(softened)}; take a shorter timestep, increase their solref, or disable"
            " the flag refsafe to keep them as they are; effective_model has the potential used",
            stacklevel=3,
        )


def _colliding(model: mujoco.MjModel) -> Array:
    """Return which geoms may have contacts, shape (ngeom,)."""
    found = np.zeros(model.ngeom)
    found[colliding_geoms(model).ravel()] = 1
    return found


def _most_contacts(model: mujoco.MjModel, colliding: Array) -> float:
    """Return how many contacts one body may have with a plane; each adds to the stiffness."""
    of_type = {int(mujoco.mjtGeom.mjGEOM_SPHERE): 1, int(mujoco.mjtGeom.mjGEOM_CAPSULE): 2}
    points = np.array([of_type.get(int(kind), 4) for kind in model.geom_type])
    moving = model.body_dofnum[model.body_weldid[model.geom_bodyid]] > 0
    contacts = np.bincount(model.geom_bodyid, points * (colliding > 0) * moving, model.nbody)
    return max(1.0, float(contacts.max(initial=1.0)))


def _frequencies(solref: Array, solimp: Array) -> Array:
    """Return the angular frequency of each constraint in rad/s; see MuJoCo's manual, Modeling."""
    width = np.clip(solimp[:, 1], 1e-4, 1 - 1e-4)
    constant, ratio = solref.T
    standard = 1 / np.maximum(width * constant * ratio, 1e-15) ** 2
    stiffness = np.where(constant > 0, standard, -constant / width**2)
    return width * np.sqrt(stiffness / (1 - width))


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
    if not mujoco_steps:
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
