"""Checks that a model consists of lone bodies, as its own noise requires.

Each of them is attached to the world by itself, with its joint at its center of mass, so that
inertia, damping and noise are constant. Then they need neither a temperature nor a constraint.
"""

import mujoco
import numpy as np

from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.langevin.supported import check_all_but_contacts, check_numbers, check_zero
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.possible_contacts import possible_contacts
from magmotor.mjcf.viscous_contact import ALWAYS_IN_CONE, check_pair

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
ROUNDING = 1e-9
"""Relative difference that is attributed to rounding."""

DISABLING_FLAGS = {
    "jnt_stiffness": "spring",
    "jnt_stiffnesspoly": "spring",
    "jnt_limited": "limit",
    "tendon_stiffness": "spring",
    "tendon_stiffnesspoly": "spring",
    "tendon_limited": "limit",
}
"""Fields of joints and tendons that must be zero, unless this flag disables them."""

COUNTS = {"actuator": ("actuators", "actuation"), "eq": ("equalities", "equality")}
"""What must not be in the model, unless this flag disables it."""


def check_lone_bodies(model: mujoco.MjModel) -> None:
    """Check the bodies and forces of a model, except for its inertia, noise and friction.

    `magmotor.mjcf.langevin.lone_model` checks those when it reads them.

    Raises
    ------
    ValueError
        A body is not alone, or something else acts on it. The message names the body, joint or
        other element, and the requirement.
    """
    check_numbers(model)
    check_all_but_contacts(model)
    for field, (what, flag) in COUNTS.items():
        count = getattr(model, f"n{field}")
        if count and not disabled(model, flag):
            raise ArgumentError(f"number of {what}", count, "must be zero without kT")
    check_zero(model, DISABLING_FLAGS)
    _check_spatial_tendons(model)
    for body in np.flatnonzero(model.body_dofnum[model.body_weldid]):
        _check_body(model, int(body))
    for contact in possible_contacts(model):
        if contact.sliding_friction != ALWAYS_IN_CONE:
            sentence = "must be a viscous one (mm.ViscousContact) without kT"
            raise ArgumentError(f"contact of {contact.name}", "not viscous", sentence)


def _check_spatial_tendons(model: mujoco.MjModel) -> None:
    """Check that spatial tendons, whose rows depend on the configuration, do not damp."""
    fixed = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    for i in np.flatnonzero(model.tendon_damping * ~fixed):
        sentence = "must be zero without kT, unless the tendon is a fixed one"
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
