"""Estimates for the top under dry friction from statics and energy, without simulation.

The field pins the ball's axis n, so that the ball can spin only about n. It then rolls along
n x e_z, perpendicular to the horizontal part of n, and slides along that part.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from magmotor import dipoles
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.devices.ball.landscape import (
    aligned_force,
    on_plane,
    packed_sources,
    total_field,
    valley,
)
from magmotor.devices.ball.scene import gravitational_energy
from magmotor.devices.top.scene import Top

ITERATIONS = 10
"""Iterations for the axis of a held ball; each reduces the error by more than ten times."""


class Rolling(NamedTuple):
    """Motion of a ball that rolls without slipping."""

    spin: float
    """Largest spin that energy allows along the path, in rad/s."""
    coulomb: float
    """Coulomb coefficient that prevents slipping all along the path if the axis is at rest."""
    coulomb_librating: float
    """The same if the axis swings with constant action from the start."""
    path: Array
    """Path in m, shape (P, 2)."""


def rolling(scene: Top) -> Rolling:
    """Compute the closed path of a ball that starts at rest and rolls without slipping.

    With the angular velocity s n + n x dn/dt, the no-slip condition is
    v = r s (n x e_z) + r (n_z dn/dt - n dn_z/dt), where dn/dt is the derivative of n along v.
    The energy I_3 s^2/2 + I |dn/dt|^2/2 + m v^2/2 - m_ball n.B is conserved.

    Parameters
    ----------
    scene : Top
        Its friction is not used.

    Returns
    -------
    Rolling
    """

    def along(_: float, point: Array) -> Array:
        velocity = _rolling_velocity(scene, point)[0][:2]
        return velocity / np.hypot(*velocity)

    span = (0.0, 1.5 * np.pi * scene.ring_radius)
    path = solve_ivp(along, span, scene.position, max_step=0.01, rtol=1e-8).y.T
    axis, force, potential = held_axis(scene, path)
    moving = np.array([_rolling_velocity(scene, point) for point in path])
    squares = np.sum(moving**2, axis=-1)
    inertia = scene.inertia[2] + squares @ [scene.ball_mass, scene.inertia[0]]
    energy = np.maximum(potential[0] - potential, 0.0)
    load = _load(scene, force)
    pull = np.hypot(force[:, 0], force[:, 1]) / load
    swing = np.linalg.norm(np.cross(scene.axis, axis[0])) / np.linalg.norm(scene.axis)
    torque = swing * np.abs(potential[0]) ** 0.25 * np.abs(potential) ** 0.75
    return Rolling(
        float(np.sqrt(2 * energy / inertia).max()),
        float(pull.max()),
        float((pull + torque / scene.ball_radius / load).max()),
        path,
    )


def _rolling_velocity(scene: Top, point: Array) -> tuple[Array, Array]:
    """Return velocity and dn/dt of a rolling ball, both over the spin, shape (3,)."""
    step = 1e-5 * scene.ring_radius
    around = point + step * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    axis = held_axis(scene, around)[0]
    n = axis[0]
    gradient = np.stack([axis[1] - axis[2], axis[3] - axis[4]], axis=1) / (2 * step)
    carried = n[2] * gradient[:2] - np.outer(n[:2], gradient[2])
    matrix = np.eye(2) - scene.ball_radius * carried
    velocity = np.linalg.solve(matrix, scene.ball_radius * np.array([n[1], -n[0]]))
    return np.append(velocity, 0.0), gradient @ velocity


def held_axis(scene: Top, points: Array) -> tuple[Array, Array, Array]:
    """Compute the equilibrium axis of a ball whose contact point is held by friction.

    The torque about the contact point that would rotate the axis n vanishes if n is along
    m B + r (n_z F - (n.F) e_z), which is solved by iteration.

    Parameters
    ----------
    scene : Top
    points : ndarray, shape (P, 2)
        Contact points on the plane, in m.

    Returns
    -------
    axis : ndarray, shape (P, 3)
        Unit vectors.
    force : ndarray, shape (P, 3)
        Force of magnetism and of the weight along the floor on the ball, in N.
    energy : ndarray, shape (P,)
        Energy of the ball, in J.
    """
    points, sources = check_array("points", points, "n", 2), packed_sources(scene)
    center = on_plane(scene, points)
    field = scene.moment * total_field(scene, center, sources)
    axis = force = field / np.linalg.norm(field, axis=1, keepdims=True)
    for _ in range(ITERATIONS):
        force = dipoles.force_of(center, scene.moment * axis, sources)
        force = force + scene.downhill_force
        torque = axis[:, 2:] * force
        torque[:, 2] -= np.sum(axis * force, axis=1)
        axis = field + scene.ball_radius * torque
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return axis, force, gravitational_energy(scene, center) - np.sum(axis * field, axis=1)


def stopping_coefficients(scene: Top) -> tuple[float, float]:
    """Compute the smallest torsional and rolling coefficients that hold a ball in the valley.

    The ball is held if the power of the magnetic force per unit spin, r F.(n x e_z), is at most the
    power of friction: load times coefficient times the vertical or horizontal part of n.

    Parameters
    ----------
    scene : Top

    Returns
    -------
    torsional, rolling : float
        In m.
    """
    force, axis = aligned_force(scene, valley(scene, np.linspace(0.0, 2 * np.pi, 181)))
    along = np.stack([axis[:, 1], -axis[:, 0]], axis=1)
    power = scene.ball_radius * np.abs(np.sum(force[:, :2] * along, axis=1)) / _load(scene, force)
    level = np.hypot(axis[:, 0], axis[:, 1])
    return float((power / np.abs(axis[:, 2])).max()), float((power / level).max())


def spin_per_coulomb(run: xr.Dataset, scene: Top) -> float:
    """Compute the largest spin over the Coulomb coefficient, to first order in the coefficient.

    The friction torque is integrated along a frictionless motion; the friction force opposes the
    slip and has constant magnitude.

    Parameters
    ----------
    run : xarray.Dataset
        A finely recorded run of a planar scene without friction.
    scene : Top

    Returns
    -------
    float
        In rad/s.
    """
    interval = float(run.time[1] - run.time[0])
    slip, axis = run.slip_velocity.values, run.axis.values
    speed = np.maximum(np.linalg.norm(slip, axis=1), 1e-12)
    sideways = (slip[:, 0] * axis[:, 1] - slip[:, 1] * axis[:, 0]) / speed
    load = scene.weight
    torque = load * scene.ball_radius * sideways
    return float(np.abs(np.cumsum(torque)).max() * interval / scene.inertia[2])


def hertz_torsional_coefficient(scene: Top, coulomb: float, modulus: float) -> float:
    """Compute the torsional coefficient of an elastic ball on an elastic plane.

    The contact radius is a = (3 N r/(4 E*))^(1/3). Sliding over the whole contact under Hertz's
    pressure takes the torque (3 pi/16) mu N a. K. L. Johnson, *Contact Mechanics* (1985), chapters
    4 and 8.

    Parameters
    ----------
    scene : Top
    coulomb : float
        Coulomb coefficient mu within the contact.
    modulus : float
        E* in Pa: 1/E* is the sum of (1 - nu^2)/E of both bodies.

    Returns
    -------
    float
        Torque over load, in m.
    """
    load = scene.weight
    radius = (0.75 * load * scene.ball_radius / modulus) ** (1 / 3)
    return 3 * np.pi / 16 * coulomb * radius


def _load(scene: Top, force: Array) -> Array:
    """Return weight minus lift, in N."""
    return scene.weight - force[:, 2]
