"""Flat, uniformly charged faces: potential, and what integrates it over another face.

A face lies in the plane z = 0, with the charge 1 per area; phi is the integral of 1/r over it. In
the planes above, there are vectors U and V with

    dU_x/dx + dU_y/dy = phi,    dV_x/dx + dV_y/dy = -dphi/dz,    dU/dz = -V,    dV/dz = grad phi,

so that integrals of phi over a second face become integrals over its outline. The potential has a
kink at z = 0, and its derivative jumps at the outline of the first face; V is continuous, and U has
continuous derivatives.

Of a rectangle, each is a sum over the corners. With X and Y from the corner, and r from it,

    L_x = ln(X + r), L_y = ln(Y + r), M = ln(z + r),
    T_x = atan(Y/X) - atan(Y z/(X r)), T_y = atan(X/Y) - atan(X z/(Y r)),
    U_x = Y r/2 + (X^2 - z^2) L_y/2 - z Y M - z X T_x,    V_x = Y M + z L_y + X T_x,

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
    """Compute phi, V and U of a rectangle, and their derivatives.

    What is not used costs nothing, if the compiler knows it.

    Parameters
    ----------
    x, y, z : float
        Point in m; z is positive.
    a, b : float
        Half the lengths of the edges along x and y, in m.

    Returns
    -------
    phi : tuple of float
        The potential in m, and its derivatives along x, y and z.
    v : tuple of float
        V_x and V_y, in m^2 per m, and the derivatives V_xx, V_xy = V_yx and V_yy.
    u : tuple of float
        The same of U in m^2.
    """
    phi = phi_x = phi_y = phi_z = 0.0
    v_x = v_y = v_xx = v_xy = v_yy = 0.0
    u_x = u_y = u_xx = u_xy = u_yy = 0.0
    for s, t in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        sign, p, q = s * t, x + s * a, y + t * b
        flat = p * p + q * q
        r = math.sqrt(flat + z * z)
        log_x, log_y = _logarithm(p, r, q * q + z * z), _logarithm(q, r, p * p + z * z)
        log_z = logarithm(z + r + TINY)
        both = p * q * flat / (z + r + TINY)
        turn_x = arctangent(both, p * p * r + q * q * z)
        turn_y = arctangent(both, q * q * r + p * p * z)
        angle = arctangent(p * q, z * r)
        phi += sign * (p * log_y + q * log_x - z * angle)
        phi_x, phi_y, phi_z = phi_x + sign * log_y, phi_y + sign * log_x, phi_z - sign * angle
        v_x += sign * (q * log_z + z * log_y + p * turn_x)
        v_y += sign * (p * log_z + z * log_x + q * turn_y)
        v_xx, v_xy, v_yy = v_xx + sign * turn_x, v_xy + sign * log_z, v_yy + sign * turn_y
        u_x += sign * (0.5 * (q * r + (p * p - z * z) * log_y) - z * (q * log_z + p * turn_x))
        u_y += sign * (0.5 * (p * r + (q * q - z * z) * log_x) - z * (p * log_z + q * turn_y))
        u_xx += sign * (p * log_y - z * turn_x)
        u_xy += sign * (r - z * log_z)
        u_yy += sign * (q * log_x - z * turn_y)
    return (
        (phi, phi_x, phi_y, phi_z),
        (v_x, v_y, v_xx, v_xy, v_yy),
        (u_x, u_y, u_xx, u_xy, u_yy),
    )


@twofold(forceinline=True)
def disk(x, y, z, radius):
    """Compute phi, V and U of a disk, and their derivatives, as `rectangle`."""
    square = x * x + y * y
    r = math.sqrt(square)
    plain, solenoid, _, phi = end_terms(z, r, radius)
    # 2 pi R times I(1, 1, 0)/r, I(1, 0, 0) and R I(0, 0, 0), where phi is that times I(1, 0, -1).
    i_110, i_100 = 4.0 * math.pi * plain, -4.0 * math.pi * z * solenoid
    i_100 += 2.0 * math.pi if r < radius else 0.0
    i_000 = (phi + square * i_110 + z * i_100) / radius
    # The same times I(0, 1, 0)/r, I(0, 1, -1)/r, V/r and U/r.
    per_square = 1.0 / (square + CUTOFF * radius * radius)
    i_010 = (2.0 * math.pi * radius - z * i_000 - radius * i_100) * per_square
    i_01m = i_000 - radius * i_110 - z * i_010
    v = 0.5 * (radius * i_010 + i_100 - z * i_110)
    u = (radius * i_01m + phi - z * v) / 3.0
    more_v, more_u = (i_100 - 2.0 * v) * per_square, (phi - 2.0 * u) * per_square
    return (
        (phi, -i_110 * x, -i_110 * y, -i_100),
        (v * x, v * y, v + more_v * x * x, more_v * x * y, v + more_v * y * y),
        (u * x, u * y, u + more_u * x * x, more_u * x * y, u + more_u * y * y),
    )


@twofold(forceinline=True)
def _logarithm(u, r, square):
    """Return ln(u + r), where r^2 is u^2 and a given square."""
    return logarithm((u + r if u > 0.0 else square / (r - u + TINY)) + TINY)
