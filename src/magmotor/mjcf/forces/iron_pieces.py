"""Pieces of iron in one state.

A geom is a piece, described by one dipole at its center: that of the ellipsoid that has its
proportions, times its volume. The shape of a capsule or cylinder counts with its whole length.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.iron import BOX, CYLINDER, ELLIPSOID, SPHERE
from magmotor.mjcf.declarations.table import pieces, planes
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirror_of
from magmotor.numerics.deferred import jitable, subroutine
from magmotor.numerics.demagnetization import demagnetizing_factors

PIECE, VOLUME, SUSCEPTIBILITY, SATURATION, FACTORS, OUTER, ENERGY = 0, 1, 2, 3, 4, 7, 10
"""Columns of a piece: its geom, its volume, its material, its demagnetizing factors, the field in T
of everything except iron at its center, and the energy in J that its magnetization stores."""

BODY, WELD, MOVES, COLUMNS = 11, 12, 13, 14
"""Further columns: its body, the rigid body of that, and the degrees of freedom of that; and how
many columns there are."""


@subroutine(forceinline=True)
def read_pieces(rows, scale, table, m, offsets):
    """Write one row for each piece that a field magnetizes; return their number.

    `scale` is that of moments.
    """
    found, count = pieces(table), 0
    for k in range(len(found)):
        piece = found[k]
        numbers = numbers_of(piece.material, m, offsets)
        if numbers[0] != 0.0:
            row = rows[count]
            a, b, c, row[VOLUME] = _ellipsoid(piece.geom, m, offsets)
            row[PIECE], row[SUSCEPTIBILITY] = piece.geom, numbers[0]
            row[SATURATION] = scale * numbers[1] if len(numbers) > 1 else 0.0
            factors = demagnetizing_factors(a, b, c)
            for axis in range(3):
                row[FACTORS + axis] = factors[axis]
            row[BODY], row[WELD], row[MOVES] = piece.body, piece.weld, piece.freedoms
            count += 1
    return count


@subroutine(forceinline=True)
def read_mirror(table, m, d, offsets):
    """Return the mirror that a plane of iron is, or none."""
    found, mirror = planes(table), NO_MIRROR
    for k in range(len(found)):
        susceptibility = numbers_of(found[k].material, m, offsets)[0]
        mirror = mirror_of(found[k].geom, susceptibility, d, offsets)
    return mirror


@subroutine
def _ellipsoid(geom, m, offsets):
    """Return the semi-axes of an ellipsoid with a geom's proportions, and the geom's volume."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)[geom]
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)[geom]
    return ellipsoid(shape, size[0], size[1], size[2])


@jitable
def ellipsoid(shape, a, b, c):
    """Return the same by the type and the size of a geom."""
    if shape == SPHERE:
        return a, a, a, 4.0 / 3.0 * math.pi * a**3
    if shape == ELLIPSOID:
        return a, b, c, 4.0 / 3.0 * math.pi * a * b * c
    if shape == BOX:
        return a, b, c, 8.0 * a * b * c
    if shape == CYLINDER:
        return a, a, b, 2.0 * math.pi * a * a * b
    return a, a, a + b, math.pi * a * a * (2.0 * b + 4.0 / 3.0 * a)
