"""Interpolation of a vector field on a regular grid, and its derivatives.

Cubic convolution (R. G. Keys, IEEE Trans. ASSP 29 (1981) 1153) along each axis: the interpolant has
continuous derivatives, reproduces quadratic functions, also in the outermost cells, and has an
error of third order in the spacing.
"""

import math

from magmotor.numerics.deferred import jitable

FEWEST = 4
"""Smallest number of nodes along an axis."""

ROUNDED = 1e-6
"""Distance beyond the outermost nodes, in spacings, that counts as a rounding error of a place."""


@jitable
def interpolate(place, counts, nodes):
    """Return the three components of a field at a place, and their derivatives; NaN outside.

    `place` is in units of the spacing from the first node, `counts` are the numbers of nodes along
    x, y and z, and `nodes` has the components of each node, z fastest. The derivatives, in units of
    the spacing, are (dBx/dx, dBx/dy, dBx/dz, dBy/dx, ...).
    """
    i, x, dx = _weights(place[0], counts[0])
    j, y, dy = _weights(place[1], counts[1])
    k, z, dz = _weights(place[2], counts[2])
    bx = by = bz = 0.0
    xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
    for a in range(4):
        for b in range(4):
            start = 3 * (((i + a) * counts[1] + j + b) * counts[2] + k)
            along_x = along_y = along_z = slope_x = slope_y = slope_z = 0.0
            for c in range(4):
                p, q, r = nodes[start + 3 * c], nodes[start + 3 * c + 1], nodes[start + 3 * c + 2]
                along_x += z[c] * p
                along_y += z[c] * q
                along_z += z[c] * r
                slope_x += dz[c] * p
                slope_y += dz[c] * q
                slope_z += dz[c] * r
            both, first, second = x[a] * y[b], dx[a] * y[b], x[a] * dy[b]
            bx, by, bz = bx + both * along_x, by + both * along_y, bz + both * along_z
            xx, yx, zx = xx + first * along_x, yx + first * along_y, zx + first * along_z
            xy, yy, zy = xy + second * along_x, yy + second * along_y, zy + second * along_z
            xz, yz, zz = xz + both * slope_x, yz + both * slope_y, zz + both * slope_z
    return bx, by, bz, xx, xy, xz, yx, yy, yz, zx, zy, zz


@jitable
def _weights(place, count):
    """Return the first of four nodes, their weights, and the derivatives of the weights.

    Beyond the grid, a parabola through the three outermost nodes continues the values.
    """
    inside = -ROUNDED <= place <= count - 1 + ROUNDED
    cell = min(int(place), count - 2) if inside else 0
    t = place - cell if inside else math.nan
    a, b = t * (t * (1.0 - 0.5 * t) - 0.5), 1.0 + t * t * (1.5 * t - 2.5)
    c, d = t * (0.5 + t * (2.0 - 1.5 * t)), t * t * (0.5 * t - 0.5)
    da, db = t * (2.0 - 1.5 * t) - 0.5, t * (4.5 * t - 5.0)
    dc, dd = 0.5 + t * (4.0 - 4.5 * t), t * (1.5 * t - 1.0)
    if cell == 0:
        return 0, (b + 3 * a, c - 3 * a, d + a, 0.0 * t), (db + 3 * da, dc - 3 * da, dd + da, 0.0)
    if cell == count - 2:
        weights = (0.0 * t, a + d, b - 3 * d, c + 3 * d)
        return count - 4, weights, (0.0, da + dd, db - 3 * dd, dc + 3 * dd)
    return cell - 1, (a, b, c, d), (da, db, dc, dd)
