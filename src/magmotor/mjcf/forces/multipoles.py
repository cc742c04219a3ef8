"""Dipole, quadrupole and octupole of a group of dipoles, and the field and force that they cause.

The potential of a dipole m at d is (p.r)/r^3 + (r.Q.r)/r^5 + (O:rrr)/r^7 + ..., where

    p = m,    Q = 3/2 (d m + m d) - (d.m) 1,
    O:rrr = 15/2 (d.r)^2 (m.r) - 3 (u.r) r^2,    u = (d.m) d + d^2 m/2.

Q and O are symmetric, and have no traces. The field is B = -grad phi, and the force grad (a.B).
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from magmotor.dipoles import inner
from magmotor.numerics.simd import broadcast, fused, negative, square_root
from magmotor.numerics.subroutine import subroutine

P, Q, O, POWER, COUNTED = 0, 3, 9, 19, 20
"""Columns of the moments: 3 of p, 6 of Q, 10 of O (lexicographic), and the square of the next."""


@subroutine(inline="always")
def moments_of(x, y, z, a, b, c):
    """Return the moments of dipoles (a, b, c) at (x, y, z), and an estimate of the next squared.

    The estimate holds for moments of random directions.
    """
    three, half, one_half = broadcast(3.0), broadcast(0.5), broadcast(1.5)
    five_halves = broadcast(2.5)
    along, square = inner(x, y, z, a, b, c), inner(x, y, z, x, y, z)
    u, v, w = (
        fused(along, x, half * square * a),
        fused(along, y, half * square * b),
        fused(along, z, half * square * c),
    )
    xx, xy, xz, yy, yz, zz = x * x, x * y, x * z, y * y, y * z, z * z
    return (
        a, b, c,
        three * x * a - along, one_half * fused(x, b, y * a), one_half * fused(x, c, z * a),
        three * y * b - along, one_half * fused(y, c, z * b),
        three * z * c - along,
        three * (five_halves * xx * a - u),
        five_halves * fused(xx, b, xy * (a + a)) - v,
        five_halves * fused(xx, c, xz * (a + a)) - w,
        five_halves * fused(yy, a, xy * (b + b)) - u,
        five_halves * fused(xy, c, fused(xz, b, yz * a)),
        five_halves * fused(zz, a, xz * (c + c)) - u,
        three * (five_halves * yy * b - v),
        five_halves * fused(yy, c, yz * (b + b)) - w,
        five_halves * fused(zz, b, yz * (c + c)) - v,
        three * (five_halves * zz * c - w),
        inner(a, b, c, a, b, c) * square * square * square,
    )  # fmt: skip


@subroutine
def next_moment(moments, radius):
    """Estimate the first moment left out, sum of m d^3, by those found and by random directions."""
    p, q, o = moments[P:Q], moments[Q:O], moments[O:POWER]
    dipole = p[0] ** 2 + p[1] ** 2 + p[2] ** 2
    quadrupole = q[0] ** 2 + q[3] ** 2 + q[5] ** 2 + 2 * (q[1] ** 2 + q[2] ** 2 + q[4] ** 2)
    octupole = o[0] ** 2 + o[6] ** 2 + o[9] ** 2 + 6 * o[4] ** 2
    for k in (1, 2, 3, 5, 7, 8):
        octupole += 3 * o[k] ** 2
    square = radius * radius
    largest = max(
        moments[POWER],
        dipole * square * square * square,
        quadrupole * 2 / 9 * square * square,
        octupole * 2 / 25 * square,
    )
    return math.sqrt(largest)


@subroutine(inline="always")
def multipole_force_and_field(table, k, c, x, y, z, ax, ay, az):
    """Return force on and field at dipoles (ax, ay, az), at (x, y, z) from the moments' center.

    The moments are in row k of a table, from column c on.

    It lacks the factor mu0/(4 pi). With h = p/r^3 + 2 Q.r/r^5 + 3 O:rr/r^7 and
    g = 3 (p.r)/r^5 + 5 (r.Q.r)/r^7 + 7 (O:rrr)/r^9, the field is B = g r - h.
    """
    px, py, pz = broadcast(table[k, c]), broadcast(table[k, c + 1]), broadcast(table[k, c + 2])
    qxx, qxy, qxz = (
        broadcast(table[k, c + 3]),
        broadcast(table[k, c + 4]),
        broadcast(table[k, c + 5]),
    )
    qyy, qyz, qzz = (
        broadcast(table[k, c + 6]),
        broadcast(table[k, c + 7]),
        broadcast(table[k, c + 8]),
    )
    oxxx, oxxy, oxxz = (
        broadcast(table[k, c + 9]),
        broadcast(table[k, c + 10]),
        broadcast(table[k, c + 11]),
    )
    oxyy, oxyz, oxzz = (
        broadcast(table[k, c + 12]),
        broadcast(table[k, c + 13]),
        broadcast(table[k, c + 14]),
    )
    oyyy, oyyz, oyzz = (
        broadcast(table[k, c + 15]),
        broadcast(table[k, c + 16]),
        broadcast(table[k, c + 17]),
    )
    ozzz = broadcast(table[k, c + 18])
    two, three, five, seven = broadcast(2.0), broadcast(3.0), broadcast(5.0), broadcast(7.0)
    i2 = broadcast(1.0) / inner(x, y, z, x, y, z)
    i3 = i2 * square_root(i2)
    i5 = i3 * i2
    i7 = i5 * i2
    i9 = i7 * i2
    txx, txy, txz = (
        inner(oxxx, oxxy, oxxz, x, y, z),
        inner(oxxy, oxyy, oxyz, x, y, z),
        inner(oxxz, oxyz, oxzz, x, y, z),
    )
    tyy, tyz, tzz = (
        inner(oxyy, oyyy, oyyz, x, y, z),
        inner(oxyz, oyyz, oyzz, x, y, z),
        inner(oxzz, oyzz, ozzz, x, y, z),
    )
    ux, uy, uz = (
        inner(qxx, qxy, qxz, x, y, z),
        inner(qxy, qyy, qyz, x, y, z),
        inner(qxz, qyz, qzz, x, y, z),
    )
    vx, vy, vz = (
        inner(txx, txy, txz, x, y, z),
        inner(txy, tyy, tyz, x, y, z),
        inner(txz, tyz, tzz, x, y, z),
    )
    p_r, q_r, o_r, a_r = (
        inner(px, py, pz, x, y, z),
        inner(ux, uy, uz, x, y, z),
        inner(vx, vy, vz, x, y, z),
        inner(ax, ay, az, x, y, z),
    )
    g3, g5, g7 = three * p_r * i5, five * q_r * i7, seven * o_r * i9
    g = g3 + g5 + g7
    two5, three7 = two * i5, three * i7
    bx = fused(g, x, negative(fused(px, i3, fused(ux, two5, vx * three7))))
    by = fused(g, y, negative(fused(py, i3, fused(uy, two5, vy * three7))))
    bz = fused(g, z, negative(fused(pz, i3, fused(uz, two5, vz * three7))))
    # The gradient of g is s - (5 g3 + 7 g5 + 9 g7) r/r^2; that of h is p's part of s, and (w).
    three5, ten7, ones9 = three * i5, two * five * i7, three * seven * i9
    sx = fused(px, three5, fused(ux, ten7, vx * ones9))
    sy = fused(py, three5, fused(uy, ten7, vy * ones9))
    sz = fused(pz, three5, fused(uz, ten7, vz * ones9))
    steep = negative(i2) * fused(five, g3, fused(seven, g5, broadcast(9.0) * g7))
    both = fused(steep, a_r, inner(ax, ay, az, sx, sy, sz))
    six7 = two * three7
    wxx, wxy, wxz = (
        fused(qxx, two5, six7 * txx),
        fused(qxy, two5, six7 * txy),
        fused(qxz, two5, six7 * txz),
    )
    wyy, wyz, wzz = (
        fused(qyy, two5, six7 * tyy),
        fused(qyz, two5, six7 * tyz),
        fused(qzz, two5, six7 * tzz),
    )
    return (
        fused(both, x, fused(g, ax, fused(a_r, sx, negative(inner(wxx, wxy, wxz, ax, ay, az))))),
        fused(both, y, fused(g, ay, fused(a_r, sy, negative(inner(wxy, wyy, wyz, ax, ay, az))))),
        fused(both, z, fused(g, az, fused(a_r, sz, negative(inner(wxz, wyz, wzz, ax, ay, az))))),
        bx,
        by,
        bz,
    )
