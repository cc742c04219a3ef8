"""Exact displacements on flat U, for any `friction_ratio` and background drag."""

import math

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Elapsed
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.stationary import (
    friction_modes,
    require_one_temperature,
    temperature,
)

Scene = Disk | LangevinParticle


@checked
def flat_mean_displacement(scene: Scene, t: Elapsed, direction: ArrayLike | None = None) -> Array:
    """Return the mean displacement on flat U from the scene's initial velocities.

    This is the integral of equation (eq:v); the scene's potential is ignored.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        Mean of direction.(q_t - q_0), shaped as `t`.
    """
    t = np.asarray(t, dtype=float)
    rates, modes = friction_modes(scene)
    root = np.sqrt(scene.masses)
    velocities = [getattr(scene, name) for name in scene.velocity_names]
    weights = (modes.T @ (_direction(scene, direction) / root)) * (modes.T @ (root * velocities))
    return sum((w * _decayed(r, t) for w, r in zip(weights, rates, strict=True)), np.zeros_like(t))


@checked
def flat_variance_from_rest(scene: Scene, t: Elapsed, direction: ArrayLike | None = None) -> Array:
    r"""Return the exact variance of the displacement on flat U, for a given initial state.

    For the disk's x, it is D [t - 2 (1 - e^(-lambda t))/lambda + (1 - e^(-2 lambda t))/(2 lambda)]
    with D = `flat_x_diffusion`, and the same for x + theta with D = `y_diffusion`. The Langevin
    particle has lambda = c and D = alpha^2/c^2, a good approximation in any potential if
    kT >> max U. With `friction_ratio` or background drag, the variance is the sum of two such
    terms.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        E[(q_t - E[q_t])^2], dimensionless, shaped as `t`; from rest, it equals E[(q_t - q_0)^2].
    """
    return _sum_over_modes(scene, t, direction, _from_rest)


@checked
def flat_msd_from_gibbs(scene: Scene, t: Elapsed, direction: ArrayLike | None = None) -> Array:
    """Return the exact E_mu[(q_t - q_0)^2] on flat U, with velocities drawn from (kjhss).

    A mode of rate r contributes 2 kT (r t - 1 + e^(-r t))/r^2 times its weight. On flat U, the
    disk's d is conserved, r = 0, and contributes t^2/(beta (1 + sigma)) to x: ballistic motion
    forever, *without* any potential.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        Mean squared displacement, dimensionless, shaped as `t`.
    """
    return _sum_over_modes(scene, t, direction, _from_gibbs)


def _direction(scene: Scene, direction: ArrayLike | None) -> Array:
    if direction is None:
        return np.eye(len(scene.masses))[0]
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (len(scene.masses),):
        raise ArgumentError("direction", direction, f"must be {len(scene.masses)} numbers")
    return vector


def _sum_over_modes(scene: Scene, t: ArrayLike, direction: ArrayLike | None, term) -> Array:
    require_one_temperature(scene)
    t = np.asarray(t, dtype=float)
    rates, modes = friction_modes(scene)
    weights = (modes.T @ (_direction(scene, direction) / np.sqrt(scene.masses))) ** 2
    terms = (w * term(r * t) for w, r in zip(weights, rates, strict=True))
    return temperature(scene) * t**2 * sum(terms, np.zeros_like(t))


def _decayed(rate: float, t: Array) -> Array:
    """Return the integral of e^(-rate s) over s < t."""
    return -np.expm1(-rate * t) / rate if rate else t


def _from_gibbs(z: Array) -> Array:
    """Return 2 (z - 1 + e^(-z))/z^2, which is 1 at 0."""
    series = 1 - z / 3 * (1 - z / 4 * (1 - z / 5 * (1 - z / 6)))
    safe = np.maximum(z, 1e-3)
    return np.where(z < 1e-3, series, 2 * (safe + np.expm1(-safe)) / safe**2)


def _from_rest(z: Array) -> Array:
    """Return 2 (z - 2 (1 - e^(-z)) + (1 - e^(-2z))/2)/z^2, which is about 2z/3 near 0."""
    series, small = np.zeros_like(z), np.minimum(z, 0.03)
    for k in range(3, 10):
        series += (4 - 2.0**k) / math.factorial(k) * (-1) ** k * small ** (k - 2)
    safe = np.maximum(z, 0.03)
    closed = 2 * (safe + 2 * np.expm1(-safe) - np.expm1(-2 * safe) / 2) / safe**2
    return np.where(z < 0.03, series, closed)
