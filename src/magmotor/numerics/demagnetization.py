"""Demagnetizing factors of ellipsoids, and the magnetization of a body that an ellipsoid describes.

The field inside the body is H = H_0 - N M, where H_0 is the field from outside, M the magnetization
and N the tensor of the demagnetizing factors. The material has M = chi H/sqrt(1 + (chi H/M_s)^2)
along H, with the susceptibility chi and the saturation magnetization M_s.
"""

import math

from magmotor.numerics.deferred import jitable, njit, twofold

VACUUM_PERMEABILITY = 4e-7 * math.pi
"""mu0 in T m/A; see `magmotor.dipoles.PERMEABILITY_OVER_4PI`."""

LARGEST_COUNT = 100
"""Number of Newton steps that is never reached."""


@jitable
def demagnetizing_factors(a, b, c):
    """Return the demagnetizing factors of an ellipsoid along its axes, whose semi-axes are given.

    Their sum is 1; those of a sphere are 1/3. Reference: J. A. Osborn, Phys. Rev. 67 (1945) 351,
    with the integrals of B. C. Carlson, Numer. Algorithms 10 (1995) 13.
    """
    if a == b == c:
        return 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0
    y, z = (b / a) * (b / a), (c / a) * (c / a)
    scale = math.sqrt(y * z) / 3.0
    return scale * _rd(y, z, 1.0), scale * _rd(z, 1.0, y), scale * _rd(1.0, y, z)


@jitable
def _rd(x, y, z):
    """Return 3/2 int_0^inf dt / (sqrt(t + x) sqrt(t + y) sqrt(t + z)^3), by duplication."""
    total, power = 0.0, 1.0
    mean = (x + y + 3.0 * z) / 5.0
    while max(abs(mean - x), abs(mean - y), abs(mean - z)) > 1e-3 * mean:
        root = math.sqrt(x * y) + math.sqrt(x * z) + math.sqrt(y * z)
        total += 3.0 * power / (math.sqrt(z) * (z + root))
        power *= 0.25
        x, y, z = 0.25 * (x + root), 0.25 * (y + root), 0.25 * (z + root)
        mean = (x + y + 3.0 * z) / 5.0
    return total + power * near_equal_rd(x, y, z)


@twofold(forceinline=True)
def near_equal_rd(x, y, z):
    """Return the integral of `_rd` for numbers that differ little, by its series."""
    mean = (x + y + 3.0 * z) / 5.0
    x, y, z = 1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean
    xy, zz = x * y, z * z
    e2, e3, e4, e5 = xy - 6.0 * zz, (3.0 * xy - 8.0 * zz) * z, 3.0 * (xy - zz) * zz, xy * zz * z
    series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0
    series += 3.0 * e5 / 26.0 - 9.0 * e2 * e3 / 52.0
    return series / (mean * math.sqrt(mean))


@njit
def reluctivity(field, factors, susceptibility, saturation):
    """Return |H|/|M| inside a body in the field `field` (A/m), along its axes; see `magnetize`.

    `saturation` is M_s in A/m, or 0 for a material that does not saturate. Newton's method on the
    reciprocal of a norm that must be 1 converges monotonically, as in trust-region methods.
    """
    q = 1.0 / susceptibility
    if saturation == 0.0 or susceptibility <= 0.0:
        return q
    x, y, z = field[0] / saturation, field[1] / saturation, field[2] / saturation
    for _ in range(LARGEST_COUNT):
        a, b, c = x / (q + factors[0]), y / (q + factors[1]), z / (q + factors[2])
        d = 1.0 / (susceptibility * q)
        square = a * a + b * b + c * c + d * d
        slope = a * a / (q + factors[0]) + b * b / (q + factors[1]) + c * c / (q + factors[2])
        slope += d * d / q
        larger = q + (math.sqrt(square) - 1.0) * square / slope
        if not larger > q:
            break
        q = larger
    return q


@njit
def magnetize(field, factors, susceptibility, saturation):
    """Compute the magnetization of a body, and the energy density that it stores.

    `field` is the field H_0 in A/m along the axes of the ellipsoid that describes the body, and
    `factors` are the demagnetizing factors along these. Returns the magnetization in A/m along
    these axes, and the energy of magnetization and demagnetization,
    mu0 (int H dM + M.N M/2), in J/m^3.
    """
    q = reluctivity(field, factors, susceptibility, saturation)
    x, y, z = field[0] / (q + factors[0]), field[1] / (q + factors[1]), field[2] / (q + factors[2])
    square = x * x + y * y + z * z
    stored = square / (susceptibility + 1.0 / q)
    stored += 0.5 * (factors[0] * x * x + factors[1] * y * y + factors[2] * z * z)
    return x, y, z, VACUUM_PERMEABILITY * stored
