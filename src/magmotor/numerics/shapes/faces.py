"""Flat, uniformly charged faces in a parallel plane: potential, and what integrates it over a face.

A face lies in the plane z = 0, with the charge 1 per area; phi is the integral of 1/r over it. The
integral of phi over a second face at height z is one over the outline of that,

    int phi dA = int U.n dl,    dU_x/dx + dU_y/dy = phi,

where n is the outward normal of the outline in its plane. U and its first derivatives are
continuous, also at z = 0, where grad phi jumps at the outline of the first face.

Of a rectangle, each is a sum over the corners. With X and Y from the corner, and r from it,

    L_x = ln(X + r), L_y = ln(Y + r), M = ln(z + r),
    T_x = atan(Y/X) - atan(Y z/(X r)), T_y = atan(X/Y) - atan(X z/(Y r)),
    U_x = Y r/2 + (X^2 - z^2) L_y/2 - z Y M - z X T_x,

without terms whose sum is zero. Of a disk of radius R, U = 2 pi R I(1, 1, -2), where

    I(m, n, l) = int_0^inf J_m(k R) J_n(k r) exp(-k z) k^l dk.

These integrals are all combinations of I(0, 0, 0), I(1, 1, 0) and I(1, 0, 0), which are complete
elliptic integrals (G. Eason, B. Noble and I. N. Sneddon, Phil. Trans. R. Soc. A 247 (1955) 529).
"""

import math

from magmotor.numerics.deferred import twofold
from magmotor.numerics.elementary import arctangent, logarithm
from magmotor.numerics.rotations import TINY
from magmotor.numerics.shapes.cylinder import end_terms

CUTOFF = 1e-12
"""Least squared distance from the axis of a disk, over that of the rim, by which is divided."""


@twofold(forceinline=True)
def rectangle(x, y, z, a, b):
    """Compute phi of a rectangle and its gradient.

    Parameters
    ----------
    x, y, z : float
        Point in m; z is positive.
    a, b : float
        Half the lengths of the edges along x and y, in m.

    Returns
    -------
    phi, phi_x, phi_y, phi_z : float
        Potential in m, and its derivatives.
    """
    phi = phi_x = phi_y = phi_z = 0.0
    for s, t in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        u, v = x + s * a, y + t * b
        r = math.sqrt(u * u + v * v + z * z)
        log_x, log_y = _logarithm(u, r, v * v + z * z), _logarithm(v, r, u * u + z * z)
        angle = arctangent(u * v, z * r)
        phi += s * t * (u * log_y + v * log_x - z * angle)
        phi_x += s * t * log_y
        phi_y += s * t * log_x
        phi_z -= s * t * angle
    return phi, phi_x, phi_y, phi_z


@twofold(forceinline=True)
def rectangle_flux(x, y, z, a, b):
    """Compute U of a rectangle, and its derivatives U_xx, U_xy = U_yx, U_yy, U_xz and U_yz.

    The parameters are those of `rectangle`.
    """
    u_x = u_y = xx = xy = yy = xz = yz = 0.0
    for s, t in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        u, v = x + s * a, y + t * b
        flat = u * u + v * v
        r = math.sqrt(flat + z * z)
        log_x, log_y = _logarithm(u, r, v * v + z * z), _logarithm(v, r, u * u + z * z)
        log_z = logarithm(z + r + TINY)
        across = u * v * flat / (z + r + TINY)
        turn_x = arctangent(across, u * u * r + v * v * z)
        turn_y = arctangent(across, v * v * r + u * u * z)
        psi = r - z * log_z
        u_x += s * t * (0.5 * (v * r + (u * u - z * z) * log_y) - z * (v * log_z + u * turn_x))
        u_y += s * t * (0.5 * (u * r + (v * v - z * z) * log_x) - z * (u * log_z + v * turn_y))
        xx += s * t * (u * log_y - z * turn_x)
        xy += s * t * psi
        yy += s * t * (v * log_x - z * turn_y)
        xz -= s * t * (v * log_z + z * log_y + u * turn_x)
        yz -= s * t * (u * log_z + z * log_x + v * turn_y)
    return u_x, u_y, xx, xy, yy, xz, yz


@twofold(forceinline=True)
def disk(x, y, z, radius):
    """Compute phi of a disk and its gradient, as `rectangle`."""
    r = math.sqrt(x * x + y * y)
    plain, solenoid, _, phi = end_terms(z, r, radius)
    slope = -4.0 * math.pi * plain
    inside = 0.5 if r < radius else 0.0
    return phi, slope * x, slope * y, 4.0 * math.pi * (z * solenoid - inside)


@twofold(forceinline=True)
def disk_flux(x, y, z, radius):
    """Compute U of a disk and its derivatives, as `rectangle_flux`."""
    square = x * x + y * y
    r = math.sqrt(square)
    plain, solenoid, _, phi = end_terms(z, r, radius)
    # 2 pi R times I(1, 1, 0)/r, I(1, 0, 0), I(1, 0, -1), R I(0, 0, 0).
    i_110, i_100, i_10m = 4.0 * math.pi * plain, -4.0 * math.pi * z * solenoid, phi
    i_100 += 2.0 * math.pi if r < radius else 0.0
    i_000 = (i_10m + square * i_110 + z * i_100) / radius
    # The same of I(0, 1, 0), I(0, 1, -1) and I(1, 1, -1), all over r.
    per_square = 1.0 / (square + CUTOFF * radius * radius)
    i_010 = (2.0 * math.pi * radius - z * i_000 - radius * i_100) * per_square
    i_01m = i_000 - radius * i_110 - z * i_010
    i_11m = 0.5 * (radius * i_010 + i_100 - z * i_110)
    across = (radius * i_01m + i_10m - z * i_11m) / 3.0
    along = (phi - 2.0 * across) * per_square
    return (
        across * x,
        across * y,
        across + along * x * x,
        along * x * y,
        across + along * y * y,
        -i_11m * x,
        -i_11m * y,
    )


@twofold(forceinline=True)
def _logarithm(u, r, square):
    """Return ln(u + r), where r^2 is u^2 and a given square."""
    return logarithm((u + r if u > 0.0 else square / (r - u + TINY)) + TINY)
