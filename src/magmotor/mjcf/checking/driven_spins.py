"""How fast actuators can turn rotors, and turning magnets or fields those that follow them."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.field_strengths import applied_field
from magmotor.mjcf.checking.strengths import (
    FOLLOWING,
    Magnet,
    largest_drive,
    magnets_of,
)
from magmotor.mjcf.declarations import table as of_table
from magmotor.mjcf.declarations.marks import COILS, FIELDS
from magmotor.mjcf.lookup import control_of, disabled, label

HINGE, FREE, BALL = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{name}")) for name in ("HINGE", "FREE", "BALL")
)
TURNING = [
    int(getattr(mujoco.mjtTrn, f"mjTRN_{name}")) for name in ("JOINT", "JOINTINPARENT", "SITE")
]
"""How actuators act whose torque on a rotor does not change as it turns."""

TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
"""How actuators act whose torque on a rotor may change, so that the speed is unknown."""

FIXED = int(mujoco.mjtGain.mjGAIN_FIXED)
NO_BIAS, AFFINE = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)

FAST = 1e10
"""Speed in rad/s at which MuJoCo resets a state; what exceeds it is not damped."""

HELD = 2 * np.pi
"""Turn in rad within which springs and servos must balance a torque to hold a rotor."""

ACROSS = 0.1
"""Part of a moment across the axis of its turns from which other magnets may follow it."""


def driven_velocities(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[tuple[str, Array]]:
    """Yield why something may turn, and velocities with what actuators or other magnets turn."""
    speeds = np.nan_to_num(_speeds(model, state))
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
            drag = float(model.dof_damping[end - 1]) * np.linalg.norm(turns)
            torque = _turning_torque(model, data, magnet, turns)
            slip = min(1.0, torque / drag) if drag else 1.0
            driven[end - 3 : end] = slip * turns @ data.xmat[magnet.body].reshape(3, 3)
    if turns.any():
        yield " as it follows a magnet or a field that turns", driven


def unknown_spins(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[str]:
    """Yield what can turn bodies at a speed that the model does not tell."""
    magnets = magnets_of(model, state)
    trees = model.body_treeid[[magnet.body for magnet in magnets]]
    unknown = np.isnan(_speeds(model, state)) & np.isin(model.dof_treeid, trees)
    for body in dict.fromkeys(model.dof_bodyid[unknown].tolist()):
        yield f"of {label(model, 'body', body)}, whose speed under its actuators is unknown,"
    kinds, turners = acting_forces(model), set()
    for section, bit in ((of_table.FIELDS, FIELDS), (of_table.COILS, COILS)):
        turners |= {*declared.drivers(model, section)} if kinds & bit else set()
    if len(turners) > 1 and any(_follows(model, each) for each in magnets):
        names = " and ".join(label(model, "actuator", number) for number in sorted(turners)[:2])
        yield f"of magnets in the fields of {names}"


def _follows(model: mujoco.MjModel, magnet: Magnet) -> bool:
    """Return whether a magnet can turn about all axes, so that it follows a field."""
    joint = int(model.body_jntadr[magnet.body])
    return bool(magnet.strengths.any() and joint >= 0 and model.jnt_type[joint] in (FREE, BALL))


def _turning_torque(
    model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, turns: Array
) -> float:
    """Return the torque in N m about an axis with which other magnets and fields turn a magnet.

    It is m B of the field across the axis, from where the others are now.
    """
    welds = np.full(len(magnet.positions), magnet.body)
    flux = np.nan_to_num(applied_field(model, data, magnet.positions, welds))
    for other in magnets_of(model, data):
        if other.body != magnet.body and not other.images:
            apart = magnet.positions[:, np.newaxis] - other.positions
            distance = np.maximum(np.linalg.norm(apart, axis=2, keepdims=True), COINCIDENCE)
            moments, way = other.strengths[:, np.newaxis] * other.axes, apart / distance
            along = (way * moments).sum(axis=2, keepdims=True)
            flux += PERMEABILITY_OVER_4PI * ((3 * along * way - moments) / distance**3).sum(axis=1)
    across = np.linalg.norm(np.cross(flux, turns), axis=1) / np.linalg.norm(turns)
    return float(magnet.strengths @ across)


class Motor(NamedTuple):
    """What an actuator does to a degree of freedom at the speed v: gear times push - slope v."""

    gear: float
    push: float
    slope: float
    largest: float
    """Largest force."""
    stiffness: float = 0.0
    """Of a servo that holds an angle."""

    def torque(self, speed: float) -> float:
        """Return the torque at a speed."""
        force = self.push - self.slope * self.gear * speed
        return self.gear * max(-self.largest, min(self.largest, force))

    @property
    def hold(self) -> float:
        """Return the torque with which it holds an angle."""
        return self.gear * min(self.largest, self.stiffness * self.gear * HELD)


def _speeds(model: mujoco.MjModel, state: mujoco.MjData) -> Array:
    """Return the speeds at which damping balances the largest torques on rotors, 0 for others.

    They are NaN where the model does not tell them.
    """
    speeds, motors = np.zeros(model.nv), [[] for _ in range(model.nv)]
    moments = np.zeros((len(model.actuator_trntype), model.nv))
    if len(moments):
        mujoco.mju_sparse2dense(
            moments, state.actuator_moment, state.moment_rownnz, state.moment_rowadr,
            state.moment_colind,
        )  # fmt: skip
    moments *= _rotors(model) * _acts(model)[:, np.newaxis]
    for actuator, dof in np.argwhere(moments).tolist():
        motors[dof].append(_motor(model, state, actuator, abs(float(moments[actuator, dof]))))
    damping = 0 * model.dof_damping if disabled(model, "damper") else _damping(model)
    friction = model.dof_frictionloss * (not disabled(model, "frictionloss"))
    stiffness = model.jnt_stiffness * (not disabled(model, "spring"))
    for dof, own in enumerate(motors):
        joint = int(model.dof_jntid[dof])
        most = abs(model.jnt_actfrcrange[joint]).max() if model.jnt_actfrclimited[joint] else np.inf

        def excess(speed: float, dof: int = dof, most: float = most) -> float:
            """Return the torque minus friction and damping, which falls with the speed."""
            torque = min(most, sum(motor.torque(speed) for motor in motors[dof] if motor))
            return torque - float(friction[dof]) - damping[dof] * speed

        held = float(stiffness[joint]) * HELD + sum(motor.hold for motor in own if motor)
        if None in own:
            speeds[dof] = np.nan
        elif own and excess(0.0) > held:
            bounded = math.isfinite(excess(0.0)) and excess(FAST) < 0
            root = brentq(excess, 0.0, FAST, xtol=1e-300, maxiter=1000) if bounded else np.nan
            speeds[dof] = root
    return speeds


def _acts(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which actuators turn rotors by a torque of their own, or of a tendon."""
    groups = np.clip(model.actuator_group, 0, 30)
    enabled = (model.opt.disableactuator >> groups & 1) == 0
    kinds = np.isin(model.actuator_trntype, [*TURNING, TENDON])
    return kinds & enabled & (not disabled(model, "actuation"))


def _motor(model: mujoco.MjModel, state: mujoco.MjData, actuator: int, gear: float) -> Motor | None:
    """Return the motor with the largest control; None if that is unknown, or how it depends."""
    gain, bias = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    constant, position, velocity = model.actuator_biasprm[actuator, :3].tolist()
    if bias == NO_BIAS:
        constant = position = velocity = 0.0
    largest, follows = largest_drive(model, actuator), model.actuator_dyntype[actuator] in FOLLOWING
    if largest == math.inf and follows:
        control = control_of(model, actuator)
        largest = abs(np.append(model.key_ctrl[:, control], state.ctrl[control])).max() or math.inf
    limited = model.actuator_forcelimited[actuator]
    most = float(abs(model.actuator_forcerange[actuator]).max()) if limited else math.inf
    if model.actuator_trntype[actuator] == TENDON:
        return None
    if position < 0 and bias == AFFINE and follows:
        return Motor(gear, 0.0, 0.0, most, -position)
    if _is_damper(model, actuator):
        return Motor(gear, 0.0, 0.0, most)
    if position or gain != FIXED or bias not in (NO_BIAS, AFFINE) or largest == math.inf:
        return None
    push = abs(model.actuator_gainprm[actuator, 0]) * float(largest) + abs(constant)
    return Motor(gear, push, -velocity, most)


def _is_damper(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator only brakes, by its control times the speed."""
    constant, position, velocity = model.actuator_gainprm[actuator, :3].tolist()
    affine = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_AFFINE)
    brakes = velocity <= 0 == constant == position and affine
    return brakes and int(model.actuator_biastype[actuator]) == NO_BIAS


def _damping(model: mujoco.MjModel) -> Array:
    """Return the damping of each degree of freedom, by joints and by actuators of MuJoCo 4."""
    damping = model.dof_damping.copy()
    for actuator, own in enumerate(getattr(model, "actuator_damping", ())):
        if own and model.actuator_trntype[actuator] in TURNING[:2]:
            damped = model.dof_jntid == model.actuator_trnid[actuator, 0]
            damping[damped] += model.actuator_gear[actuator, 0] ** 2 * own  # one gear for all axes
    return damping


def _rotors(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which degrees of freedom are turns of rotors."""
    rotors = np.zeros(model.nv, bool)
    for joint, kind in enumerate(model.jnt_type.tolist()):
        first = int(model.jnt_dofadr[joint])
        end = first + {HINGE: 1, BALL: 3, FREE: 6}.get(kind, 0)
        held = model.jnt_limited[joint] and not disabled(model, "limit")
        if end > first and not held and end - 1 not in model.dof_parentid:
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
    owners = declared.field_owners(model) if fields else set()
    for magnet in magnets_of(model, data):
        turn = data.cvel[magnet.body, :3]
        moments = magnet.strengths[:, np.newaxis] * magnet.axes
        across = np.linalg.norm(np.cross(moments, turn), axis=1).sum()
        if across > ACROSS * magnet.strengths.sum() * np.linalg.norm(turn):
            owners.add(magnet.body)
    yield from (data.cvel[body, :3].copy() for body in owners & {*hinged, *turned})
