"""Field and potential of a uniformly polarized ellipsoid, or sphere, centered at the origin.

Its semi-axes a_i are along the axes of the frame. The potential is

    phi = sum_i J_i x_i N_i, where N_i = (a_1 a_2 a_3/2) int_l^inf ds / ((s + a_i^2) D(s)),
    D(s)^2 = (s + a_1^2)(s + a_2^2)(s + a_3^2),

and l is the largest root of sum_i x_i^2/(l + a_i^2) = 1, or 0 inside, where N_i is a demagnetizing
factor (J. A. Stratton, *Electromagnetic Theory*, 1941, section 3.27). The sum of all N_i is
a_1 a_2 a_3/D(l). They are found by duplication (B. C. Carlson, Numer. Algorithms 10 (1995) 13).

With l slightly below 0, this is the field outside, continued to the inside. It is bounded where
l < -3/4 of the least a_i^2: there, l is constant, or for a sphere N_i is linear in l. Rounding
errors are relative to the field.
"""

import math

from magmotor.numerics.deferred import twofold
from magmotor.numerics.demagnetization import near_equal_rd
from magmotor.numerics.elementary import arctangent, cosine
from magmotor.numerics.rotations import TINY

DEEPEST = 0.75
"""Fraction of the least a_i^2 to which the field is continued: half the radius of a sphere."""

DUPLICATIONS = 5
"""Number of duplications, each of which divides the differences of three numbers by four."""

REFINEMENTS = 2
"""Steps of Newton's method, which remove the rounding errors of the root in closed form."""

PER_TURN = 0.5 / math.pi


@twofold(forceinline=True)
def ellipsoid_field(x, y, z, a, b, c, jx, jy, jz):
    """Compute the field mu0 H of a uniformly polarized ellipsoid, outside or inside.

    Parameters
    ----------
    x, y, z : float
        Point in the frame of the ellipsoid, in m.
    a, b, c : float
        Semi-axes along x, y and z, in m.
    jx, jy, jz : float
        Polarization J in T.

    Returns
    -------
    hx, hy, hz : float
        mu0 H in T; inside, B = mu0 H + J.
    """
    depth = 0.0 if ellipsoid_contains(x, y, z, a, b, c) else DEEPEST
    hx, hy, hz, _ = _field_and_potential(x, y, z, a, b, c, jx, jy, jz, depth)
    return hx, hy, hz


@twofold(forceinline=True)
def ellipsoid_potential(x, y, z, a, b, c, jx, jy, jz):
    """Compute the potential phi of a uniformly polarized ellipsoid in T m; mu0 H = -grad phi.

    The parameters are those of `ellipsoid_field`. The potential is continuous, and zero at
    infinity.
    """
    return _field_and_potential(x, y, z, a, b, c, jx, jy, jz, 0.0)[3]


@twofold(forceinline=True)
def ellipsoid_continued_field(x, y, z, a, b, c, jx, jy, jz):
    """Compute `ellipsoid_field`, but continue the field outside to the inside."""
    hx, hy, hz, _ = _field_and_potential(x, y, z, a, b, c, jx, jy, jz, DEEPEST)
    return hx, hy, hz


@twofold(forceinline=True)
def ellipsoid_continued_potential(x, y, z, a, b, c, jx, jy, jz):
    """Compute the potential of `ellipsoid_continued_field`."""
    return _field_and_potential(x, y, z, a, b, c, jx, jy, jz, DEEPEST)[3]


@twofold(forceinline=True)
def ellipsoid_contains(x, y, z, a, b, c):
    """Return whether a point is inside, not on the surface."""
    u, v, w = x / a, y / b, z / c
    return u * u + v * v + w * w < 1.0


@twofold(forceinline=True)
def sphere_field(x, y, z, radius, jx, jy, jz):
    """Compute the field mu0 H of a uniformly polarized sphere in T: a dipole's, or -J/3 inside."""
    square = x * x + y * y + z * z
    inside = square < radius * radius
    factor = _sphere_factor(radius, radius * radius if inside else square)
    slope = 0.0 if inside else 3.0 * factor / square
    return _field_of_factor(x, y, z, factor, slope, jx, jy, jz)


@twofold(forceinline=True)
def sphere_potential(x, y, z, radius, jx, jy, jz):
    """Compute the potential phi of a uniformly polarized sphere in T m; mu0 H = -grad phi."""
    square = max(x * x + y * y + z * z, radius * radius)
    return (x * jx + y * jy + z * jz) * _sphere_factor(radius, square)


@twofold(forceinline=True)
def sphere_continued_field(x, y, z, radius, jx, jy, jz):
    """Compute the field of a dipole, which is bounded within half the radius.

    It is continuous there, since charges that stand for a sphere are on that surface.
    """
    factor, slope = _continued_factor(radius, x * x + y * y + z * z)
    return _field_of_factor(x, y, z, factor, slope, jx, jy, jz)


@twofold(forceinline=True)
def sphere_continued_potential(x, y, z, radius, jx, jy, jz):
    """Compute the potential of `sphere_continued_field`."""
    factor, _ = _continued_factor(radius, x * x + y * y + z * z)
    return (x * jx + y * jy + z * jz) * factor


@twofold(forceinline=True)
def _field_of_factor(x, y, z, factor, slope, jx, jy, jz):
    """Return the field whose potential is a factor times J.x, given twice its slope by -r^2."""
    along = slope * (x * jx + y * jy + z * jz)
    return along * x - factor * jx, along * y - factor * jy, along * z - factor * jz


@twofold(forceinline=True)
def _continued_factor(radius, square):
    """Return R^3/(3 r^3) and twice its slope by -r^2; that is constant within half the radius."""
    farther = max(square, (1.0 - DEEPEST) * radius * radius)
    factor = _sphere_factor(radius, farther)
    slope = 3.0 * factor / farther
    return factor + 0.5 * slope * (farther - square), slope


@twofold(forceinline=True)
def _sphere_factor(radius, square):
    """Return R^3/(3 r^3), where r^2 is given."""
    ratio = radius / math.sqrt(square)
    return ratio * ratio * ratio / 3.0


@twofold(forceinline=True)
def _field_and_potential(x, y, z, a, b, c, jx, jy, jz, deepest):
    """Return mu0 H and phi, where l is at least -`deepest` times the least a_i^2."""
    aa, bb, cc = a * a, b * b, c * c
    least = -deepest * min(aa, bb, cc)
    root = _confocal(x * x, y * y, z * z, aa, bb, cc, least)
    p, q, r = 1.0 / (root + aa), 1.0 / (root + bb), 1.0 / (root + cc)
    common = math.sqrt((aa * p) * (bb * q) * (cc * r))
    nx, ny = _factors(root + aa, root + bb, root + cc)
    nx, ny = a * b * c / 3.0 * nx, a * b * c / 3.0 * ny
    nz = common - nx - ny
    phi = x * jx * nx + y * jy * ny + z * jz * nz
    u, v, w = x * p, y * q, z * r
    slope = common * (u * jx + v * jy + w * jz) / (u * u + v * v + w * w + TINY)
    slope = slope if root > least else 0.0
    return slope * u - nx * jx, slope * v - ny * jy, slope * w - nz * jz, phi


@twofold(forceinline=True)
def _confocal(xx, yy, zz, aa, bb, cc, least):
    """Return the largest root l of xx/(l + aa) + yy/(l + bb) + zz/(l + cc) = 1, at least `least`.

    It is the largest eigenvalue of the matrix x x^T - diag(aa, bb, cc), found by trigonometry.
    """
    mean = (xx - aa + yy - bb + zz - cc) / 3.0
    p, q, r = xx - aa - mean, yy - bb - mean, zz - cc - mean
    square = (p * p + q * q + r * r + 2.0 * (xx * yy + xx * zz + yy * zz)) / 6.0
    half = 0.5 * (p * q * r + xx * yy * zz * 2.0 - p * yy * zz - q * xx * zz - r * xx * yy)
    sine = math.sqrt(max(square * square * square - half * half, 0.0))
    angle = arctangent(sine, half) / 3.0
    root = max(mean + 2.0 * math.sqrt(square) * cosine(PER_TURN * angle), least)
    for _ in range(REFINEMENTS):
        p, q, r = 1.0 / (root + aa), 1.0 / (root + bb), 1.0 / (root + cc)
        total = xx * p + yy * q + zz * r
        slope = xx * p * p + yy * q * q + zz * r * r + TINY
        root = max(root + total * (total - 1.0) / slope, least)
    return root


@twofold(forceinline=True)
def _factors(x, y, z):
    """Return R_D(y, z, x) and R_D(x, z, y), Carlson's integrals."""
    first, second, power = 0.0, 0.0, 1.0
    for _ in range(DUPLICATIONS):
        u, v, w = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        root = u * v + u * w + v * w
        first += 3.0 * power / (u * (x + root))
        second += 3.0 * power / (v * (y + root))
        power *= 0.25
        x, y, z = 0.25 * (x + root), 0.25 * (y + root), 0.25 * (z + root)
    return first + power * near_equal_rd(y, z, x), second + power * near_equal_rd(x, z, y)
