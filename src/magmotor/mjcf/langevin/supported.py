"""Checks that a Langevin thermostat can integrate a tree of MuJoCo's joints.

The forces must have a potential, apart from linear friction (`magmotor.mjcf.langevin.friction`) and
what the user applies. Dry friction has no law of fluctuation and dissipation, and the forces of
some actuators depend on the configuration without being a gradient.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from magmotor.common.checks import LARGEST, check_array, check_number
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations import marks
from magmotor.mjcf.declarations.table import CONDUCTORS, MEMORIES
from magmotor.mjcf.langevin.friction import (
    AFFINE,
    ON_JOINTS,
    ON_TENDONS,
    acting_actuators,
)
from magmotor.mjcf.langevin.refusals import FLAGS
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.possible_contacts import Contact, may_touch, possible_contacts
from magmotor.mjcf.viscous_contact import ALWAYS_IN_CONE
from magmotor_plugin import slots

UNSUITABLE = {
    "sleep": "",
    "override": ": give solref, solimp, margin and friction to each geom or pair",
    "diagexact": ", since the forces of constraints have no potential otherwise",
    "speculative": ", since the forces of contacts depend on the velocity otherwise",
}
"""Flags that must not be enabled, the last two of which MuJoCo has since version 4, and why."""

DISABLING_FLAGS = {
    "dof_frictionloss": "frictionloss",
    "tendon_frictionloss": "frictionloss",
    "tendon_armature": None,
}
"""Fields of joints and tendons that must be zero, unless this flag disables them."""

PLASTIC = {"jnt_springyield": "spring", "tendon_springyield": "spring"}
"""The same for springs that yield, which MuJoCo has since version 4."""

NUMBERS = (
    *("qpos0", "body_mass", "body_inertia", "body_pos", "body_gravcomp"),
    *("dof_damping", "dof_armature", "qpos_spring"),
    *("jnt_stiffness", "tendon_stiffness", "tendon_damping"),
    *("jnt_solref", "tendon_solref_lim", "eq_solref", "geom_solref", "pair_solref"),
    *("jnt_solimp", "tendon_solimp_lim", "eq_solimp", "geom_solimp", "pair_solimp"),
)
"""Arrays of the model that must be finite."""

EQUALITIES = [
    int(getattr(mujoco.mjtEq, f"mjEQ_{kind}")) for kind in ("CONNECT", "WELD", "JOINT", "TENDON")
]

SMOOTH = {
    frozenset(pair)
    for pair in (
        *(("plane", kind) for kind in ("sphere", "capsule", "box", "cylinder")),
        *(("sphere", kind) for kind in ("sphere", "capsule", "box", "cylinder")),
        ("capsule", "capsule"),
    )
}
"""Types of geoms whose distance is the potential of their contact."""


def check_numbers(model: mujoco.MjModel) -> None:
    """Check that the timestep is positive, and that the numbers of the model are finite."""
    check_number("timestep", model.opt.timestep, above=0)
    for field in NUMBERS:
        check_array(f"{field} of the model", getattr(model, field))
    check_array("gravity of the model", model.opt.gravity)
    for body in np.flatnonzero(~(abs(model.body_user) <= LARGEST).all(axis=1)):
        check_array(f"{label(model, 'body', body)}: user", model.body_user[body])


def check_losses(model: mujoco.MjModel) -> None:
    """Check that neither eddy currents nor hysteresis brake, for which there is no noise here."""
    for word, section, loss in (
        ("conductors", CONDUCTORS, "the friction of eddy currents"),
        ("hysteresis", MEMORIES, "hysteresis"),
    ):
        acts = acting_forces(model) & marks.WORDS[word]
        for row in declared.rows(model, section) if acts else ():
            raise InputError(
                f"{label(model, 'tuple', row.tuple)}: Langevin has no noise for {loss}; leave the"
                f" word {word} out of the mark"
            )


def check_tree(model: mujoco.MjModel) -> None:
    """Check the forces of a model, except its linear friction, which `model_friction` checks.

    Raises
    ------
    ValueError
        The model has dry friction or another force that is neither linear friction nor of a
        potential. The message names the element and what to do.
    """
    check_all_but_contacts(model)
    for contact in possible_contacts(model):
        _check_contact(model, contact)


def check_all_but_contacts(model: mujoco.MjModel) -> None:
    """Check the forces of a model like `check_tree`, except those of contacts."""
    _check_extensions(model)
    check_zero(model, DISABLING_FLAGS)
    check_zero(model, {field: flag for field, flag in PLASTIC.items() if hasattr(model, field)})
    _check_armature(model)
    _check_compensation(model)
    _check_equalities(model)
    _check_actuators(model)


def _check_extensions(model: mujoco.MjModel) -> None:
    """Check that there are no flexes, no plugins with forces but ours, and no unsupported flags."""
    if model.nflex:
        sentence = "must be zero: Langevin does not support them"
        raise ArgumentError("number of flexes", model.nflex, sentence)
    acting = {*model.body_plugin}
    acting |= set() if disabled(model, "actuation") else {*model.actuator_plugin}
    known = {*model.geom_plugin, *model.sensor_plugin, *model.actuator_plugin} - acting
    ours = slots.register()
    others = {i for i, slot in enumerate(model.plugin) if slot != ours} - known
    if others:
        sentence = (
            "must be zero, except for magmotor.forces and those of geoms and sensors: Langevin"
            " does not support them"
        )
        raise ArgumentError("number of plugins", len(others), sentence)
    for flag, reason in UNSUITABLE.items():
        bit = int(getattr(mujoco.mjtEnableBit, f"mjENBL_{flag.upper()}", 0))
        contacts = flag in ("override", "speculative")
        if model.opt.enableflags & bit and (may_touch(model) or not contacts):
            raise ArgumentError(f"flag {flag}", "enable", f"must be 'disable'{reason}")


def check_zero(model: mujoco.MjModel, fields: Mapping[str, str | None]) -> None:
    """Check that fields of joints and tendons are zero, unless the flag of each disables them.

    The message names no flag of `FLAGS`, since `refusal_with_remedies` adds those that help.
    """
    for field, flag in fields.items():
        if flag and disabled(model, flag):
            continue
        for i, value in enumerate(getattr(model, field)):
            if not value.any():
                continue
            prefix, name = field.split("_")
            kind = "tendon" if prefix == "tendon" else "joint"
            owner = label(model, kind, model.dof_jntid[i] if prefix == "dof" else i)
            off = "False" if value.dtype == bool else "zero"
            alternative = "" if flag in (None, *FLAGS) else f", or disabled by the flag {flag}"
            raise ArgumentError(f"{owner}: {name}", value.tolist(), f"must be {off}{alternative}")


def _check_armature(model: mujoco.MjModel) -> None:
    """Check that armature is of joints only, and of ball and free joints the same about any axis.

    MuJoCo has no gyroscopic torque of armature; it is zero if all three are equal.
    """
    for joint in np.flatnonzero(model.jnt_type <= int(mujoco.mjtJoint.mjJNT_BALL)):
        last = model.jnt_dofadr[joint] + (6 if model.jnt_type[joint] == 0 else 3)
        armature = model.dof_armature[last - 3 : last]
        if (armature != armature[0]).any():
            sentence = "must be the same about all three axes"
            raise ArgumentError(
                f"{label(model, 'joint', joint)}: armature", armature.tolist(), sentence
            )
    on_tendons = np.isin(model.actuator_trntype, ON_TENDONS)
    for i in np.flatnonzero(model.actuator_armature * on_tendons):
        sentence = "must be zero on a tendon: Langevin does not support it"
        raise ArgumentError(
            f"{label(model, 'actuator', i)}: armature", model.actuator_armature[i], sentence
        )


def _check_compensation(model: mujoco.MjModel) -> None:
    """Check that no actuator compensates gravity, which its limits would cut off."""
    for joint in np.flatnonzero(model.jnt_actgravcomp * model.body_gravcomp.any()):
        sentence = "must be false: let the body's gravcomp act without actuators"
        raise ArgumentError(f"{label(model, 'joint', joint)}: actuatorgravcomp", True, sentence)


def _check_equalities(model: mujoco.MjModel) -> None:
    """Check that equalities are welds, connects, or of joints or tendons."""
    if disabled(model, "equality"):
        return
    for i in np.flatnonzero(~np.isin(model.eq_type, EQUALITIES)):
        kind = mujoco.mjtEq(model.eq_type[i]).name[5:].lower()
        sentence = "must be connect, weld, joint or tendon"
        raise ArgumentError(f"{label(model, 'equality', i)}: type", kind, sentence)


def _check_actuators(model: mujoco.MjModel) -> None:
    """Check that the forces of actuators by position are gradients of a potential."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    for i in acting_actuators(model):
        name, kind = label(model, "actuator", i), int(model.actuator_trntype[i])
        if kind == int(mujoco.mjtTrn.mjTRN_BODY):
            sentence = "must not be a body, since adhesion has no potential"
            raise ArgumentError(f"{name}: transmission", "body", sentence)
        rotates = kind == int(mujoco.mjtTrn.mjTRN_SITE) or (
            kind in ON_JOINTS
            and model.jnt_type[model.actuator_trnid[i, 0]] <= int(mujoco.mjtJoint.mjJNT_BALL)
        )
        biased = model.actuator_biastype[i] == AFFINE and model.actuator_biasprm[i, :2].any()
        scaled = model.actuator_gaintype[i] == AFFINE and model.actuator_gainprm[i, 1]
        if rotates and (biased or scaled):
            sentence = (
                "must act on a hinge, a slide, a tendon or a slider-crank, since its force depends"
                " on the position and has no potential otherwise"
            )
            raise ArgumentError(
                f"{name}: transmission", mujoco.mjtTrn(kind).name[6:].lower(), sentence
            )
        if kind not in ON_JOINTS:
            _check_joint_limits(model, data, i)


def _check_joint_limits(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> None:
    """Check that no joint limits the force of an actuator that acts on several coordinates."""
    for output in model.actuator_outadr[actuator] + np.arange(model.actuator_outnum[actuator]):
        start = data.moment_rowadr[output]
        dofs = data.moment_colind[start : start + data.moment_rownnz[output]]
        for joint in model.dof_jntid[dofs]:
            if model.jnt_actfrclimited[joint]:
                sentence = (
                    f"must be without limits, since {label(model, 'actuator', actuator)} acts on"
                    " several joints, and its force has no potential where one of them limits it"
                )
                value = model.jnt_actfrcrange[joint].tolist()
                raise ArgumentError(f"{label(model, 'joint', joint)}: actfrcrange", value, sentence)


def _check_contact(model: mujoco.MjModel, contact: Contact) -> None:
    """Check that the force of a contact has a potential."""
    if contact.sliding_friction == ALWAYS_IN_CONE:
        sentence = (
            "viscous contacts are for bodies that hang on the world one by one, with the noise of"
            " the model: use mm.Langevin(model) without kT"
        )
        raise ArgumentError(f"{contact.name}: friction", contact.sliding_friction, sentence)
    kinds = [mujoco.mjtGeom(model.geom_type[i]).name[7:].lower() for i in contact.geoms]
    if frozenset(kinds) not in SMOOTH:
        both = " and ".join(label(model, "geom", geom) for geom in contact.geoms)
        sentence = (
            "their contact points jump, so that the force has no potential: use spheres or"
            " capsules, or boxes and cylinders on planes"
        )
        raise ArgumentError(f"{both}: types", " and ".join(kinds), sentence)
    if contact.dimension > 1:
        sentence = "must be 1, for contacts without friction: dry friction has no temperature"
        raise ArgumentError(f"{contact.name}: condim", contact.dimension, sentence)
    if any(contact.adhesion):
        sentence = "must be zero, since it has no potential"
        raise ArgumentError(f"{contact.name}: adhesion", contact.adhesion, sentence)
