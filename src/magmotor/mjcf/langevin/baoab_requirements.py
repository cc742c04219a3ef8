"""Checks that BAOAB can integrate a model: damping and noise must be constant linear maps.

They are if the parent of each moving body is the world or fixed to it, if its joint is at its
center of mass, and if only linear damping, noise and applied forces act on it.
"""

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import check_array, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.possible_contacts import colliding_geoms, may_touch
from magmotor.mjcf.viscous_contact import ALWAYS_IN_CONE, check_pair
from magmotor_plugin import slots

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
ROUNDING = 1e-9
"""Relative difference that is attributed to rounding."""

UNSUPPORTED = {
    "nactuator": "actuators",
    "neq": "equalities",
}
"""Counts in the model that must be zero."""

UNSUITABLE = {
    "sleep": "",
    "override": ": give solref, solimp, margin and friction to each geom or pair",
    "diagexact": ", since the forces of constraints have no potential otherwise",
    "speculative": ", since the forces of contacts depend on the velocity otherwise",
}
"""Flags that must not be enabled, the last two of which MuJoCo has since version 4, and why."""

NUMBERS = ("qpos0", "body_mass", "body_inertia", "body_pos", "body_user", "dof_damping")
"""Arrays of the model that must be finite."""

DISABLING_FLAGS = {
    "jnt_stiffness": "spring",
    "jnt_stiffnesspoly": "spring",
    "jnt_limited": "limit",
    "dof_dampingpoly": "damper",
    "dof_frictionloss": "frictionloss",
    "tendon_stiffness": "spring",
    "tendon_stiffnesspoly": "spring",
    "tendon_limited": "limit",
    "tendon_dampingpoly": "damper",
    "tendon_frictionloss": "frictionloss",
    "tendon_armature": None,
}
"""Fields of joints and tendons that must be zero, unless this flag disables them."""


def check_model(model: mujoco.MjModel) -> None:
    """Check that BAOAB can integrate a model, except for its inertia, noise and contact forces.

    `magmotor.mjcf.langevin.model` checks those when it reads them.

    Raises
    ------
    ValueError
        It cannot. The message names the body, joint or other element, and the requirement.
    """
    check_numbers(model)
    check_extensions(model, "Baoab")
    _check_options(model)
    check_zero(model, DISABLING_FLAGS)
    _check_spatial_tendons(model)
    for body in np.flatnonzero(_moving(model)):
        _check_body(model, int(body))
    _check_contacts(model)


def _moving(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which bodies move by joints, shape (nbody,)."""
    return model.body_dofnum[model.body_weldid] > 0


def check_numbers(model: mujoco.MjModel) -> None:
    """Check that the timestep is positive, and that the numbers of the model are finite."""
    check_number("timestep", model.opt.timestep, above=0)
    for field in NUMBERS:
        check_array(f"{field} of the model", getattr(model, field))
    check_array("gravity of the model", model.opt.gravity)


def check_extensions(model: mujoco.MjModel, method: str) -> None:
    """Check that there are no flexes, no plugins with forces but ours, and no unsupported flags."""
    if model.nflex:
        sentence = f"must be zero: {method} does not support them"
        raise ArgumentError("number of flexes", model.nflex, sentence)
    acting = {*model.body_plugin}
    acting |= set() if disabled(model, "actuation") else {*model.actuator_plugin}
    known = {*model.geom_plugin, *model.sensor_plugin, *model.actuator_plugin} - acting
    ours = slots.register()
    others = {i for i, slot in enumerate(model.plugin) if slot != ours} - known
    if others:
        sentence = (
            f"must be zero, except for magmotor.forces and those of geoms and sensors: {method}"
            " does not support them"
        )
        raise ArgumentError("number of plugins", len(others), sentence)
    for flag, reason in UNSUITABLE.items():
        bit = int(getattr(mujoco.mjtEnableBit, f"mjENBL_{flag.upper()}", 0))
        contacts = flag in ("override", "speculative")
        if model.opt.enableflags & bit and (may_touch(model) or not contacts):
            raise ArgumentError(f"flag {flag}", "enable", f"must be 'disable'{reason}")


def _check_options(model: mujoco.MjModel) -> None:
    """Check that there are no actuators, no equalities and no fluid."""
    for field, what in UNSUPPORTED.items():
        count = getattr(model, field)
        if count and not (field == "neq" and disabled(model, "equality")):
            raise ArgumentError(
                f"number of {what}", count, "must be zero: Baoab does not support them"
            )
    for field in ("density", "viscosity"):
        if getattr(model.opt, field):
            sentence = "must be zero: Baoab does not support fluid forces"
            raise ArgumentError(f"option {field}", getattr(model.opt, field), sentence)


def check_zero(model: mujoco.MjModel, fields: Mapping[str, str | None]) -> None:
    """Check that fields of joints and tendons are zero, unless the flag of each disables them."""
    for field, flag in fields.items():
        if flag and disabled(model, flag):
            continue
        for i, value in enumerate(getattr(model, field)):
            if not value.any():
                continue
            prefix, name = field.split("_")
            kind = "tendon" if prefix == "tendon" else "joint"
            owner = label(model, kind, model.dof_jntid[i] if prefix == "dof" else i)
            alternative = f", or disabled by the flag {flag}" if flag else ""
            raise ArgumentError(f"{owner}: {name}", value.tolist(), f"must be zero{alternative}")


def _check_spatial_tendons(model: mujoco.MjModel) -> None:
    """Check that spatial tendons, whose rows depend on the configuration, do not damp."""
    fixed = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    for i in np.flatnonzero(model.tendon_damping * ~fixed):
        sentence = "must be zero unless the tendon is a fixed one"
        raise ArgumentError(
            f"{label(model, 'tendon', i)}: damping", float(model.tendon_damping[i]), sentence
        )


def _check_body(model: mujoco.MjModel, body: int) -> None:
    """Check that a moving body is attached to the world by joints at its center of mass."""
    name, parent = label(model, "body", body), int(model.body_parentid[body])
    if model.body_weldid[parent] != 0:
        raise ArgumentError(
            f"{name}: parent", label(model, "body", parent), "must be the world or fixed to it"
        )
    joints = model.body_jntadr[body] + np.arange(model.body_jntnum[body])
    kinds = model.jnt_type[joints]
    if (kinds[:-1] != SLIDE).any():
        names = [mujoco.mjtJoint(kind).name[6:].lower() for kind in kinds]
        sentence = "must be slides, followed by at most one hinge, ball or free joint"
        raise ArgumentError(f"{name}: joints", names, sentence)
    if kinds[-1] == SLIDE:
        return
    last = joints[-1]
    dofs = model.jnt_dofadr[last] + np.arange(model.body_dofnum[body] - len(kinds) + 1)
    arm = model.jnt_pos[last] - model.body_ipos[body]
    if model.body_mass[body] * arm @ arm > ROUNDING * model.dof_M0[dofs[-3:]].min():
        sentence = f"must be at the center of mass, {model.body_ipos[body].tolist()}"
        owner = label(model, "joint", last)
        raise ArgumentError(f"{owner}: pos", model.jnt_pos[last].tolist(), sentence)
    if kinds[-1] != HINGE and model.dof_armature[dofs].any():
        sentence = "must be zero: armature does not rotate with the body"
        owner = label(model, "joint", last)
        raise ArgumentError(f"{owner}: armature", float(model.dof_armature[dofs].max()), sentence)


def _check_contacts(model: mujoco.MjModel) -> None:
    """Check that all contact pairs are viscous, and that no other geoms can collide."""
    if disabled(model, "contact"):
        return
    for pair in range(model.npair):
        if model.pair_friction[pair, 0] != ALWAYS_IN_CONE:
            sentence = f"must be {ALWAYS_IN_CONE:g}: only viscous contacts are supported"
            value = float(model.pair_friction[pair, 0])
            raise ArgumentError(f"{label(model, 'pair', pair)}: friction", value, sentence)
    for one, other in colliding_geoms(model):
        both = " and ".join(label(model, "geom", i) for i in (one, other))
        value = model.geom_contype[[one, other]].tolist()
        sentence = "contype and conaffinity must be zero: collisions are not supported"
        raise ArgumentError(f"{both}: contype", value, sentence)


def check_viscous(model: mujoco.MjModel, pair: int) -> int:
    """Check that a pair is a viscous contact of a sphere at its body's center of mass.

    Returns
    -------
    int
        The sphere's body.

    Raises
    ------
    ValueError
        It is not. The message names the geom and the requirement.
    """
    sphere = check_pair(model, pair)
    body = int(model.geom_bodyid[sphere])
    off = np.linalg.norm(model.geom_pos[sphere] - model.body_ipos[body])
    if off > ROUNDING * model.geom_size[sphere, 0]:
        sentence = f"must be at its body's center of mass, {model.body_ipos[body].tolist()}"
        name = label(model, "geom", sphere)
        raise ArgumentError(f"{name}: pos", model.geom_pos[sphere].tolist(), sentence)
    return body
