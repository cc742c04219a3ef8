"""Schemes as lists of their parts, each of which is solved exactly or explicitly.

The parts of one step, in the order in which they act: A drifts with the velocity, B kicks with the
force of the potential, O applies friction and noise, K does both at once: friction and noise under
a force that stays. E is all of a step at once.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.numerics.reproducible import applied, product, symmetric_modes

DRIFTS, KICKS, O_PARTS = "AE", "BKE", "OKE"
"""Parts that move, in which forces act, and in which friction and noise do."""


class Scheme(NamedTuple):
    """A splitting: its parts, and for which fraction of the step each acts.

    With `exact` friction and noise act as in truth, else by Euler's explicit step.
    """

    parts: str
    fractions: tuple[float, ...]
    exact: bool = True

    @property
    def takes_noise(self) -> bool:
        """Whether noise may act: it comes once in a step."""
        return sum(part in O_PARTS for part in self.parts) == 1


def evenly(parts: str, *, exact: bool = True) -> Scheme:
    """A scheme in which a part that comes n times acts for an nth of the step each."""
    return Scheme(parts, tuple(1 / parts.count(part) for part in parts), exact)


def palindrome(*half: float) -> Scheme:
    """AKA...KA, from the fractions of what comes before its middle part, which has the rest."""
    middle = 1 - 2 * sum(half[len(half) % 2 :: 2])
    fractions = (*half, middle, *reversed(half))
    return Scheme("".join("AK"[i % 2] for i in range(len(fractions))), fractions)


SPLITTINGS = {
    "verlet": evenly("AKA"),  # stochastic position Verlet: Melchionna, 2007
    "baoab": evenly("BAOAB"),  # Leimkuhler and Matthews, 2013
    "middle": evenly("BAOA"),  # BAOAB without its last kick: Zhang and others, 2019
    "blanes-moan4": palindrome(  # of fourth order, S6: Blanes and Moan, 2002
        0.0792036964311957,
        0.209515106613362,
        0.353172906049774,
        -0.143851773179818,
        -0.0420650803577195,
        0.434336666566456,
    ),
    "blanes-moan6": palindrome(  # of sixth order, S10, there
        0.0502627644003922,
        0.148816447901042,
        0.413514300428344,
        -0.132385865767784,
        0.0450798897943977,
        0.067307604692185,
        -0.188054853819569,
        0.432666402578175,
        0.541960678450780,
        -0.016404589403617997,
    ),
}

DISK = {"euler": evenly("OBA", exact=False), **SPLITTINGS}
"""Schemes of the disk: Euler's is the paper's stochastic variational one, (svi)."""

RIGID = {
    "euler": evenly("E", exact=False),
    "cayley": evenly("E", exact=False),
    **SPLITTINGS,
}
"""Schemes of rigid bodies: Euler's, in one part, comes by the exponential and by the Cayley map."""


def methods(schemes: Mapping[str, Scheme], *, noise: bool) -> tuple[str, ...]:
    """Names of the methods that serve a scene with noise, or without."""
    found = (name for name, scheme in schemes.items() if scheme.takes_noise or not noise)
    return tuple(f"variational/{name}" for name in found)


def kicks_that_evaluate(parts: str) -> tuple[bool, ...]:
    """For each part, whether it is a kick that needs the force anew.

    A kick after which the position has not moved has the force of the kick before, across the end
    of a step, too.
    """
    kicks = [part in KICKS for part in parts]
    anew = [False] * len(parts)
    after = parts[len(parts) - 1 - kicks[::-1].index(True) :]
    moved = any(part in DRIFTS for part in after)
    for i, part in enumerate(parts):
        anew[i] = kicks[i] and moved
        moved = part in DRIFTS or (moved and not kicks[i])
    return tuple(anew)


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
