"""What surrounds a ball that slips: drag, torsion, a tilted floor, a uniform field, and a load.

The velocities (v_x, -omega_y) and (v_y, omega_x) both obey M u' = -C u + F + G xi with u = (v, w)
and M = diag(m, I). C is the friction of the slip v + r w and the drag, and G has a column for the
noise of the slip, of the translation and of the rotation.
"""

import math
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.ball.rigid_forces import Bodies, Magnets
from magmotor.noise import normal
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.reproducible import applied, orthonormal_rows, product, symmetric_modes
from magmotor.numerics.rotations import cross, plus, scaled, third_axis
from magmotor.numerics.simd import fused
from magmotor.numerics.splittings import Scheme

RANK = 1e-14
"""Part of the largest eigenvalue below which another one is rounding."""


class Drag(NamedTuple):
    """Coefficients of friction and noise of the ball, and channels of the noise."""

    rows: Array
    """For each part of a step, P, D, L and (a, b, d), shape (parts, 16)."""
    channels: tuple[int, int, int, int, int]
    """Channels of the noise of the translation (2) and rotation (3) of the ball."""


def has_surroundings(bodies: Bodies, magnets: Magnets) -> bool:
    """Whether more than magnets and slip acts on the ball; otherwise, all of this costs nothing."""
    drags = bodies.drag, bodies.rotational_drag, bodies.torsion
    return any((*drags, *bodies.downhill, *magnets.background, bodies.load_torque))


@subroutine(forceinline=True)
def with_background(force, torque, position, orientation, bodies, magnets):
    """Return force and torque on the ball with its weight, a uniform field and the load.

    The weight acts along the floor, and the load is a force load_torque/rho along e_phi.
    """
    moment = scaled(magnets.moment, third_axis(orientation))
    force = plus(force, 1.0, bodies.downhill)
    if bodies.load_torque != 0.0:
        x, y, _ = position
        force = plus(force, bodies.load_torque / fused(x, x, y * y), (-y, x, 0.0))
    return force, plus(torque, 1.0, cross(moment, magnets.background))


def drag_coefficients(bodies: Bodies, scheme: Scheme, timestep: float) -> Drag:
    """Return the coefficients of a scheme.

    As in MuJoCo, channels are numbered over the noises that are not zero: slip, translation and
    rotation of the ball, then the ring. An exact part also needs the numbers of the others.
    """
    rows = [_row(bodies, fraction * timestep, scheme.exact) for fraction in scheme.fractions]
    noises = [bodies.slip_noise] * 2 + [bodies.drag_noise] * 2
    noises += [bodies.rotational_drag_noise] * 3 + [bodies.ring_noise] * 3
    order = [k for k, noise in enumerate(noises) if noise] + [
        k for k, noise in enumerate(noises) if not noise
    ]
    x, y, a, b, c = (order.index(k) for k in range(2, 7))
    return Drag(np.array(rows), (x, y, a, b, c))


def _row(bodies: Bodies, time: float, exact: bool) -> Array:
    """Return the impulses P u + L xi + D F of friction and noise in a time.

    These are P (2, 2), which is symmetric, so that one number is left out, D (2, 2), L (2, 3), and
    three more. F are constant forces that act at the same time; their own impulse F t is left out.
    The last numbers are (a, b, d) in a w + b xi + d F for the rotation w about the vertical.
    """
    r, spin = bodies.radius, bodies.rotational_drag + bodies.torsion
    arm = np.array([[1.0, r]])
    friction = bodies.slip_friction * product(arm.T, arm)
    friction += np.diag([bodies.drag, bodies.rotational_drag])
    alone = np.diag([bodies.drag_noise, bodies.rotational_drag_noise])
    noise = np.hstack([bodies.slip_noise * arm.T, alone])
    mass = np.array([bodies.mass, bodies.inertia])
    plane = _linear(mass, friction, noise, time, exact)
    about = _linear(mass[1:], np.array([[spin]]), alone[1:, 1:], time, exact)
    lost, spread, kept = plane
    return np.concatenate(
        [lost.ravel()[[0, 1, 3]], kept.ravel(), spread.ravel(), *(part.ravel() for part in about)]
    )


def _linear(
    mass: Array, friction: Array, noise: Array, time: float, exact: bool
) -> tuple[Array, Array, Array]:
    """Return P, L and D of M u' = -C u + F + G xi; there is no noise in a negative time.

    Parameters
    ----------
    mass : ndarray, shape (n,)
        The diagonal of M.
    friction, noise : ndarray, shapes (n, n) and (n, m)
        C and G.
    time : float
        In s.
    exact : bool
        Whether the equation is solved exactly, or by an explicit Euler step.
    """
    forward = max(time, 0.0)
    if not exact:
        return -friction * time, math.sqrt(forward) * noise, np.zeros_like(friction)
    root = np.sqrt(mass)[:, np.newaxis]
    rates, modes = symmetric_modes(friction / root / root.T)
    basis, inverse = root * modes, modes.T / root.T
    lost = applied(math.expm1, -rates * time)
    kept = np.array(
        [-x / rate - time if rate else 0.0 for x, rate in zip(lost, rates, strict=True)]
    )
    driven = product(inverse, noise)
    pairs = rates[:, np.newaxis] + rates
    times = [-math.expm1(-x * forward) / x if x else forward for x in pairs.ravel().tolist()]
    covariance = product(driven, driven.T) * np.reshape(times, pairs.shape)
    spread = product(_square_root(covariance), _directions(driven))
    return (
        product(basis * lost, basis.T),
        product(basis, spread),
        product(basis * kept, inverse),
    )


def _square_root(matrix: Array) -> Array:
    """Return the symmetric root of a symmetric matrix without negative eigenvalues."""
    values, vectors = symmetric_modes(matrix)
    values[values < RANK * values.max()] = 0.0
    return product(vectors * np.sqrt(values), vectors.T)


def _directions(driven: Array) -> Array:
    """Return the orthonormal rows that are nearest to those of a matrix, shape (n, m).

    With them, of all factors of the covariance, L is the one that tends to G sqrt(t), so that
    methods can share the noise.
    """
    values, vectors = symmetric_modes(product(driven, driven.T))
    rows = product(vectors.T, driven)
    known = values > RANK * values.max(initial=0.0)
    rows[known] /= np.sqrt(values[known])[:, np.newaxis]
    missing = orthonormal_rows(np.vstack([rows[known], np.eye(driven.shape[1])]))
    rows[~known] = missing[known.sum() :][: (~known).sum()]
    return product(vectors, rows)


@subroutine(forceinline=True)
def drag_normals(replica, step, path, bodies, drag):
    """Return the normal numbers of the translation and the rotation; zeros for a quiet ball."""
    noise = bodies.slip_noise + bodies.drag_noise + bodies.rotational_drag_noise
    if noise == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    seed, factor, level = path
    x, y, a, b, c = drag.channels
    return (
        normal(seed, replica, step, x, factor, level),
        normal(seed, replica, step, y, factor, level),
        normal(seed, replica, step, a, factor, level),
        normal(seed, replica, step, b, factor, level),
        normal(seed, replica, step, c, factor, level),
    )


@subroutine(forceinline=True)
def drag_on_ball(ball, force, torque, xi, drag, part, kicks):
    """Return the impulse of friction, drag and noise on the ball, and its angular impulse.

    `xi` are normal numbers for the slip (2), the translation (2) and the rotation (3); force and
    torque act at the same time if the part `kicks`.
    """
    rows = drag.rows
    _, v, _, omega = ball
    now = 1.0 if kicks else 0.0
    push_x, twist_x = _in_plane(
        rows, part, (v[0], -omega[1]), (now * force[0], -now * torque[1]), (xi[0], xi[2], -xi[5])
    )
    push_y, twist_y = _in_plane(
        rows, part, (v[1], omega[0]), (now * force[1], now * torque[0]), (xi[1], xi[3], xi[4])
    )
    about = fused(rows[part, 13], omega[2], rows[part, 14] * xi[6])
    about = fused(now * rows[part, 15], torque[2], about)
    return (push_x, push_y, 0.0), (twist_y, -twist_x, about)


@subroutine(forceinline=True)
def _in_plane(rows, part, u, force, xi):
    """Return the impulses on (v, w)."""
    v = fused(rows[part, 0], u[0], rows[part, 1] * u[1])
    w = fused(rows[part, 1], u[0], rows[part, 2] * u[1])
    v = fused(rows[part, 3], force[0], fused(rows[part, 4], force[1], v))
    w = fused(rows[part, 5], force[0], fused(rows[part, 6], force[1], w))
    for k in range(3):
        v = fused(rows[part, 7 + k], xi[k], v)
        w = fused(rows[part, 10 + k], xi[k], w)
    return v, w
