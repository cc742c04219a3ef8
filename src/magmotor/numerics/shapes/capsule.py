"""Field and potential of a uniformly polarized capsule about the z axis, centered at the origin.

A capsule is a cylinder with two hemispherical caps. The potentials of the caps' charges J.n have a
closed form. With u the potential of the whole sphere, u above the cap's plane, and 0 below it, is
the potential of the cap, and of charges and dipoles on the plane. Their density is linear within
the rim, and outside falls off as the field of a dipole: inversion in the sphere, r -> (R/s)^2 r at
the distance s from its center, turns this into the same linear density within the rim. With the
height h above the plane, the solid angles W of the rim's disk at the point and W' at the inverse
point, the potential P of the rim as a ring of the charge 1 per length, and -r Q the radial
derivative of the potential of the charged disk, the plane has

    phi_z = (2 R P - r^2 (1 + (R/s)^2) Q - h (W + (R/s)^3 W'))/(12 pi),
    phi_x = -x (W + (R/s)^3 W' - h (1 + (R/s)^2) Q)/(12 pi)

for J = 1 along z and x. All distances from the rim are scaled by R/s at the inverse point, so that
the elliptic integrals of both points, as those of the side, have one modulus; see `cylinder.py` for
them. As there, mu0 H = -N J is found with the trace of N and the potential along x, from the
derivatives of phi_z. Near the center of a cap, where these terms diverge, powers of s are summed.

Rounding errors are about 1e-15 |J| at any distance, and up to 1e-12 |J| near the center of a cap.
"""

import math

from magmotor.numerics.deferred import subroutine, twofold
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.rotations import TINY
from magmotor.numerics.shapes.cylinder import CUTOFF, DOUBLED, STEPS

NEAR_CENTER = 0.05
"""Distance from the center of a cap, in radii, below which powers of it are summed."""

POWERS = (0.25, 1 / 6, 1 / 16, 0.0, -1 / 96, 0.0, 1 / 256, 0.0, -1 / 512)
"""Halves of the integrals of t P_l(t) from 0 to 1, by which the cap's potential is a sum."""

AT_PLANE = (1.0, 0.0, -1 / 2, 0.0, 3 / 8, 0.0, -5 / 16, 0.0, 35 / 128)
"""P_l(0)."""

DEEPEST = 0.5
"""Distance from the axis, in radii, to which the field is continued."""


@twofold(forceinline=True)
def capsule_field(x, y, z, radius, half, jx, jy, jz):
    """Compute the field mu0 H of a uniformly polarized capsule, outside or inside.

    On the surface, this is the field just outside.

    Parameters
    ----------
    x, y, z : float
        Point in the frame of the capsule, whose axis is z, in m.
    radius, half : float
        Radius, and half the length of the cylinder between the caps, in m.
    jx, jy, jz : float
        Polarization J in T.

    Returns
    -------
    hx, hy, hz : float
        mu0 H in T; inside, B = mu0 H + J.
    """
    return _field(x, y, z, radius, half, jx, jy, jz, radius)


@twofold(forceinline=True)
def capsule_potential(x, y, z, radius, half, jx, jy, jz):
    """Compute the potential phi of a uniformly polarized capsule in T m; mu0 H = -grad phi.

    The parameters are those of `capsule_field`. The potential is continuous, and zero at infinity.
    """
    return _potential(x, y, z, radius, half, jx, jy, jz, radius)


@twofold(forceinline=True)
def capsule_continued_field(x, y, z, radius, half, jx, jy, jz):
    """Compute `capsule_field`, but continue the field outside to the inside, to half the radius."""
    return _field(x, y, z, radius, half, jx, jy, jz, DEEPEST * radius)


@subroutine
def set_continued_capsule_fields(room, count, capsule):
    """Write these fields to rows 4 to 6, at points in rows 0 to 2; `capsule` is the rest."""
    prefer_wide_vectors()
    radius, half, jx, jy, jz = capsule
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    for k in range(count):
        hx[k], hy[k], hz[k] = capsule_continued_field(x[k], y[k], z[k], radius, half, jx, jy, jz)


@twofold(forceinline=True)
def capsule_continued_potential(x, y, z, radius, half, jx, jy, jz):
    """Compute the potential of `capsule_continued_field`."""
    return _potential(x, y, z, radius, half, jx, jy, jz, DEEPEST * radius)


@twofold(forceinline=True)
def capsule_contains(x, y, z, radius, half):
    """Return whether a point is inside, not on the surface."""
    h = max(abs(z) - half, 0.0)
    return x * x + y * y + h * h < radius * radius


@twofold(forceinline=True)
def _field(x, y, z, radius, half, jx, jy, jz, core):
    """Return -N J, where the field outside is continued to the distance `core` from the axis."""
    across, _, axial, slope, trace = _terms(x, y, z, radius, half, core)
    outward = (trace - axial - 2.0 * across) / (x * x + y * y + TINY)
    along = x * jx + y * jy
    common = outward * along + slope * jz
    return -across * jx - common * x, -across * jy - common * y, -axial * jz - slope * along


@twofold(forceinline=True)
def _potential(x, y, z, radius, half, jx, jy, jz, core):
    """Return the potential of that field."""
    across, phi, _, _, _ = _terms(x, y, z, radius, half, core)
    return (x * jx + y * jy) * across + phi * jz


@twofold(forceinline=True)
def _terms(x, y, z, radius, half, core):
    """Return N_pp, the potential of J along z, N_zz, N_rz/r and the trace of N."""
    r = math.sqrt(x * x + y * y)
    below, above = -abs(z) - half, abs(z) - half
    far, far_phi, far_axial, far_slope = _end(below, r, radius)
    near, near_phi, near_axial, near_slope = _end(above, r, radius)
    across, axial, slope = far + near, far_axial + near_axial, near_slope - far_slope
    phi = near_phi - far_phi
    # The sphere of the near cap, above its plane, or the side below that: a dipole, or a pair of
    # lines, outside the core, and a uniform field in it.
    cap = math.copysign(1.0, above) > 0.0
    h = above if cap else 0.0
    square = r * r + h * h
    deep = square < core * core
    ratio = radius * radius / (core * core if deep else square)
    factor = ratio * math.sqrt(ratio) / 3.0
    steep = 0.0 if deep or not cap else 3.0 * factor / square
    side = 0.5 * (ratio - 1.0) if square < radius * radius else 0.0
    trace = (3.0 * factor if cap else ratio) if deep else 0.0
    axial += factor - steep * h * h if cap else 0.0
    across += factor if cap else side
    sign = math.copysign(1.0, z)
    return across, sign * (phi + factor * h), axial, sign * (slope - steep * h), trace


@twofold(forceinline=True)
def _end(h, r, radius):
    """Return the terms of N_pp, of the potential, N_zz and N_rz/r of the plane of a cap.

    The height h above the plane is that outwards. The half of the side that ends there is included.
    """
    wide, gap = radius + r, radius - r
    gap = gap if gap != 0.0 else -CUTOFF * radius
    least = NEAR_CENTER * radius
    apart = r * r + h * h
    central = apart < least * least
    s2 = least * least if central else apart
    inverse = s2 - r * radius
    inverse = inverse if inverse != 0.0 else -CUTOFF * s2
    square = wide * wide + h * h
    m = math.sqrt(square)
    k = max(math.sqrt(gap * gap + h * h) / m, CUTOFF)
    g, image = gap / wide, inverse / (s2 + r * radius)
    p, v = abs(g), abs(image)
    ratio, turned = k / p, k / v
    # The first transformation, as in `cylinder.py`, and of the solid angle at the inverse point.
    a, b = 0.0, 8.0 * radius / (square * (1.0 + k))
    c, d = 1.0 + 1.0 / g, 2.0 * (math.copysign(1.0, g) + ratio)
    f, n = 0.0, 8.0 * radius * (g * g + h * h / square) / (wide * wide * (k + g * g) * p)
    e, o = 1.0 + 1.0 / image, 2.0 * (math.copysign(1.0, image) + turned)
    p += ratio
    v += turned
    mean, product = 1.0 + k, k
    for _ in range(STEPS):
        root = 2.0 * math.sqrt(product)
        product = root * mean
        by_mean, by_p, by_v = 1.0 / mean, 1.0 / p, 1.0 / v
        a, b = a + b * by_mean, 2.0 * (b + a * root)
        ratio, turned = product * by_p, product * by_v
        c, d = c + d * by_p, 2.0 * (d + c * ratio)
        f, n = f + n * by_p, 2.0 * (n + f * ratio)
        e, o = e + o * by_v, 2.0 * (o + e * turned)
        p += ratio
        v += turned
        mean += root
    disk = radius / (4.0 * m * mean * mean) * (b + a * mean)  # Q/(4 pi)
    ring = 0.5 * DOUBLED * radius * radius / (m * mean)  # R P/(4 pi)
    scale = 0.5 * radius / (m * mean * (mean + p))
    half_turn = math.copysign(0.5, h)
    angle = (half_turn if gap > 0.0 else 0.0) - h * scale * (d + c * mean) / wide  # W/(4 pi)
    side = 0.5 * scale * (n + f * mean) + 0.5 * disk
    q = radius * radius / s2
    there = 0.5 * radius * radius * q / (m * mean * (mean + v) * (s2 + r * radius))
    angle_there = (half_turn * q * math.sqrt(q) if inverse > 0.0 else 0.0) - h * there * (
        o + e * mean
    )
    both, twice = angle + angle_there, (1.0 + q) * disk
    common = 3.0 * (q * r * r * disk + h * angle_there) - ring
    across = -(both - h * twice) / 3.0
    phi = (2.0 * ring - r * r * twice - h * both) / 3.0
    axial = (h * common / s2 - both) / 3.0
    slope = (common / s2 - twice) / 3.0
    if central:
        across, phi, axial, slope = _near_center(h / radius, r / radius)
        phi, slope = radius * phi, slope / radius
    return across - h * side, phi, axial, slope


@twofold(forceinline=True)
def _near_center(h, r):
    """Return what the plane of a cap of radius 1 has near its center, as `_end` without the side.

    The solid harmonics `power` are s^l P_l(h/s), and `derivative` are s^(l-1) P_l'(h/s); `last` is
    for l - 1. The sphere, which is not of the plane, is subtracted above that.
    """
    square = h * h + r * r
    power, derivative, last, last_derivative = h, 1.0, 1.0, 0.0
    across, phi, axial, slope = 0.0, POWERS[0], 0.0, 0.0
    for l in range(1, len(POWERS)):
        across += (2.0 * POWERS[l] - 0.5 * AT_PLANE[l]) / (l * (l + 1)) * derivative
        phi += POWERS[l] * power
        axial += POWERS[l] * l * last
        slope -= POWERS[l] * last_derivative
        following = ((2 * l + 1) * h * power - l * square * last) / (l + 1)
        derivative, last_derivative = (l + 1) * power + h * derivative, derivative
        power, last = following, power
    sphere = 1.0 / 3.0 if math.copysign(1.0, h) > 0.0 else 0.0
    return across - sphere, phi - sphere * h, axial - sphere, slope
