"""Field and potential of a uniformly polarized cylinder about the z axis, centered at the origin.

With the Newtonian potential W of the cylinder, phi = -J.grad W/(4 pi), so that mu0 H = -N J with
the demagnetizing tensor N = -grad grad W/(4 pi) of the point. In cylindrical coordinates, it has
the elements N_rz, N_zz, N_pp and, as the trace is 1 inside and 0 outside, N_rr. Each is a
difference of two terms, one for each end: complete elliptic integrals that, with C = cos(t) and
S = sin(t), are

    I(a, b, p) = int_0^(pi/2) (a C^2 + b S^2) / ((C^2 + p S^2) sqrt(C^2 + k^2 S^2)) dt.

Here, k is the ratio of the least and the largest distance m from the end's rim. N_rz and N_zz are
those of a solenoid (N. Derby and S. Olbert, Am. J. Phys. 78 (2010) 229). With the height h above
the end and g = (R - r)/(R + r), the term of N_pp is

    R h/(2 pi r m) (I(1, -g^2, g^2) - I(1, -1, 1)),

and the potential of the transverse polarization is N_pp J.(x, y, 0). Descending Landen
transformations find the integrals (R. Bulirsch, Numer. Math. 7 (1965) 78). The first is taken such
that nothing cancels at the axis. Rounding errors are about 1e-15 |J| at any distance, so that the
relative errors grow with its third power.
"""

import math

from magmotor.numerics.deferred import twofold
from magmotor.numerics.rotations import TINY

CUTOFF = 5e-9
"""Least k, which cuts the logarithm off at the rim, and the distance from the curved side at which
a point on it is put outside, in parts of the radius."""

STEPS = 6
"""Landen transformations after the first; each squares the error, and k = 1e-8 needs six."""

DOUBLED = 2.0 ** (STEPS + 1)
"""What the arithmetic-geometric mean is multiplied by."""


@twofold(forceinline=True)
def cylinder_field(x, y, z, radius, half, jx, jy, jz):
    """Compute the field mu0 H of a uniformly polarized cylinder, outside or inside.

    On the surface, this is the field just outside. Components of J across the axis that are zero
    cost nothing, if the compiler knows them.

    Parameters
    ----------
    x, y, z : float
        Point in the frame of the cylinder, whose axis is z, in m.
    radius, half : float
        Radius and half the length, in m.
    jx, jy, jz : float
        Polarization J in T.

    Returns
    -------
    hx, hy, hz : float
        mu0 H in T; inside, B = mu0 H + J.
    """
    inside = 1.0 if cylinder_contains(x, y, z, radius, half) else 0.0
    return _field(x, y, z, radius, half, jx, jy, jz, inside, inside, 0.0)


@twofold(forceinline=True)
def cylinder_potential(x, y, z, radius, half, jx, jy, jz):
    """Compute the potential phi of a uniformly polarized cylinder in T m; mu0 H = -grad phi.

    The parameters are those of `cylinder_field`. The potential is continuous, and zero at infinity.
    """
    r = math.sqrt(x * x + y * y)
    lower, upper = abs(z) + half, abs(z) - half
    _, _, far, far_disk = end_terms(lower, r, radius)
    _, _, near, near_disk = end_terms(upper, r, radius)
    phi = (x * jx + y * jy) * (lower * far - upper * near)
    return phi + math.copysign(0.25 / math.pi, z) * jz * (near_disk - far_disk)


@twofold(forceinline=True)
def cylinder_continued_field(x, y, z, radius, half, jx, jy, jz):
    """Compute `cylinder_field`, but continue the field outside to the inside.

    The field is continued from the nearest end or from the curved side. Both continuations are
    exact: the second adds the field outside a long cylinder, and subtracts the field inside it. It
    is bounded within half the radius, where it has no potential.
    """
    by_side, image = _continuation(x, y, z, radius, half)
    return _field(x, y, z, radius, half, jx, jy, jz, by_side, 0.0, image)


@twofold(forceinline=True)
def cylinder_continued_potential(x, y, z, radius, half, jx, jy, jz):
    """Compute the potential of `cylinder_continued_field`."""
    by_side, image = _continuation(x, y, z, radius, half)
    inside = cylinder_contains(x, y, z, radius, half)
    depth = half - abs(z) if inside and by_side == 0.0 else 0.0
    phi = cylinder_potential(x, y, z, radius, half, jx, jy, jz)
    phi += math.copysign(depth, z) * jz
    return phi + 0.5 * (image - by_side) * (x * jx + y * jy)


@twofold(forceinline=True)
def cylinder_contains(x, y, z, radius, half):
    """Return whether a point is inside, not on the surface."""
    return math.sqrt(x * x + y * y) < radius and abs(z) < half


@twofold(forceinline=True)
def _continuation(x, y, z, radius, half):
    """Return 1 where the curved side is the nearest, and (R/r)^2 there; 0 and 0 elsewhere."""
    r = math.sqrt(x * x + y * y)
    by_side = r < radius and radius - r < half - abs(z)
    ratio = radius / max(r, 0.5 * radius)
    return 1.0 if by_side else 0.0, ratio * ratio if by_side else 0.0


@twofold(forceinline=True)
def _field(x, y, z, radius, half, jx, jy, jz, within, trace, image):
    """Return -N J, where N_zz is that between the ends inside the solenoid if `within` is 1.

    The trace of N is given, as is the image (R/r)^2 that continues the field through the side.
    """
    r = math.sqrt(x * x + y * y)
    lower, upper = abs(z) + half, abs(z) - half
    far_slope, far_solenoid, far, _ = end_terms(lower, r, radius)
    near_slope, near_solenoid, near, _ = end_terms(upper, r, radius)
    slope = math.copysign(1.0, z) * (far_slope - near_slope)
    axial = within - (lower * far_solenoid - upper * near_solenoid)
    hx, hy, hz = -slope * jz * x, -slope * jz * y, -axial * jz
    if jx != 0.0 or jy != 0.0:
        across = lower * far - upper * near + 0.5 * (image - (within - trace))
        along = x * jx + y * jy
        outward = (trace - axial - 2.0 * across) / (r * r + TINY) * along
        hx -= across * jx + outward * x
        hy -= across * jy + outward * y
        hz -= slope * along
    return hx, hy, hz


@twofold(forceinline=True)
def end_terms(h, r, radius):
    """Return the terms of N_rz/r, -N_zz/h and N_pp/h of an end, where h is the height above it.

    The fourth number is the potential of the end as a disk with the charge 1 per area.
    """
    wide, gap = radius + r, radius - r
    gap = gap if gap != 0.0 else -CUTOFF * radius
    square = wide * wide + h * h
    m = math.sqrt(square)
    k = max(math.sqrt(gap * gap + h * h) / m, CUTOFF)
    g = gap / wide
    p, sign = abs(g), math.copysign(1.0, g)
    ratio = k / p
    # The first transformation, of (1, -1, 1)/r, (1, g, g^2) and (1, -g^2, g^2)/r.
    a, b = 0.0, 8.0 * radius / (square * (1.0 + k))
    c, d = 1.0 + 1.0 / g, 2.0 * (sign + ratio)
    f, n = 0.0, 8.0 * radius * (g * g + h * h / square) / (wide * wide * (k + g * g) * p)
    p += ratio
    mean, product = 1.0 + k, k
    for _ in range(STEPS):
        root = 2.0 * math.sqrt(product)
        product = root * mean
        both = 1.0 / (mean * p)
        by_mean, by_p = both * p, both * mean
        a, b = a + b * by_mean, 2.0 * (b + a * root)
        ratio = product * by_p
        c, d = c + d * by_p, 2.0 * (d + c * ratio)
        f, n = f + n * by_p, 2.0 * (n + f * ratio)
        p += ratio
        mean += root
    plain = radius / (4.0 * m * mean * mean) * (b + a * mean)
    scale = 0.5 * radius / (m * mean * (mean + p))
    solenoid = scale * (d + c * mean) / wide
    ring = 0.5 * DOUBLED * radius * radius / (m * mean)
    disk = ring - r * r * plain + h * h * solenoid
    disk = 4.0 * math.pi * disk - (2.0 * math.pi * abs(h) if gap > 0.0 else 0.0)
    return plain, solenoid, 0.5 * scale * (n + f * mean) + 0.5 * plain, disk
