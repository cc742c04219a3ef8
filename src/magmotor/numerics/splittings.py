"""Splitting schemes, as sequences of parts that are integrated exactly or explicitly.

A drifts with the velocity, B kicks with the force of the potential, and O applies friction and
noise. K applies a constant force together with friction and noise. E is an entire step in one part.
R is the flow of positions and all forces without friction, by the Runge-Kutta rule of fourth order,
and S is a step of MuJoCo.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.numerics.reproducible import (
    applied,
    orthonormal_rows,
    product,
    symmetric_modes,
)

DEPENDENT = 1e-14
"""Square of the sine of an angle below which two channels drive the same velocity, to rounding."""

DRIFTS, KICKS, O_PARTS = "AERS", "BKE", "OKE"
"""Parts that change positions, that apply forces, and that apply friction and noise."""


class Scheme(NamedTuple):
    """A splitting: its parts in order, and the fraction of the timestep for which each acts.

    If `exact`, friction and noise are integrated exactly, else by an explicit Euler step.
    """

    parts: str
    fractions: tuple[float, ...]
    exact: bool = True

    @property
    def takes_noise(self) -> bool:
        """Whether the scheme supports noise, which must act exactly once per step."""
        return sum(part in O_PARTS for part in self.parts) == 1


def evenly(parts: str, *, exact: bool = True) -> Scheme:
    """Return the scheme in which a part that occurs n times acts for 1/n of the step each time."""
    return Scheme(parts, tuple(1 / parts.count(part) for part in parts), exact)


def palindrome(*half: float) -> Scheme:
    """Return the symmetric scheme AKA...KA whose parts before the middle have these fractions."""
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
    "blanes-moan6": palindrome(  # of sixth order, S10, ibid.
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
"""Schemes of the disk; "euler" is the paper's stochastic variational integrator (svi)."""

RIGID = {
    "euler": evenly("E", exact=False),
    "cayley": evenly("E", exact=False),
    **SPLITTINGS,
}
"""Schemes of rigid bodies; the one-part Euler scheme uses the exponential or the Cayley map."""


LANGEVIN = {
    **{name: SPLITTINGS[name] for name in ("baoab", "middle", "verlet")},
    "obabo": evenly("OBABO"),  # Bussi and Parrinello, 2007
    "o-rk4-o": evenly("ORO"),
    "o-step-o": evenly("OSO"),
}
"""Schemes of `magmotor.Langevin`."""


def methods(schemes: Mapping[str, Scheme], *, noise: bool) -> tuple[str, ...]:
    """Return the names of the methods for a scene with or without noise."""
    found = (name for name, scheme in schemes.items() if scheme.takes_noise or not noise)
    return tuple(f"variational/{name}" for name in found)


def kicks_that_evaluate(parts: str) -> tuple[bool, ...]:
    """Return, for each part, whether it is a kick that must evaluate the force.

    If the position has not changed since the previous kick, possibly in the step before, a kick
    reuses the force of that kick.
    """
    kicks = [part in KICKS for part in parts]
    anew = [False] * len(parts)
    after = parts[len(parts) - 1 - kicks[::-1].index(True) :]
    moved = any(part in DRIFTS for part in after)
    for i, part in enumerate(parts):
        anew[i] = kicks[i] and moved
        moved = part in DRIFTS or (moved and not kicks[i])
    return tuple(anew)


def carries_force(kicks: Sequence[bool], needs_force: Sequence[bool]) -> bool:
    """Return whether the first kick of a step reuses the force of the previous step's last kick."""
    return not needs_force[list(kicks).index(True)]


Matrix = NDArray[np.float64]


def friction_and_noise(
    masses: ArrayLike, friction: Matrix, noise: Matrix, time: float, *, exact: bool
) -> tuple[Matrix, Matrix]:
    """Compute the matrices D and L of the map u -> u + D u + L xi of friction and noise.

    Parameters
    ----------
    masses : array_like, shape (n,)
        Inertia of each velocity u.
    friction : ndarray, shape (n, n)
        Symmetric matrix of the force -friction u.
    noise : ndarray, shape (n, channels)
        Matrix of the force noise dW/dt; there may be more channels than velocities.
    time : float
        Duration for which they act, in s; may be negative only without noise.
    exact : bool
        If true, the exact flow: the noise has the exact covariance, and follows the Brownian path
        as closely as that allows. If false, an explicit Euler step.

    Returns
    -------
    decrement : ndarray, shape (n, n)
        D.
    increment : ndarray, shape (n, channels)
        L; the numbers xi are standard normal, W(time)/sqrt(time).
    """
    # The root of the covariance requires linearly independent columns.
    combinations = orthonormal_rows(noise)
    if exact and len(combinations) < noise.shape[1]:
        fewer = product(noise, combinations.T)
        decrement, increment = friction_and_noise(masses, friction, fewer, time, exact=True)
        return decrement, product(increment, combinations)
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
    """Compute the matrix R, in s: with friction, a constant acceleration a adds R a to velocities.

    R is the integral of exp(-rates s) over `time`, with the arguments of `friction_and_noise`;
    without friction, R is `time` times the identity.
    """
    root, rates, modes = _modes(masses, friction)
    return _in_velocities(time * _mean_decay(rates * time), modes, root)


class Exchange(NamedTuple):
    """What friction and noise exchange in an exact part with the velocities u before and u' after.

    While a constant force F acts, the part moves by X = `mean` (u + u')/2 + `force` F. Friction and
    noise together add the energy m (u' - u) (u + u')/2 - F X. Friction alone takes u `heat` u +
    u' `heat` u' + `unresolved` if no force acts: without noise its heat, with noise the mean over
    all paths that begin with u.

    Without noise X is exact. With noise it is time (u + u')/2, as far as positions move in two
    halves of a drift around the part; otherwise the force would do work on the bath.
    """

    heat: Matrix
    unresolved: float
    mean: Matrix
    force: Matrix


def exchange(masses: ArrayLike, friction: Matrix, noise: Matrix, time: float) -> Exchange:
    """Compute the coefficients of `Exchange` from the arguments of `friction_and_noise`."""
    root, rates, modes = _modes(masses, friction)
    x = (0.0 if noise.any() else 0.5) * rates * time
    slope = _mean_slope(x)
    lag = np.where(abs(x) < 1e-4, x / 3, (1 - slope) / np.where(x == 0, 1.0, x))
    fast = _mean_slope(rates * time)
    driven = np.sum(product(modes.T, noise / root) ** 2, axis=1)
    return Exchange(
        _in_velocities(0.5 * rates * time * fast, modes, root) * root**2,
        0.5 * time * float(np.sum(driven * (1 - fast))),
        _in_velocities(time * slope, modes, root),
        _in_velocities(0.5 * time**2 * lag, modes, root) / (root**2).T,
    )


def _mean_slope(x: Matrix) -> Matrix:
    """Return tanh(x)/x, the mean slope of tanh from 0 to x."""
    return np.where(x == 0, 1.0, applied(math.tanh, x) / np.where(x == 0, 1.0, x))


def _modes(masses: ArrayLike, friction: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Return the roots of the masses, shape (n, 1), the decay rates, and the modes in columns."""
    root = np.sqrt(np.asarray(masses, dtype=float))[:, np.newaxis]
    rates, modes = symmetric_modes(friction / (root * root.T))
    return root, np.maximum(rates, 0.0), modes


def _in_velocities(numbers: Matrix, modes: Matrix, root: Matrix) -> Matrix:
    """Return the matrix on velocities that multiplies each mode by its number."""
    return product(modes * numbers, modes.T) / root * root.T


def _mean_decay(x: Matrix) -> Matrix:
    """Return (1 - exp(-x))/x, the mean of exp(-x s) over s from 0 to 1."""
    return np.where(x == 0, 1.0, -applied(math.expm1, -x) / np.where(x == 0, 1.0, x))


def _nearest_root(driven: Matrix, covariance: Matrix) -> Matrix:
    """Return the root of the covariance, in the range of `driven`, that is nearest to `driven`."""
    lengths = np.sqrt(np.sum(driven * driven, axis=0))
    directions = driven / lengths
    squares, axes = symmetric_modes(product(directions.T, directions))
    kept = squares > DEPENDENT * squares.max(initial=0.0)
    squares, axes = squares[kept], axes[:, kept]
    back = product(axes / squares, product(axes.T, directions.T)) / lengths[:, np.newaxis]
    squares, axes = symmetric_modes(product(back, product(covariance, back.T)))
    return product(driven, product(axes * np.sqrt(np.maximum(squares, 0.0)), axes.T))
