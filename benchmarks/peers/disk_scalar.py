"""The disk's stochastic variational Euler scheme as a compiled loop, one replica after another."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(fastmath=True)
def advance(
    states: NDArray[np.float64],
    steps: int,
    rng: np.random.Generator,
    sigma: float,
    friction: float,
    noise: float,
    h: float,
) -> None:
    """Advance rows x, theta, v, omega of all replicas."""
    strength = noise * math.sqrt(h)
    for replica in range(states.shape[1]):
        x, theta, v, omega = states[:, replica]
        for _ in range(steps):
            impulse = strength * rng.standard_normal() - h * friction * (v + omega)
            v += impulse - h * math.cos(x)
            omega += impulse / sigma
            x += h * v
            theta += h * omega
        states[:, replica] = x, theta, v, omega
