"""The disk's stochastic variational Euler scheme in vectorized NumPy, without temporaries."""

import numpy as np
from numpy.typing import NDArray

import magmotor as mm


def advance(
    states: NDArray[np.float64], steps: int, rng: np.random.Generator, scene: mm.Disk, h: float
) -> None:
    """Advance rows x, theta, v, omega of all replicas."""
    x, theta, v, omega = states
    slip, noise, cosine = np.empty((3, x.size))
    for _ in range(steps):
        rng.standard_normal(out=noise)
        noise *= scene.noise * h**0.5
        np.add(v, omega, out=slip)
        slip *= -scene.friction * h
        slip += noise  # the impulse of friction and noise
        np.cos(x, out=cosine)
        cosine *= -h
        v += slip
        v += cosine
        slip /= scene.sigma
        omega += slip
        np.multiply(v, h, out=slip)
        x += slip
        np.multiply(omega, h, out=slip)
        theta += slip
