"""Array functions whose results have the same bits on every processor.

NumPy's sines and exponentials, and the products and decompositions of BLAS and LAPACK, run
different code on different processors, and their last digits differ. Everything that affects a
trajectory uses only the functions below, elementwise arithmetic, and sums along an axis.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array

SWEEPS = 100
"""Maximum number of Jacobi sweeps; matrices of a few rows need 5, matrices of a hundred 10."""

INDEPENDENT = 1e-12
"""Fraction of a row's length above which a remainder exceeds rounding errors."""


def applied(function: Callable[[float], float], x: ArrayLike) -> Array:
    """Apply a C library function like `math.sin` to each element; NaN for nonfinite elements."""
    x = np.asarray(x, dtype=float)
    finite = np.where(np.isfinite(x), x, math.nan)
    return np.fromiter(map(function, finite.ravel().tolist()), float, x.size).reshape(x.shape)


def geometric(first: float, last: float, count: int) -> list[float]:
    """Return `count` numbers in geometric progression from `first` to `last`, inclusive."""
    powers = applied(partial(math.pow, last / first), np.linspace(0, 1, count))
    return [first, *(first * powers[1:-1]).tolist(), last][:count]


def product(first: ArrayLike, second: ArrayLike) -> Array:
    """Return the product of two matrices, summed in a fixed order."""
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    result = np.zeros((len(first), second.shape[1]))
    for column, row in zip(first.T, second, strict=True):
        result += column[:, np.newaxis] * row
    return result


def symmetric_modes(matrix: Array) -> tuple[Array, Array]:
    """Compute the eigenvalues (n,) and orthonormal eigenvectors (columns) by Jacobi rotations."""
    a, modes = matrix.copy(), np.eye(len(matrix))
    negligible = np.finfo(float).eps ** 2 * np.abs(a).max(initial=0.0)
    pairs = [(p, q) for q in range(len(a)) for p in range(q)]
    for _ in range(SWEEPS):
        rotated = False
        for p, q in pairs:
            if abs(a[p, q]) > negligible:
                rotated = True
                ratio = (a[q, q] - a[p, p]) / (2 * a[p, q])
                t = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
                c = 1.0 / math.sqrt(1.0 + t * t)
                for rows in (a, a.T, modes.T):
                    rows[p], rows[q] = c * rows[p] - c * t * rows[q], c * t * rows[p] + c * rows[q]
                a[p, q] = a[q, p] = 0.0
        if not rotated:
            break
    return np.diagonal(a).copy(), modes


def orthonormal_rows(rows: Array) -> Array:
    """Return orthonormal rows, shape (rank, n), with the same span as `rows`, shape (m, n)."""
    left = [row / np.sqrt(np.sum(row * row)) for row in rows if row.any()]
    found: list[Array] = []
    while left:
        sizes = [float(np.sum(row * row)) for row in left]
        best = left.pop(sizes.index(max(sizes)))
        if max(sizes) < INDEPENDENT**2:
            break
        for other in found:  # a second time, to remove rounding errors
            best = best - np.sum(other * best) * other
        found.append(best / np.sqrt(np.sum(best * best)))
        left = [row - np.sum(found[-1] * row) * found[-1] for row in left]
    return np.array(found).reshape(len(found), rows.shape[1])
