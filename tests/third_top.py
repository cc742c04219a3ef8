"""The top by Newton's and Euler's equations: a program that shares no force with the package."""

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation


def cross(a, b):
    """Return the vector product; that of NumPy takes four times as long for two vectors."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def skew(a):
    """Return the matrix of the vector product with a vector."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


@cache
def sources(scene):
    """Return positions and moments of the ring's dipoles."""
    return scene.ring_sources()


def field_and_gradient(scene, point):
    """Return B (T) and its Jacobian of the ring and the background, by the dipole's formula."""
    positions, moments = sources(scene)
    r = point - positions
    d, along = np.linalg.norm(r, axis=1), np.sum(r * moments, axis=1)
    field = 1e-7 * (3 * (along / d**5) @ r - (1 / d**3) @ moments) + scene.background_field
    mixed = np.einsum("ni,nj,n->ij", r, moments, 1 / d**5)
    radial = np.einsum("ni,nj,n->ij", r, r, along / d**7)
    return field, 3e-7 * (mixed + mixed.T + np.sum(along / d**5) * np.eye(3) - 5 * radial)


def newton_euler(scene, y):
    """Return v, accelerations of center and rotation, and the plane's force.

    The equations of the center of mass and about it, with the vertical force of the plane as an
    unknown that keeps the geometric center at its height.
    """
    x, v, R, spin = y[:3], y[3:6], y[6:15].reshape(3, 3), y[15:]
    m, s = scene.ball_mass, R @ scene.center_of_mass
    xy, xz, yz = scene.products_of_inertia
    A, B, C = scene.inertia
    inertia = R @ np.array([[A, xy, xz], [xy, B, yz], [xz, yz, C]]) @ R.T
    contact = np.array([0, 0, -scene.ball_radius])
    field, gradient = field_and_gradient(scene, x)
    moment = scene.moment * R[:, 2]
    friction = -scene.friction * (v + cross(spin, contact)) * [1, 1, 0]
    at_center = gradient.T @ moment - scene.drag * v
    couple = cross(moment, field) - scene.rotational_drag * spin
    couple = couple - [0, 0, scene.torsional_damping * spin[2]]
    force = at_center + friction + m * np.array(scene.gravity_vector)
    torque = couple + cross(-s, at_center) + cross(contact - s, friction)
    # unknowns: acceleration of the center of mass, angular acceleration, force of the plane
    matrix, right = np.zeros((7, 7)), np.zeros(7)
    matrix[:3, :3], matrix[:3, 6], right[:3] = m * np.eye(3), [0, 0, -1], force
    matrix[3:6, 3:6] = inertia
    matrix[3:6, 6] = -cross(contact - s, [0, 0, 1])
    right[3:6] = torque - cross(spin, inertia @ spin)
    matrix[6, 2], matrix[6, 3:6] = 1.0, [-s[1], s[0], 0]
    right[6] = cross(spin, cross(spin, s))[2]
    found = np.linalg.solve(matrix, right)
    turning = found[3:6]
    center = found[:3] - cross(turning, s) - cross(spin, cross(spin, s))
    return v, center, turning, found[6]


def third_program(scene, times, tolerance=1e-11):
    """Return positions, velocities, rotation matrices and spins as rows, (T, 18), by LSODA."""

    def rate(_, y):
        v, center, turning, _ = newton_euler(scene, y)
        R = y[6:15].reshape(3, 3)
        return np.concatenate([v, center, (skew(y[15:]) @ R).ravel(), turning])

    first = scene.device.initial_state(scene, None, None)
    R = Rotation.from_quat(first.orientation[0], scalar_first=True).as_matrix()
    start = [first.position[0], first.velocity[0], R.ravel(), first.angular_velocity[0]]
    found = solve_ivp(
        rate,
        times[[0, -1]],
        np.concatenate(start),
        "LSODA",
        times,
        rtol=tolerance,
        atol=tolerance / 100,
    )
    return found.y.T


def largest_spin(scene):
    """Return the largest spin about the ball's axis within 60 s, in rad/s."""
    found = third_program(scene, np.linspace(0, 60, 3001), tolerance=1e-6)
    axis, spin = found[:, 6:15].reshape(-1, 3, 3)[:, :, 2], found[:, 15:]
    return np.abs(np.sum(axis * spin, axis=1)).max()
