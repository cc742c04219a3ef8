"""Pieces of soft iron, and of other materials that a field magnetizes.

A tuple whose name starts with `iron` names one numeric and geoms. The numeric is the material: its
susceptibility chi and, optionally, its saturation magnetization M_s in A/m, or 0 for none, and the
distance of the nodes on the surfaces in m, or 0 for an automatic one. A plane is a mirror.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    GEOM,
    SECOND,
    SHAPE,
    element,
    elements_of,
    numbers_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.materials import broken_rule, material_of
from magmotor.mjcf.declarations.table import (
    PIECES,
    PLANES,
    add_row,
    couplings,
    pieces,
    planes,
    refuse,
)
from magmotor.mjcf.error_numbers import COUPLED_IRON, IRON, MATERIAL, SIZE, set_error
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"iron")

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
"""mjGEOM_PLANE and so on."""


@subroutine
def read_iron(table, acts, coupled, m, offsets):
    """Write a row for each geom of valid tuples; `coupled` is whether couplings act, too."""
    for section in (PIECES, PLANES):
        for k in range(m[offsets.ntuple // 8]):
            if tuple_starts_with(k, PREFIX, m, offsets):
                i, rule, other = _broken_rule(k, m, offsets)
                if rule >= 0:
                    refuse(table, acts, IRON, k, i, rule, other)
                else:
                    _add_geoms(table, section, k, m, offsets)
    for piece in pieces(table):
        for pair in couplings(table):
            if piece.body in (pair.body, pair.other):
                refuse(table, acts and coupled, COUPLED_IRON, piece.geom, pair.tuple)


@subroutine
def _add_geoms(table, section, k, m, offsets):
    """Write a row for each geom of tuple k that is a plane, or for each that is none."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    material = material_of(k, m, offsets)
    for i in elements_of(k, m, offsets):
        kind, geom, _ = element(i, m, offsets)
        if kind == GEOM and (shape[geom] == PLANE) == (section == PLANES):
            added = add_row(table, section)
            row = planes(table)[added] if section == PLANES else pieces(table)[added]
            row.geom, row.material, row.body = geom, material, body_of[geom]
            row.weld = weld_of[row.body]
            row.freedoms = freedoms[row.weld]


@subroutine
def _broken_rule(k, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1.

    The geoms must have the shapes above, and one of all is a plane at most.
    """
    i, rule, other = broken_rule(k, PREFIX, GEOM, m, offsets)
    if rule >= 0:
        return i, rule, other
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    for i in elements_of(k, m, offsets):
        kind, geom, _ = element(i, m, offsets)
        if kind == GEOM and shape[geom] == PLANE and _follows_plane(i, m, offsets):
            return i, SECOND, -1
        if kind == GEOM and not (SPHERE <= shape[geom] <= BOX or shape[geom] == PLANE):
            return i, SHAPE, -1
    return -1, -1, -1


@subroutine
def _follows_plane(i, m, offsets):
    """Whether a tuple of iron names a plane in an element before i."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            for j in elements_of(k, m, offsets):
                kind, geom, _ = element(j, m, offsets)
                if kind == GEOM and shape[geom] == PLANE and j < i:
                    return True
    return False


@subroutine(forceinline=True)
def check_iron(error, table, m, offsets):
    """Find an error in materials, or in the sizes of pieces.

    A material has one to three finite numbers: the first is at least -1, the others not negative.
    """
    _check_materials(error, pieces(table), m, offsets)
    _check_materials(error, planes(table), m, offsets)
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    found = pieces(table)
    for k in range(len(found) if error[0] < 0 else 0):
        geom = found[k].geom
        used = 1 if shape[geom] == SPHERE else 3
        used = 2 if shape[geom] in (CAPSULE, CYLINDER) else used
        for axis in range(used):
            if not 0.0 < size[geom, axis] < math.inf:
                set_error(error, SIZE, geom)
                return


@subroutine(forceinline=True)
def _check_materials(error, iron, m, offsets):
    """Find an error in the materials of pieces or planes, unless there is one."""
    for k in range(len(iron) if error[0] < 0 else 0):
        numbers = numbers_of(iron[k].material, m, offsets)
        valid = 1 <= len(numbers) <= 3 and -1.0 <= numbers[0] < math.inf
        for i in range(1, len(numbers)):
            valid = valid and 0.0 <= numbers[i] < math.inf
        if not valid:
            set_error(error, MATERIAL, iron[k].material)
            return
