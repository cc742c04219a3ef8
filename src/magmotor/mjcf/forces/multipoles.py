"""Dipole, quadrupole and octupole of a group of dipoles, and the field and force that they cause.

The potential of a dipole m at d is (p.r)/r^3 + (r.Q.r)/r^5 + (O:rrr)/r^7 + ..., where

    p = m,    Q = 3/2 (d m + m d) - (d.m) 1,
    O:rrr = 15/2 (d.r)^2 (m.r) - 3 (u.r) r^2,    u = (d.m) d + d^2 m/2.

Q and O are symmetric, and have no traces. The field is B = -grad phi, and the force grad (a.B).
"""

import math

from magmotor.dipoles import inner
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import broadcast, fused, negative, square_root

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
def _dot(a, b):
    return inner(a[0], a[1], a[2], b[0], b[1], b[2])


@subroutine(inline="always")
def _times(m, a):
    """Return the product of a symmetric matrix (xx, xy, xz, yy, yz, zz) and a vector."""
    return (
        inner(m[0], m[1], m[2], a[0], a[1], a[2]),
        inner(m[1], m[3], m[4], a[0], a[1], a[2]),
        inner(m[2], m[4], m[5], a[0], a[1], a[2]),
    )


@subroutine(inline="always")
def _vector_sum(a, i, b, j, c, k):
    """Return a i + b j + c k."""
    return (
        fused(a[0], i, fused(b[0], j, c[0] * k)),
        fused(a[1], i, fused(b[1], j, c[1] * k)),
        fused(a[2], i, fused(b[2], j, c[2] * k)),
    )


@subroutine(inline="always")
def _matrix_sum(a, i, b, j):
    """Return a i + b j."""
    return (
        fused(a[0], i, j * b[0]),
        fused(a[1], i, j * b[1]),
        fused(a[2], i, j * b[2]),
        fused(a[3], i, j * b[3]),
        fused(a[4], i, j * b[4]),
        fused(a[5], i, j * b[5]),
    )


@subroutine(inline="always")
def _vector(table, row, c):
    return broadcast(table[row, c]), broadcast(table[row, c + 1]), broadcast(table[row, c + 2])


@subroutine(inline="always")
def _matrix(table, row, c, xx, xy, xz, yy, yz, zz):
    """Return the elements of a symmetric matrix, whose columns are counted from c on."""
    return (
        broadcast(table[row, c + xx]),
        broadcast(table[row, c + xy]),
        broadcast(table[row, c + xz]),
        broadcast(table[row, c + yy]),
        broadcast(table[row, c + yz]),
        broadcast(table[row, c + zz]),
    )


@subroutine(inline="always")
def multipole_force_and_field(table, k, c, x, y, z, ax, ay, az):
    """Return force on and field at dipoles (ax, ay, az), at (x, y, z) from the moments' center.

    The moments are in row k of a table, from column c on.

    It lacks the factor mu0/(4 pi). With h = p/r^3 + 2 Q.r/r^5 + 3 O:rr/r^7 and
    g = 3 (p.r)/r^5 + 5 (r.Q.r)/r^7 + 7 (O:rrr)/r^9, the field is B = g r - h.
    """
    r, a = (x, y, z), (ax, ay, az)
    p, q = _vector(table, k, c), _matrix(table, k, c + Q, 0, 1, 2, 3, 4, 5)
    o_x = _matrix(table, k, c + O, 0, 1, 2, 3, 4, 5)
    o_y = _matrix(table, k, c + O, 1, 3, 4, 6, 7, 8)
    o_z = _matrix(table, k, c + O, 2, 4, 5, 7, 8, 9)
    two, three, five, seven = broadcast(2.0), broadcast(3.0), broadcast(5.0), broadcast(7.0)
    i2 = broadcast(1.0) / _dot(r, r)
    i3 = i2 * square_root(i2)
    i5 = i3 * i2
    i7 = i5 * i2
    i9 = i7 * i2
    t_x, t_y, t_z = _times(o_x, r), _times(o_y, r), _times(o_z, r)
    t = (t_x[0], t_x[1], t_x[2], t_y[1], t_y[2], t_z[2])  # O.r, symmetric
    u, v = _times(q, r), _times(t, r)
    g3 = three * _dot(p, r) * i5
    g5 = five * _dot(u, r) * i7
    g7 = seven * _dot(v, r) * i9
    g, a_r = g3 + g5 + g7, _dot(a, r)
    two5, three7 = two * i5, three * i7
    h = _vector_sum(p, i3, u, two5, v, three7)
    # The gradient of g is s - (5 g3 + 7 g5 + 9 g7) r/r^2; that of h is p's part of s, and w.
    s = _vector_sum(p, three * i5, u, two * five * i7, v, three * seven * i9)
    steep = negative(i2) * fused(five, g3, fused(seven, g5, broadcast(9.0) * g7))
    both = fused(steep, a_r, _dot(a, s))
    w_a = _times(_matrix_sum(q, two5, t, two * three7), a)
    return (
        fused(both, x, fused(g, ax, fused(a_r, s[0], negative(w_a[0])))),
        fused(both, y, fused(g, ay, fused(a_r, s[1], negative(w_a[1])))),
        fused(both, z, fused(g, az, fused(a_r, s[2], negative(w_a[2])))),
        fused(g, x, negative(h[0])),
        fused(g, y, negative(h[1])),
        fused(g, z, negative(h[2])),
    )
