"""Pieces of soft iron, and of other materials that a field magnetizes.

A tuple whose name starts with `iron` names one numeric and geoms. The numeric is the material: its
susceptibility chi and, optionally, its saturation magnetization M_s in A/m. A geom is a piece,
described by one dipole at its center: that of the ellipsoid that has its proportions, times its
volume. The shape of a capsule or cylinder counts with its whole length. A plane is a mirror.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from numba.extending import register_jitable

from magmotor.mjcf import memory
from magmotor.mjcf.forces.couplings import coupling_of
from magmotor.mjcf.forces.custom import (
    FEW,
    GEOM,
    KIND,
    NUMERIC,
    REPEATED,
    SECOND,
    SHAPE,
    VALID,
    element,
    elements_of,
    numbers_of,
    tuple_starts_with,
)
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirror_of
from magmotor.numerics.demagnetization import demagnetizing_factors
from magmotor.numerics.subroutine import subroutine

IRON = tuple(b"iron")

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
"""mjGEOM_PLANE and so on."""

PIECE, VOLUME, SUSCEPTIBILITY, SATURATION, FACTORS, OUTER, ENERGY = 0, 1, 2, 3, 4, 7, 10
"""Columns of a piece: its geom, its volume, its material, its demagnetizing factors, the field in T
of everything except iron at its center, and the energy in J that its magnetization stores."""

COLUMNS = 11
"""Number of columns of a piece."""


@subroutine
def count_pieces(m, offsets):
    """Return the number of pieces, or more."""
    count = 0
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            count += len(elements_of(k, m, offsets)) - 1
    return count


@subroutine
def read_pieces(pieces, scale, m, d, offsets):
    """Write one row for each piece, with `scale` for moments; return their number, and a mirror."""
    count, mirror = 0, NO_MIRROR
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            susceptibility, saturation = _material(k, m, offsets)
            for i in elements_of(k, m, offsets):
                kind, geom, _ = element(i, m, offsets)
                if kind == GEOM and shape[geom] == PLANE:
                    mirror = mirror_of(geom, susceptibility, d, offsets)
                elif kind == GEOM and susceptibility != 0.0:
                    row = pieces[count]
                    a, b, c, row[VOLUME] = _ellipsoid(geom, m, offsets)
                    row[PIECE] = geom
                    row[SUSCEPTIBILITY], row[SATURATION] = susceptibility, scale * saturation
                    factors = demagnetizing_factors(a, b, c)
                    for axis in range(3):
                        row[FACTORS + axis] = factors[axis]
                    count += 1
    return count, mirror


@subroutine
def is_piece(geom, m, offsets):
    """Whether a geom is a piece of iron that a field magnetizes."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    return shape[geom] != PLANE and _is_iron(geom, m, offsets)


@subroutine
def has_mirror(m, offsets):
    """Whether a plane is of iron that a field magnetizes."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    for geom in range(m[offsets.ngeom // 8]):
        if shape[geom] == PLANE and _is_iron(geom, m, offsets):
            return True
    return False


@subroutine
def _is_iron(geom, m, offsets):
    """Whether a tuple of iron names a geom, and its susceptibility is not 0."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                if kind == GEOM and number == geom:
                    return _material(k, m, offsets)[0] != 0.0
    return False


@subroutine
def _material(k, m, offsets):
    """Return the susceptibility and the saturation magnetization, or 0, that a tuple names."""
    susceptibility = saturation = 0.0
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        if kind == NUMERIC:
            numbers = numbers_of(number, m, offsets)
            susceptibility = numbers[0]
            if len(numbers) > 1:
                saturation = numbers[1]
    return susceptibility, saturation


@subroutine
def _ellipsoid(geom, m, offsets):
    """Return the semi-axes of an ellipsoid with a geom's proportions, and the geom's volume."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)[geom]
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)[geom]
    return ellipsoid(shape, size[0], size[1], size[2])


@register_jitable
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


@subroutine
def invalid_iron(m, offsets) -> tuple[int, int, int, int]:
    """Return the first tuple of iron with a wrong element, as `VALID` describes it.

    There must be one numeric, and geoms of the shapes above, one of which at most is a plane, and
    none of which is named twice.
    """
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    planes = 0
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            materials = geoms = 0
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                rule = other = -1
                if kind == NUMERIC:
                    materials += 1
                    rule = SECOND if materials > 1 else -1
                elif kind == GEOM:
                    geoms += 1
                    other = _earlier_tuple(i, m, offsets)
                    solid = SPHERE <= shape[number] <= BOX
                    planes += shape[number] == PLANE
                    if other >= 0:
                        rule = REPEATED
                    elif not (solid or shape[number] == PLANE):
                        rule = SHAPE
                    elif planes > 1:
                        rule = SECOND
                else:
                    rule = KIND
                if rule >= 0:
                    return k, i, rule, other
            if materials == 0 or geoms == 0:
                return k, -1, FEW, -1
    return VALID


@subroutine
def _earlier_tuple(i, m, offsets):
    """Return the tuple of iron in which an earlier element names the geom of element i, or -1."""
    _, geom, _ = element(i, m, offsets)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            for j in elements_of(k, m, offsets):
                kind, other, _ = element(j, m, offsets)
                if j < i and kind == GEOM and other == geom:
                    return k
    return -1


@subroutine
def invalid_material(m, offsets):
    """Return the first numeric of a valid tuple that is not a material, or -1.

    It must have one or two finite numbers, the first at least -1 and the second not negative.
    """
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                if kind == NUMERIC:
                    numbers = numbers_of(number, m, offsets)
                    valid = len(numbers) in (1, 2) and -1.0 <= numbers[0] < math.inf
                    if len(numbers) == 2:
                        valid = valid and 0.0 <= numbers[1] < math.inf
                    if not valid:
                        return number
    return -1


@subroutine
def invalid_size(m, offsets):
    """Return the first piece of iron whose size is not positive and finite, or -1."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, geom, _ = element(i, m, offsets)
                if kind == GEOM and shape[geom] != PLANE:
                    used = 1 if shape[geom] == SPHERE else 3
                    used = 2 if shape[geom] in (CAPSULE, CYLINDER) else used
                    for axis in range(used):
                        if not 0.0 < size[geom, axis] < math.inf:
                            return geom
    return -1


@subroutine
def coupled_iron(m, offsets):
    """Return the first piece of iron whose body a coupling names, and the coupling; or -1, -1."""
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, IRON, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, geom, _ = element(i, m, offsets)
                pair = coupling_of(body_of[geom], m, offsets) if kind == GEOM else -1
                if pair >= 0:
                    return geom, pair
    return -1, -1
