"""How fast actuators can turn rotors, and turning magnets or fields those that follow them."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.strengths import largest_drive, magnets_of
from magmotor.mjcf.forces.marks import FIELDS
from magmotor.mjcf.lookup import control_of, disabled

HINGE, FREE, BALL = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{name}")) for name in ("HINGE", "FREE", "BALL")
)
ACROSS = 0.1
"""Part of a moment across the axis of its turns from which other magnets may follow it."""


def driven_velocities(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[tuple[str, Array]]:
    """Yield why something may turn, and velocities with what actuators or other magnets turn."""
    speeds = _speeds(model, state)
    driven = np.where(speeds != 0, speeds, state.qvel)
    if speeds.any():
        yield " as its actuators can turn it", driven.copy()
    if not driven.any():
        return
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = state.qpos, driven
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_comVel(model, data)
    turns = max(_turns(model, data), key=np.linalg.norm, default=np.zeros(3))
    for magnet in magnets_of(model, data) if turns.any() else ():
        joint = int(model.body_jntadr[magnet.body])
        if magnet.strengths.any() and joint >= 0 and model.jnt_type[joint] in (FREE, BALL):
            end = model.dof_bodyid.searchsorted(magnet.body) + int(model.body_dofnum[magnet.body])
            driven[end - 3 : end] = turns @ data.xmat[magnet.body].reshape(3, 3)
    if turns.any():
        yield " as it follows a magnet or a field that turns", driven


def _speeds(model: mujoco.MjModel, state: mujoco.MjData) -> Array:
    """Return the speeds at which damping balances the largest torque on a rotor, 0 for others.

    A rotor is a hinge without limits, on which no other joint hangs.
    """
    torques, damping = np.zeros(model.nv), model.dof_damping.copy()
    rotors = (model.jnt_type == HINGE) & ~model.jnt_limited.astype(bool)
    rotors &= ~np.isin(model.jnt_dofadr, model.dof_parentid)
    on_joints = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    fixed_gain = model.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED)
    acts = on_joints & fixed_gain & (not disabled(model, "actuation"))
    for actuator in np.flatnonzero(acts).tolist():
        joint = int(model.actuator_trnid[actuator, 0])
        constant, position, velocity = model.actuator_biasprm[actuator, :3].tolist()
        if not rotors[joint] or position:
            continue
        largest = largest_drive(model, actuator)
        if largest == math.inf:
            largest = abs(state.ctrl[control_of(model, actuator)])
        force = abs(model.actuator_gainprm[actuator, 0]) * largest + abs(constant)
        if model.actuator_forcelimited[actuator]:
            force = min(force, abs(model.actuator_forcerange[actuator]).max())
        gear, dof = model.actuator_gear[actuator, 0], int(model.jnt_dofadr[joint])
        torques[dof] += abs(gear) * force
        damping[dof] -= gear**2 * velocity
    return np.divide(torques, damping, out=np.zeros(model.nv), where=damping > 0)


def _turns(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Array]:
    """Yield the angular velocities of hinges whose magnets or fields turn others with them."""
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
    yield from (data.cvel[body, :3].copy() for body in owners & {*hinged})
