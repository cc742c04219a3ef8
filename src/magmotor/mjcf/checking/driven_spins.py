"""How fast actuators can turn rotors, and turning magnets or fields those that follow them."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.strengths import Magnet, largest_drive, magnets_of
from magmotor.mjcf.forces.marks import COILS, FIELDS
from magmotor.mjcf.lookup import control_of, disabled, label

HINGE, FREE, BALL = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{name}")) for name in ("HINGE", "FREE", "BALL")
)
TURNING = [
    int(getattr(mujoco.mjtTrn, f"mjTRN_{name}")) for name in ("JOINT", "JOINTINPARENT", "SITE")
]
"""How actuators act whose torque on a rotor does not change as it turns."""

ACROSS = 0.1
"""Part of a moment across the axis of its turns from which other magnets may follow it."""


def driven_velocities(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[tuple[str, Array]]:
    """Yield why something may turn, and velocities with what actuators or other magnets turn."""
    torques, damping = _torques(model, state)
    speeds = np.divide(torques, damping, out=np.zeros(model.nv), where=damping > 0)
    driven = np.where(speeds != 0, speeds, state.qvel)
    if speeds.any():
        yield " as its actuators can turn it", driven.copy()
    if not driven.any():
        return
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = state.qpos, driven
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_comVel(model, data)
    turned = {*model.dof_bodyid[speeds != 0].tolist()}
    turns = max(_turns(model, data, turned), key=np.linalg.norm, default=np.zeros(3))
    for magnet in magnets_of(model, data) if turns.any() else ():
        if _follows(model, magnet) and magnet.body not in turned:
            end = model.dof_bodyid.searchsorted(magnet.body) + int(model.body_dofnum[magnet.body])
            driven[end - 3 : end] = turns @ data.xmat[magnet.body].reshape(3, 3)
    if turns.any():
        yield " as it follows a magnet or a field that turns", driven


def unknown_spins(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[str]:
    """Yield what can turn bodies at a speed that the model does not tell."""
    magnets, (torques, damping) = magnets_of(model, state), _torques(model, state)
    trees = model.body_treeid[[magnet.body for magnet in magnets]]
    undamped = model.dof_bodyid[(torques > 0) & (damping <= 0) & np.isin(model.dof_treeid, trees)]
    for body in dict.fromkeys(undamped.tolist()):
        yield f"of {label(model, 'body', body)}, which actuators turn and nothing damps,"
    kinds, turners = acting_forces(model), set()
    for word, bit in (("field", FIELDS), ("coil", COILS)):
        for _, elements in declared.tuples(model, word) if kinds & bit else ():
            turners |= {number for kind, number, _ in elements if kind == declared.ACTUATOR}
    if len(turners) > 1 and any(_follows(model, each) for each in magnets):
        names = " and ".join(label(model, "actuator", number) for number in sorted(turners)[:2])
        yield f"of magnets in the fields of {names}"


def _follows(model: mujoco.MjModel, magnet: Magnet) -> bool:
    """Return whether a magnet can turn about all axes, so that it follows a field."""
    joint = int(model.body_jntadr[magnet.body])
    return bool(magnet.strengths.any() and joint >= 0 and model.jnt_type[joint] in (FREE, BALL))


def _torques(model: mujoco.MjModel, state: mujoco.MjData) -> tuple[Array, Array]:
    """Return the largest torques of actuators on rotors, 0 elsewhere, and all dofs' damping.

    A rotor is a body on which no other joint hangs, and which turns without limits.
    """
    torques, damping, rotors = np.zeros(model.nv), model.dof_damping.copy(), _rotors(model)
    own = getattr(model, "actuator_damping", np.zeros(model.nu))
    acts = np.isin(model.actuator_trntype, TURNING)
    acts &= model.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED)
    moments = np.zeros((len(acts), model.nv))
    if len(acts):
        mujoco.mju_sparse2dense(
            moments, state.actuator_moment, state.moment_rownnz, state.moment_rowadr,
            state.moment_colind,
        )  # fmt: skip
    for actuator in np.flatnonzero(acts & (not disabled(model, "actuation"))).tolist():
        constant, position, velocity = model.actuator_biasprm[actuator, :3].tolist()
        moment = np.where(rotors, moments[actuator], 0)
        if position or not moment.any():
            continue
        largest = largest_drive(model, actuator)
        if largest == math.inf:
            control = control_of(model, actuator)
            given = np.append(model.key_ctrl[:, control], state.ctrl[control])
            largest = abs(given).max()
        force = abs(model.actuator_gainprm[actuator, 0]) * largest + abs(constant)
        if model.actuator_forcelimited[actuator]:
            force = min(force, abs(model.actuator_forcerange[actuator]).max())
        torques += abs(moment) * force
        damping -= moment**2 * velocity
        if own[actuator]:  # on joints only; MuJoCo takes one gear for all axes of a ball joint
            damped = model.dof_jntid == model.actuator_trnid[actuator, 0]
            damping += np.where(damped, model.actuator_gear[actuator, 0] ** 2 * own[actuator], 0)
    return torques, damping


def _rotors(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which degrees of freedom are turns of rotors."""
    rotors = np.zeros(model.nv, bool)
    for joint, kind in enumerate(model.jnt_type.tolist()):
        first = int(model.jnt_dofadr[joint])
        end = first + {HINGE: 1, BALL: 3, FREE: 6}.get(kind, 0)
        if end > first and not model.jnt_limited[joint] and end - 1 not in model.dof_parentid:
            rotors[max(first, end - 3) : end] = True
    return rotors


def _turns(model: mujoco.MjModel, data: mujoco.MjData, turned: set[int]) -> Iterator[Array]:
    """Yield the angular velocities of what is turned, or of hinges alone, and turns others."""
    alone = np.bincount(model.dof_treeid, minlength=model.ntree) == 1
    hinged = [
        body for body in range(model.nbody)
        if model.body_treeid[body] >= 0 and alone[model.body_treeid[body]]
    ]  # fmt: skip
    fields = acting_forces(model) & FIELDS
    owners = {*declared.field_owners(model).values()} if fields else set()
    for magnet in magnets_of(model, data):
        turn = data.cvel[magnet.body, :3]
        moments = magnet.strengths[:, np.newaxis] * magnet.axes
        across = np.linalg.norm(np.cross(moments, turn), axis=1).sum()
        if across > ACROSS * magnet.strengths.sum() * np.linalg.norm(turn):
            owners.add(magnet.body)
    yield from (data.cvel[body, :3].copy() for body in owners & {*hinged, *turned})
