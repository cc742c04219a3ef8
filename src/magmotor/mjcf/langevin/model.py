"""What damping, noise and inertia do to the velocities of a model, read from the model itself.

The velocities are `qvel`, whose angular velocities of a ball or free joint are in the body's frame.
Friction and noise are constant there, or in the world's frame: such a body must have three equal
moments of inertia, and its matrices are for its *reference attitude*, the quaternion 1 0 0 0.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.common.hints import numbers
from magmotor.mjcf.langevin.checks import ROUNDING, check_model, check_viscous
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.viscous_contact import resistance, viscous_contacts
from magmotor.numerics.reproducible import product

Array = NDArray[np.float64]

FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)

WEAKEST_REGULARIZATION = 1e6
"""R over A of a viscous contact, below which its force is not yet -c V."""


class Ball(NamedTuple):
    """A ball joint, or the part of a free joint that turns."""

    body: int
    place: int
    """Of its quaternion in `qpos`."""
    dof: int
    """The first of its three."""
    channel: int
    """The first of three Brownian motions that turn with the body; -1 if there are none."""
    moments: tuple[float, float, float]

    @property
    def ratios(self) -> Array:
        """Moments of inertia over their median; 1 where they are equal to it but for rounding."""
        ratios = np.array(self.moments) / np.median(self.moments)
        return np.where(abs(ratios - 1) < ROUNDING, 1.0, ratios)

    @property
    def isotropic(self) -> bool:
        """Whether the moments of inertia are equal, so that only the torque turns the momentum."""
        return bool((self.ratios == 1).all())


class LangevinModel(NamedTuple):
    """Equation masses du/dt = force - damping u + noise dW/dt, in the reference attitude.

    `force` (nv,) holds what is constant, gravity; `wrenches` (nv, 6) what a wrench on the body of
    each degree of freedom, `bodies` (nv,), at its center of mass and in the world frame, does to
    that.
    """

    masses: Array
    damping: Array
    noise: Array
    force: Array
    bodies: NDArray[np.int64]
    wrenches: Array
    balls: tuple[Ball, ...]


def langevin_model(model: mujoco.MjModel) -> LangevinModel:
    """Read a model.

    Raises
    ------
    ValueError
        Its damping and noise are not constant linear maps, or something else acts than they,
        constant forces and what the compiled callback applies. Names what is in the way.
    """
    check_model(model)
    data = _at_reference(model)
    masses = _masses(model, data)
    wrenches = _wrenches(model, data)
    balls = tuple(_balls(model, masses))
    damping = _dampers(model) + _viscous_contacts(model, data, masses, balls)
    return LangevinModel(
        masses,
        damping,
        _noise(model, wrenches),
        data.qfrc_passive - data.qfrc_bias,
        model.dof_bodyid.astype(np.int64),
        wrenches,
        balls,
    )


def _at_reference(model: mujoco.MjModel) -> mujoco.MjData:
    """The model at rest, all that turns in its reference attitude."""
    data = mujoco.MjData(model)
    for place in _places(model).values():
        data.qpos[place : place + 4] = 1.0, 0.0, 0.0, 0.0
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    return data


def _places(model: mujoco.MjModel) -> dict[int, int]:
    """Where in `qpos` the quaternions of joints are."""
    linear = {FREE: 3, BALL: 0}
    kinds = enumerate(model.jnt_type)
    return {j: int(model.jnt_qposadr[j]) + linear[kind] for j, kind in kinds if kind in linear}


def _masses(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Inertia of each velocity."""
    inertia = np.empty((model.nv, model.nv))
    for row, unit in zip(inertia, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    masses = numbers(above=0)("inertia of joints", np.diagonal(inertia))
    coupled = np.triu(abs(inertia) > ROUNDING * np.sqrt(np.outer(masses, masses)), 1)
    for one, other in np.argwhere(coupled):
        joints = {label(model, "joint", model.dof_jntid[i]): None for i in (one, other)}
        sentence = (
            "must be zero: put slides at right angles, and balls on bodies in their principal frame"
        )
        raise reject(f"inertia between {' and '.join(joints)}", inertia[one, other], sentence)
    return masses.copy()


def _wrenches(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """What wrenches on bodies do to the forces on their joints; see `LangevinModel`."""
    wrenches = np.empty((model.nv, 6))
    jacobian = np.empty((6, model.nv))
    for dof, body in enumerate(model.dof_bodyid):
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        wrenches[dof] = jacobian[:, dof]
    return wrenches


def _balls(model: mujoco.MjModel, masses: Array):
    for joint, place in _places(model).items():
        dof = int(model.jnt_dofadr[joint]) + (3 if model.jnt_type[joint] == FREE else 0)
        body = int(model.jnt_bodyid[joint])
        ball = Ball(body, place, dof, -1, tuple(masses[dof : dof + 3].tolist()))
        yield ball if ball.isotropic else ball._replace(channel=_turning_channel(model, body))


def _channels(model: mujoco.MjModel) -> list[tuple[int, Array]]:
    """Body and wrench of each Brownian motion; see `magmotor.mjcf.forces.brownian`."""
    whole = model.nuser_body - model.nuser_body % 6
    rows = model.body_user[:, :whole].reshape(model.nbody, -1, 6)
    return [(body, row) for body in range(model.nbody) for row in rows[body] if row.any()]


def _turning_channel(model: mujoco.MjModel, body: int) -> int:
    """The first of the Brownian motions that turn a body with unequal moments of inertia."""
    channels = _channels(model)
    turning = [i for i, (b, row) in enumerate(channels) if b == body and row[3:].any()]
    if not turning:
        return -1
    rows = np.array([channels[i][1] for i in turning])
    first, strength = turning[0], rows[0, 3]
    equal = np.hstack([np.zeros((3, 3)), strength * np.eye(3)])
    if turning != [first, first + 1, first + 2] or not np.array_equal(rows, equal):
        sentence = (
            "must be equal torques about x, y and z alone, three rows (0 0 0 a 0 0, 0 0 0 0 a 0,"
            " 0 0 0 0 0 a), since its moments of inertia differ"
        )
        raise reject(f"{label(model, 'body', body)}: user", rows.tolist(), sentence)
    return first


def _noise(model: mujoco.MjModel, wrenches: Array) -> Array:
    channels = _channels(model)
    noise = np.zeros((model.nv, len(channels)))
    for channel, (body, row) in enumerate(channels):
        dofs = model.dof_bodyid == body
        noise[dofs, channel] = product(wrenches[dofs], row[:, np.newaxis])[:, 0]
    numbers(above=0)("noise of user", abs(noise[noise != 0]))
    return noise


def _dampers(model: mujoco.MjModel) -> Array:
    """Friction of joints and of fixed tendons."""
    if disabled(model, "damper"):
        return np.zeros((model.nv, model.nv))
    damping = np.diag(model.dof_damping)
    for tendon in np.flatnonzero(model.tendon_damping):
        parts = model.tendon_adr[tendon] + np.arange(model.tendon_num[tendon])
        row = np.zeros(model.nv)
        row[model.jnt_dofadr[model.wrap_objid[parts]]] = model.wrap_prm[parts]
        damping += model.tendon_damping[tendon] * np.outer(row, row)
    return damping


def _viscous_contacts(
    model: mujoco.MjModel, data: mujoco.MjData, masses: Array, balls: tuple[Ball, ...]
) -> Array:
    """Friction of viscous contacts."""
    damping = np.zeros((model.nv, model.nv))
    if disabled(model, "contact"):
        return damping
    active = viscous_contacts(data)
    for pair in range(model.npair):
        name = label(model, "pair", pair)
        geoms = {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
        found = [c for c in active if set(c.geom.tolist()) == geoms and c.efc_address >= 0]
        if len(found) != 1:
            raise reject(f"{name}: active contacts at qpos0", len(found), "must be one")
        body = check_viscous(model, pair)
        if any(ball.body == body and not ball.isotropic for ball in balls):
            moments = model.body_inertia[body].tolist()
            sentence = f"must be equal, since {name} acts on it"
            raise reject(f"{label(model, 'body', body)}: moments of inertia", moments, sentence)
        damping += _viscous(model, data, found[0], name, masses, body)
    return damping


def _viscous(model, data, contact: Any, name: str, masses: Array, body: int) -> Array:
    """Friction c T^T T, where T u is the slip velocity."""
    jacobian = np.empty((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
    normal, *tangents = product(contact.frame.reshape(3, 3), jacobian)
    if abs(normal).max() > ROUNDING * np.abs(tangents).max():
        sentence = "must be held at its height, where the contact bears no load"
        raise reject(f"{name}: {label(model, 'body', body)}", "free to leave the plane", sentence)
    slip = np.array(tangents)
    inverse_inertia = float(np.max(np.sum(slip**2 / masses, axis=1)))
    regularization = data.efc_R[contact.efc_address + 1] / inverse_inertia
    if regularization < WEAKEST_REGULARIZATION:
        sentence = (
            f"must be at least {WEAKEST_REGULARIZATION:g}: a smaller impratio makes it larger"
        )
        raise reject(f"{name}: R/A", regularization, sentence)
    damping = -contact.solreffriction[1] / resistance(data, contact, inverse_inertia)
    return damping * product(slip.T, slip)
