"""The Langevin equation of lone bodies: inertia, damping and noise of their velocities.

The velocities are `qvel`; the angular velocities of ball and free joints are in the body's frame.
The damping and noise of such a joint are constant either in the body's frame or in the world frame.
In the latter case, the body must have three equal moments of inertia, and its matrices are given
for its *reference attitude*, the quaternion 1 0 0 0.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import numbers
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.langevin.friction import damper_rows, inertia_matrix, model_friction
from magmotor.mjcf.langevin.lone_bodies import ROUNDING, check_lone_bodies, check_viscous
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.viscous_contact import resistance, viscous_contacts
from magmotor.numerics.reproducible import product

FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)

WEAKEST_REGULARIZATION = 1e6
"""Smallest ratio R/A at which the force of a viscous contact is -c V."""


class Ball(NamedTuple):
    """A ball joint, or the rotational part of a free joint."""

    body: int
    quaternion: int
    """Index of its quaternion in `qpos`."""
    dof: int
    """Index of the first of its three degrees of freedom."""
    channel: int
    """First of three Brownian torques, if the moments of inertia differ; -1 if there are none."""
    moments: tuple[float, float, float]
    """Moments of inertia in the body's frame, in kg m^2."""

    @property
    def ratios(self) -> Array:
        """Moments of inertia over their median; exactly 1 where they are equal up to rounding."""
        ratios = np.array(self.moments) / np.median(self.moments)
        return np.where(abs(ratios - 1) < ROUNDING, 1.0, ratios)

    @property
    def isotropic(self) -> bool:
        """Whether all three moments of inertia are equal."""
        return bool((self.ratios == 1).all())


class LoneModel(NamedTuple):
    """The Langevin equation masses du/dt = force - damping u + noise dW/dt of nv velocities u.

    The matrices are given for the reference attitude. Forces of dipoles and potentials and applied
    forces come in addition; the compiled loop computes them in every step.
    """

    masses: Array
    """Inertia of each velocity, the diagonal of the mass matrix, shape (nv,)."""
    damping: Array
    """Symmetric matrix of joints, fixed tendons and viscous contacts, shape (nv, nv)."""
    noise: Array
    """Amplitudes of the Brownian channels, shape (nv, channels)."""
    wrenches: Array
    """Generalized force per unit wrench on the body of each velocity, shape (nv, 6).

    The wrench is in the world frame, at the center of mass.
    """
    balls: tuple[Ball, ...]
    """The ball joints and the rotational parts of the free joints."""


def read_lone_bodies(model: mujoco.MjModel) -> LoneModel:
    """Read the Langevin equation from a model.

    Raises
    ------
    ValueError
        Damping and noise are not constant linear maps, the inertias of velocities are coupled, or
        the model has forces or constraints that are not supported. The message names the element
        and the requirement.
    """
    check_lone_bodies(model)
    friction = model_friction(model)
    if friction.drag.any():
        sentence = "must be zero without kT: the noise of a fluid is not that of `user`"
        raise ArgumentError("option viscosity", model.opt.viscosity, sentence)
    data = _at_reference(model)
    masses = _masses(model, data)
    wrenches = _wrenches(model, data)
    balls = tuple(_balls(model, masses))
    damping = np.diag(friction.dofs)
    for coefficient, row in zip(*damper_rows(model, data, friction)["tendon"], strict=True):
        damping += coefficient * np.outer(row, row)
    damping += _contact_damping(model, data, masses, balls)
    return LoneModel(masses, damping, _noise(model, wrenches), wrenches, balls)


def _at_reference(model: mujoco.MjModel) -> mujoco.MjData:
    """Return the model's data at rest at `qpos0`, with ball and free joints at 1 0 0 0."""
    data = mujoco.MjData(model)
    for start in _quaternions(model).values():
        data.qpos[start : start + 4] = 1.0, 0.0, 0.0, 0.0
    mujoco.mj_fwdPosition(model, data)
    return data


def _quaternions(model: mujoco.MjModel) -> dict[int, int]:
    """Return the index in `qpos` of the quaternion of each ball and free joint."""
    linear = {FREE: 3, BALL: 0}
    kinds = enumerate(model.jnt_type)
    return {j: int(model.jnt_qposadr[j]) + linear[kind] for j, kind in kinds if kind in linear}


def _masses(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the inertia of each velocity; the mass matrix must be diagonal."""
    inertia = inertia_matrix(model, data)
    masses = numbers(above=0)("inertia of joints", np.diagonal(inertia))
    coupled = np.triu(abs(inertia) > ROUNDING * np.sqrt(np.outer(masses, masses)), 1)
    for one, other in np.argwhere(coupled):
        joints = {label(model, "joint", model.dof_jntid[i]): None for i in (one, other)}
        sentence = (
            "must be zero: put slides at right angles, and align the frames of bodies on ball"
            " joints with their principal axes"
        )
        raise ArgumentError(
            f"inertia between {' and '.join(joints)}", inertia[one, other], sentence
        )
    return masses.copy()


def _wrenches(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the generalized forces per unit wrench; see `LoneModel.wrenches`."""
    wrenches = np.empty((model.nv, 6))
    jacobian = np.empty((6, model.nv))
    for dof, body in enumerate(model.dof_bodyid):
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        wrenches[dof] = jacobian[:, dof]
    return wrenches


def _balls(model: mujoco.MjModel, masses: Array) -> Iterator[Ball]:
    """Yield the ball joints and the rotational parts of the free joints."""
    for joint, start in _quaternions(model).items():
        dof = int(model.jnt_dofadr[joint]) + (3 if model.jnt_type[joint] == FREE else 0)
        body = int(model.jnt_bodyid[joint])
        ball = Ball(body, start, dof, -1, tuple(masses[dof : dof + 3].tolist()))
        yield ball if ball.isotropic else ball._replace(channel=_torque_channel(model, body))


def _channels(model: mujoco.MjModel) -> list[tuple[int, Array]]:
    """Return the body and the wrench of each channel; see `mjcf/forces/brownian_wrenches.py`."""
    if not acting_forces(model) & NOISE:
        return []
    whole = model.nuser_body - model.nuser_body % 6
    rows = model.body_user[:, :whole].reshape(model.nbody, -1, 6)
    return [(body, row) for body in range(model.nbody) for row in rows[body] if row.any()]


def _torque_channel(model: mujoco.MjModel, body: int) -> int:
    """Return the first of three Brownian torques on a body with unequal moments of inertia.

    The result is -1 if there are none. They must be equal torques about x, y and z, whose
    distribution does not depend on the attitude.
    """
    channels = _channels(model)
    torques = [i for i, (b, row) in enumerate(channels) if b == body and row[3:].any()]
    if not torques:
        return -1
    rows = np.array([channels[i][1] for i in torques])
    first, strength = torques[0], rows[0, 3]
    equal = np.hstack([np.zeros((3, 3)), strength * np.eye(3)])
    if torques != [first, first + 1, first + 2] or not np.array_equal(rows, equal):
        sentence = (
            "since the moments of inertia differ, Brownian torques must be three successive rows of"
            " equal torques about x, y and z (0 0 0 a 0 0, 0 0 0 0 a 0, 0 0 0 0 0 a)"
        )
        given = [row.tolist() for b, row in channels if b == body]
        raise ArgumentError(f"{label(model, 'body', body)}: user", given, sentence)
    return first


def _noise(model: mujoco.MjModel, wrenches: Array) -> Array:
    """Return the amplitudes of all channels; see `LoneModel.noise`."""
    channels = _channels(model)
    noise = np.zeros((model.nv, len(channels)))
    for channel, (body, row) in enumerate(channels):
        dofs = model.dof_bodyid == body
        noise[dofs, channel] = product(wrenches[dofs], row[:, np.newaxis])[:, 0]
    for amplitude in np.unique(abs(noise[noise != 0])):
        check_number("noise of user", amplitude, above=0)
    return noise


def _contact_damping(
    model: mujoco.MjModel, data: mujoco.MjData, masses: Array, balls: tuple[Ball, ...]
) -> Array:
    """Return the damping matrix of viscous contacts, each of which must be active at `qpos0`."""
    damping = np.zeros((model.nv, model.nv))
    if disabled(model, "contact"):
        return damping
    active = viscous_contacts(data)
    for pair in range(model.npair):
        name = label(model, "pair", pair)
        geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
        found = [c for c in active if set(c.geom.tolist()) == geoms and c.efc_address >= 0]
        if len(found) != 1:
            raise ArgumentError(
                f"{name}: active contacts at qpos0", len(found), "must be exactly one"
            )
        body = check_viscous(model, pair)
        if any(ball.body == body and not ball.isotropic for ball in balls):
            moments = model.body_inertia[body].tolist()
            sentence = f"must be equal, since {name} acts on it"
            raise ArgumentError(
                f"{label(model, 'body', body)}: moments of inertia", moments, sentence
            )
        damping += _slip_damping(model, data, found[0], name, masses, body)
    return damping


def _slip_damping(model, data, contact: Any, name: str, masses: Array, body: int) -> Array:
    """Return the damping matrix c T^T T of a viscous contact, where T u is the slip velocity."""
    jacobian = np.empty((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
    normal, *tangents = product(contact.frame.reshape(3, 3), jacobian)
    if abs(normal).max() > ROUNDING * np.abs(tangents).max():
        sentence = "must be held at a fixed height, since the contact bears no load"
        raise ArgumentError(
            f"{name}: {label(model, 'body', body)}", "free to leave the plane", sentence
        )
    slip = np.array(tangents)
    inverse_inertia = float(np.max(np.sum(slip**2 / masses, axis=1)))
    regularization = data.efc_R[contact.efc_address + 1] / inverse_inertia
    if regularization < WEAKEST_REGULARIZATION:
        sentence = f"must be at least {WEAKEST_REGULARIZATION:g}: decrease the option impratio"
        raise ArgumentError(f"{name}: R/A", regularization, sentence)
    damping = -contact.solreffriction[1] / resistance(data, contact, inverse_inertia)
    return damping * product(slip.T, slip)
