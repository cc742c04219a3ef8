"""A ball whose center of mass is beside its dipole, or whose axis is no axis of symmetry.

The dipole and the sphere that touches the floor are at the geometric center G, whose velocity is v.
The center of mass is at the lever s from G, fixed in the ball, and I is the inertia about it. With

    p = m (v + omega x s),    pi = s x p + I omega,

where pi is the angular momentum about G, the laws of momentum and of angular momentum about the
moving point G read, with the force F and the torque T about G of everything that acts on the ball,

    dp/dt = F,    dpi/dt = T + m (omega x s) x v.

The plane bears the ball under G, so that its force has no torque about G.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.devices.ball.landscape import attitude, packed_sources, total_field
from magmotor.devices.ball.resting import resting_ball
from magmotor.devices.ball.slip import slip_velocity
from magmotor.devices.ball.states import smallest_turn
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates

PLANAR = [0, 1, 3, 4, 5]
"""Coordinates of a ball on its plane among those of a free one: x, y, z and rotations."""


def rotation_of(scene: Top, states: BallStates) -> Rotation:
    """Return the rotations from the ball's frame to the world.

    Raises
    ------
    ValueError
        The states have no orientation, without which the center of mass is unknown.
    """
    if states.orientation is None:
        sentence = f"must be given for center_of_mass = {scene.center_of_mass}"
        raise ArgumentError("states.orientation", None, f"{sentence} or products of inertia")
    return Rotation.from_quat(states.orientation, scalar_first=True)


def mass_matrix(scene: Top, rotation: Rotation) -> Array:
    """Return the matrix of (v, omega) -> (p, pi), shape (T, 6, 6), from T rotations."""
    turned = rotation.as_matrix()
    lever = _cross_matrix(rotation.apply(scene.center_of_mass))
    mass, inertia = scene.ball_mass, scene.inertia_about_center_of_mass
    matrix = np.zeros((len(turned), 6, 6))
    matrix[:, :3, :3] = mass * np.eye(3)
    matrix[:, 3:, :3] = mass * lever
    matrix[:, :3, 3:] = -mass * lever
    own = np.einsum("tij,jk,tlk->til", turned, inertia, turned)
    matrix[:, 3:, 3:] = own - mass * np.einsum("tij,tjk->tik", lever, lever)
    return matrix


def planar_mass_matrix(scene: Top, rotation: Rotation) -> Array:
    """Return the matrix of (v_x, v_y, omega) -> (p_x, p_y, pi), shape (T, 5, 5)."""
    return mass_matrix(scene, rotation)[:, PLANAR][:, :, PLANAR]


def _cross_matrix(vectors: Array) -> Array:
    """Return the matrices of the maps a -> s x a for vectors s, shapes (T, 3) -> (T, 3, 3)."""
    return np.cross(vectors[:, np.newaxis], np.eye(3)).swapaxes(1, 2)


def momenta(scene: Top, states: BallStates) -> tuple[Array, Array]:
    """Return p in kg m/s and pi in kg m^2/s, shape (T, 3) each."""
    velocities = np.hstack([states.velocity, states.angular_velocity])
    both = np.einsum("tij,tj->ti", mass_matrix(scene, rotation_of(scene, states)), velocities)
    return both[:, :3], both[:, 3:]


def velocities(scene: Top, momentum: Array, turning: Array, rotation: Rotation) -> Array:
    """Return v_x, v_y and omega, shape (T, 5), from p_x, p_y (T, 2) and pi (T, 3) on the plane."""
    matrix, both = planar_mass_matrix(scene, rotation), np.hstack([momentum, turning])
    return np.linalg.solve(matrix, both[..., np.newaxis])[..., 0].astype(float, copy=False)


def kinetic_energy(scene: Top, states: BallStates) -> Array:
    """Return (v . p + omega . pi)/2 in J, shape (T,)."""
    linear, turning = momenta(scene, states)
    twice = states.velocity * linear + states.angular_velocity * turning
    return 0.5 * np.sum(twice, axis=-1)


def raised_energy(scene: Top, states: BallStates) -> Array:
    """Return the energy of the weight at the lever, -m g . s in J, shape (T,)."""
    lever = rotation_of(scene, states).apply(scene.center_of_mass)
    return -scene.ball_mass * (lever @ np.array(scene.gravity_vector))


def momentum_along_axis(scene: Top, states: BallStates) -> Array:
    """Return J = pi . xi_3 in kg m^2/s, shape (T,)."""
    return np.sum(momenta(scene, states)[1] * states.axis, axis=-1)


def unbalanced_torque(scene: Top, states: BallStates) -> Array:
    """Return the rate of change of J without friction, in N m, shape (T,).

    It is xi_3 . (s x m g + m (omega x s) x v + pi x omega), the torque of the weight about the axis
    and that of inertia. Magnetism has no torque about xi_3.
    """
    lever = rotation_of(scene, states).apply(scene.center_of_mass)
    spin, mass = states.angular_velocity, scene.ball_mass
    weight = np.cross(lever, mass * np.array(scene.gravity_vector))
    carried = mass * np.cross(np.cross(spin, lever), states.velocity)
    gyroscopic = np.cross(momenta(scene, states)[1], spin)
    return np.sum(states.axis * (weight + carried + gyroscopic), axis=-1)


def vertical_momentum_rate(scene: Top, states: BallStates, force: Array, torque: Array) -> Array:
    """Return dp_z/dt in N, shape (T,), of a ball that the plane bears.

    The plane exerts the weight plus this rate less the magnetic lift.

    Parameters
    ----------
    force, torque : ndarray, shape (T, 3)
        Those of magnetism.
    """
    rotation, spin = rotation_of(scene, states), states.angular_velocity
    lever: Array = rotation.apply(scene.center_of_mass)
    matrix = mass_matrix(scene, rotation)
    weight = scene.ball_mass * np.array(scene.gravity_vector)
    friction = -scene.friction * slip_velocity(scene, states.velocity, spin)
    force = force + weight + friction - scene.drag * states.velocity
    torque = torque + np.cross(lever, weight) + np.cross([0.0, 0.0, -scene.ball_radius], friction)
    torque = torque - (scene.rotational_drag + scene.torsional_damping * np.eye(3)[2]) * spin
    inward = scene.ball_mass * np.cross(spin, np.cross(spin, lever))
    about_center = np.einsum("tij,tj->ti", matrix[:, 3:, 3:], spin)
    right = np.hstack([force - inward, torque - np.cross(spin, about_center)])[:, PLANAR]
    rates = np.linalg.solve(matrix[:, PLANAR][:, :, PLANAR], right[..., np.newaxis])
    return np.einsum("ti,ti->t", matrix[:, 2, PLANAR], rates[..., 0]) + inward[:, 2]


def resting_rotation(scene: Top) -> Rotation:
    """Return the rotation (one of them) from the ball's frame to the world at rest.

    The ball rests in the deepest minimum of V_e.

    If the center of mass is on the axis, the angle about the axis is arbitrary.
    """
    center, axis = resting_ball(scene)
    across, _ = scene.mass_offsets
    if not across:
        return Rotation.from_quat([smallest_turn(axis)], scalar_first=True)
    along, out = attitude(scene, total_field(scene, center, packed_sources(scene))).T
    x, y = np.array(scene.center_of_mass[:2]) / across
    own = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])
    return Rotation.from_matrix([np.stack([out, np.cross(along, out), along], axis=1) @ own])
