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
        How long they act.
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
    increment = math.sqrt(time) * inverse_mass @ noise
    if not exact:
        return -time * rates, increment
    flow, covariance = _flow_and_covariance(rates, increment @ increment.T / time, time)
    # Of all roots of the covariance the one nearest to Euler's increment.
    back = np.linalg.pinv(increment)
    nearest = increment @ np.real(sqrtm(back @ covariance @ back.T)) if noise.any() else increment
    return flow - np.eye(len(flow)), nearest


def _flow_and_covariance(rates: Matrix, power: Matrix, time: float) -> tuple[Matrix, Matrix]:
    """exp(-rates t) and the integral of exp(-rates s) power exp(-rates^T s), by Van Loan."""
    n = len(rates)
    block = time * np.block([[-rates, power], [np.zeros((n, n)), rates.T]])
    whole = np.asarray(expm(block), dtype=float)
    flow = whole[:n, :n]
    return flow, whole[:n, n:] @ flow.T
