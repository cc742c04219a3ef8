"""The relaxation of d for the paper's disk, by the modes of the reduced equation."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal

from magmotor.devices.disk.scene import Disk
from magmotor.theory import ReducedDisk

Array = NDArray[np.float64]


@cache
def _eigenfunctions(odd: bool) -> tuple[Array, Array, Array, Array]:
    """Return rates, orthonormal modes, roots of the probabilities, and d in its deviations."""
    model, first = ReducedDisk(Disk()), int(odd)
    up, down = model.up[first:], model.down[first:]
    rates, vectors = eigh_tridiagonal(up + down, -np.sqrt(up[:-1] * down[1:]))
    unit = model.d[first:] / model.mean_square**0.5
    return rates, vectors, np.sqrt(model.probability[first:]), unit


def modes(odd: bool) -> tuple[Array, Array]:
    """Return rates and weights of the exponentials of C(t)/C(0) of d (odd) or of d^2 (even)."""
    rates, vectors, root, unit = _eigenfunctions(odd)
    values = unit if odd else (unit**2 - 1) / 2**0.5
    weights = (root * values @ vectors) ** 2
    kept = rates > 1e-12  # the constant function does not decay
    return rates[kept], weights[kept] / weights[kept].sum()


def expected_stay(start: float, t: Array) -> Array:
    """Return the mean of d at times `t` over that at the start, by the reduced equation."""
    rates, vectors, root, unit = _eigenfunctions(True)
    at = int(np.abs(unit - start).argmin())
    weights = vectors[at] / root[at] * (root * unit @ vectors) / unit[at]
    return np.exp(-np.multiply.outer(t, rates)) @ weights


def expected_scatter(odd: bool, t: Array) -> Array:
    """Return the root mean square of averages over times `t`, by the reduced equation."""
    rates, weights = modes(odd)
    z = np.multiply.outer(t, rates)
    return np.sqrt(2 * (z + np.expm1(-z)) / z**2 @ weights)


def expected_correlation(t: Array) -> Array:
    """Return C_d(t)/C_d(0) by the reduced equation."""
    rates, weights = modes(odd=True)
    return np.exp(-np.multiply.outer(t, rates)) @ weights
