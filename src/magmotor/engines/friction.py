"""The linear part of a scene, friction and noise on its velocities, over a finite time."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm, sqrtm

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
        Force -friction u.
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
    inverse_mass = np.diag(1 / np.asarray(masses))
    rates = inverse_mass @ friction
    increment = inverse_mass @ noise
    if noise.any():
        increment *= math.sqrt(time)
    if not exact:
        return -time * rates, increment
    flow, covariance = _flow_and_covariance(rates, increment @ increment.T / time, time)
    # Of all roots of the covariance the one nearest to Euler's increment.
    back = np.linalg.pinv(increment)
    nearest = increment @ np.real(sqrtm(back @ covariance @ back.T)) if noise.any() else increment
    return flow - np.eye(len(flow)), nearest


def response(masses: ArrayLike, friction: Matrix, time: float) -> Matrix:
    """The matrix R, in s: a constant acceleration a adds R a to the velocities under friction.

    R is the integral of exp(-rates s) over the time, with rates and arguments as in
    `friction_and_noise`; without friction it is the time.
    """
    rates = np.diag(1 / np.asarray(masses)) @ friction
    n = len(rates)
    block = time * np.block([[-rates, np.eye(n)], [np.zeros((n, 2 * n))]])
    return np.asarray(expm(block), dtype=float)[:n, n:]


def _flow_and_covariance(rates: Matrix, power: Matrix, time: float) -> tuple[Matrix, Matrix]:
    """exp(-rates t) and the integral of exp(-rates s) power exp(-rates^T s), by Van Loan."""
    n = len(rates)
    block = time * np.block([[-rates, power], [np.zeros((n, n)), rates.T]])
    whole = np.asarray(expm(block), dtype=float)
    flow = whole[:n, :n]
    return flow, whole[:n, n:] @ flow.T
