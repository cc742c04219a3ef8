"""Discrete momenta of a rigid body with an axis of symmetry, and back.

In the variational Euler scheme a body turns by tau(h omega) in a step; its discrete momentum is
mu = (dtau^-1_{h omega})* I omega, which nothing but torque changes.
"""

import math

from numba import njit

from magmotor.rotations import (
    TINY,
    cayley_momentum,
    dot,
    exponential_momentum,
    plus,
    scaled,
    stretched,
)

ITERATIONS = 100
"""At most; a hoop needs 5 where h |omega| = 0.001, 10 where it is 0.1 and 31 where it is 1."""

ROUNDING = 4e-15
"""Relative change after which nothing but rounding is left."""


@njit(inline="always")
def discrete_momentum(omega, axis, inertia, time, by_cayley):
    """(dtau^-1_W)* I omega for W = time omega; `inertia` is the pair across and about the axis."""
    W, pi = scaled(time, omega), stretched(omega, axis, inertia[0], inertia[1])
    return cayley_momentum(W, pi) if by_cayley else exponential_momentum(W, pi)


@njit(inline="always")
def angular_velocity(mu, axis, inertia, time, by_cayley):
    """The angular velocity with this discrete momentum, by fixed-point iteration.

    NaN if it does not converge: the step is too long for so fast a rotation.
    """
    across, axial = inertia
    omega = stretched(mu, axis, 1.0 / across, 1.0 / axial)
    for _ in range(ITERATIONS):
        missing = plus(mu, -1.0, discrete_momentum(omega, axis, inertia, time, by_cayley))
        change = stretched(missing, axis, 1.0 / across, 1.0 / axial)
        omega = plus(omega, 1.0, change)
        if dot(change, change) < ROUNDING * ROUNDING * dot(omega, omega) + TINY:
            return omega
    return math.nan, math.nan, math.nan
