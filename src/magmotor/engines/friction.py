"""The linear part of a scene, friction and noise on its velocities, over a finite time.

In the modes of friction everything is a number: with u = masses^(-1/2) Q w, where Q diagonalises
masses^(-1/2) friction masses^(-1/2), each w decays at a rate of its own.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.reproducible import applied, product, symmetric_modes

Matrix = NDArray[np.float64]


def friction_and_noise(
    masses: ArrayLike, friction: Matrix, noise: Matrix, time: float, *, exact: bool
) -> tuple[Matrix, Matrix]:
    """Matrices D and L of the map u -> u + D u + L xi of friction and noise during `time`.

    Parameters
    ----------
    masses : array_like, shape (n,)
        Inertia of each velocity u.
    friction : ndarray, shape (n, n)
        Force -friction u; symmetric.
    noise : ndarray, shape (n, channels)
        Force noise dW/dt.
    time : float
        How long they act; negative only without noise.
    exact : bool
        The exact flow, whose noise has the exact covariance and follows the Brownian path as
        closely as that allows; else Euler's explicit step.

    Returns
    -------
    decrement : ndarray, shape (n, n)
    noise : ndarray, shape (n, channels)
    """
    inverse_mass = 1 / np.asarray(masses, dtype=float)[:, np.newaxis]
    increment = inverse_mass * noise
    if noise.any():
        increment = math.sqrt(time) * increment
    if not exact:
        return -time * inverse_mass * friction, increment
    root, rates, modes = _modes(masses, friction)
    decrement = _in_velocities(applied(math.expm1, -rates * time), modes, root)
    if not noise.any():
        return decrement, increment
    driven = product(modes.T, root * increment)
    covariance = product(driven, driven.T) * _mean_decay(np.add.outer(rates, rates) * time)
    return decrement, product(modes, _nearest_root(driven, covariance)) / root


def response(masses: ArrayLike, friction: Matrix, time: float) -> Matrix:
    """The matrix R, in s: a constant acceleration a adds R a to the velocities under friction.

    R is the integral of exp(-rates s) over the time, with rates and arguments as in
    `friction_and_noise`; without friction it is the time.
    """
    root, rates, modes = _modes(masses, friction)
    return _in_velocities(time * _mean_decay(rates * time), modes, root)


def _modes(masses: ArrayLike, friction: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Roots of the masses, shape (n, 1), rates of the modes and the orthogonal matrix Q."""
    root = np.sqrt(np.asarray(masses, dtype=float))[:, np.newaxis]
    rates, modes = symmetric_modes(friction / (root * root.T))
    return root, np.maximum(rates, 0.0), modes


def _in_velocities(numbers: Matrix, modes: Matrix, root: Matrix) -> Matrix:
    """The matrix that multiplies each mode by its number."""
    return product(modes * numbers, modes.T) / root * root.T


def _mean_decay(x: Matrix) -> Matrix:
    """(1 - exp(-x))/x, the mean of exp(-x s) over s from 0 to 1."""
    return np.where(x == 0, 1.0, -applied(math.expm1, -x) / np.where(x == 0, 1.0, x))


def _nearest_root(driven: Matrix, covariance: Matrix) -> Matrix:
    """Of all roots of the covariance, in the range of `driven`, the one nearest to that."""
    lengths = np.sqrt(np.sum(driven * driven, axis=0))
    directions = driven / lengths
    squares, axes = symmetric_modes(product(directions.T, directions))
    back = product(axes / squares, product(axes.T, directions.T)) / lengths[:, np.newaxis]
    squares, axes = symmetric_modes(product(back, product(covariance, back.T)))
    return product(driven, product(axes * np.sqrt(np.maximum(squares, 0.0)), axes.T))
