"""The slow model of the top, tried and dropped: the ball's axis always lies along the field.

Averaging over the libration leaves the place on the plane and the momentum map J about n = B/|B|.
The angular velocity is n x dn/dt + J n/I, and d'Alembert's principle for displacements that turn
the axis with n gives

    m a + I N^T (d^2 n/dt^2) + J N^T (dn/dt x n) = -grad V_e + friction,   dJ/dt = n . torque,

where N are the derivatives of n in the plane.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import magmotor as mm
from magmotor import dipoles

Array = NDArray[np.float64]

SPACING = 1e-3
"""Of the points, in m, whose differences are the derivatives of the field, good to 1e-5."""


class Slow(NamedTuple):
    """Places (T, 2) in m and momentum map (T,) in kg m^2/s."""

    position: Array
    momentum_map: Array


def solve(scene: mm.Top, times: Array) -> Slow:
    """The slow model at these times, by DOP853."""
    sources = scene.ring_sources()
    start = [*scene.position, *scene.velocity, scene.inertia[0] * scene.spin]
    found = solve_ivp(
        lambda _, y: _derivative(scene, sources, y), (times[0], times[-1]), start,
        method="DOP853", t_eval=times, rtol=1e-9, atol=1e-13,
    )  # fmt: skip
    return Slow(found.y[:2].T, found.y[4])


def _derivative(scene: mm.Top, sources: tuple[Array, Array], y: Array) -> Array:
    place, v, J = y[:2], y[2:4], y[4]
    m, I, r, c = scene.ball_mass, scene.inertia[0], scene.ball_radius, scene.friction
    energy, n, N, bend = _field(scene, sources, place)
    turning = N @ v
    omega, arm = np.cross(n, turning) + J / I * n, np.array([0.0, 0.0, -r])
    slip = np.append(v, 0.0) + np.cross(omega, arm)
    push = -c * np.append(slip[:2], 0.0)
    twist = np.cross(arm, push)
    curved = np.einsum("jki,j,k->i", bend, v, v)
    force = push[:2] - energy + N.T @ (np.cross(twist, n) - I * curved - J * np.cross(turning, n))
    a = np.linalg.solve(m * np.eye(2) + I * N.T @ N, force)
    return np.array([*v, *a, n @ twist])


def _field(scene: mm.Top, sources, place: Array) -> tuple[Array, Array, Array, Array]:
    """Gradient (2,) of V_e; n (3,), its derivatives (3, 2) and second derivatives (2, 2, 3)."""
    grid = SPACING * np.stack(np.meshgrid(*2 * [[-1, 0, 1]], indexing="ij"), axis=-1)
    points = np.concatenate([place + grid, np.full((3, 3, 1), scene.ball_radius)], axis=-1)
    field = dipoles.field(points, *sources)
    strength = np.linalg.norm(field, axis=-1)
    n = field / strength[..., np.newaxis]
    step, middle = 2 * SPACING, n[1, 1]
    gradient = np.array([strength[2, 1] - strength[0, 1], strength[1, 2] - strength[1, 0]]) / step
    first = np.array([n[2, 1] - n[0, 1], n[1, 2] - n[1, 0]]).T / step
    mixed = (n[2, 2] - n[2, 0] - n[0, 2] + n[0, 0]) / step**2
    second = [n[2, 1] - 2 * middle + n[0, 1], n[1, 2] - 2 * middle + n[1, 0]]
    bend = np.array([[second[0] / SPACING**2, mixed], [mixed, second[1] / SPACING**2]])
    return -scene.moment * gradient, middle, first, bend
