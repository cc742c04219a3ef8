"""Demagnetizing factors of ellipsoids.

The field inside an ellipsoid is H = H_0 - N M, where H_0 is the field from outside, M the
magnetization and N the tensor of the demagnetizing factors.
"""

import math

from magmotor.numerics.deferred import jitable, twofold

VACUUM_PERMEABILITY = 4e-7 * math.pi
"""mu0 in T m/A; see `magmotor.dipoles.PERMEABILITY_OVER_4PI`."""


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
