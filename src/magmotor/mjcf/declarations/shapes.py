"""Magnets by their geom: the numbers `user` of a geom are its polarization in T, in its own frame.

The polarization is uniform, and the magnet has the shape of the geom. A geom whose numbers are all
0, as MuJoCo sets them where there are none, is no magnet. A coil may drive it; see `coils.py`.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import GEOM, element, elements_of
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, SPHERE
from magmotor.mjcf.declarations.marks import COILS, COUPLINGS, IRON
from magmotor.mjcf.declarations.marks import SHAPES as SHAPES_ACT
from magmotor.mjcf.declarations.meshes import MESH, broken_rule
from magmotor.mjcf.declarations.table import (
    SHAPES,
    add_row,
    coils,
    couplings,
    header,
    pieces,
    shapes,
)
from magmotor.mjcf.error_numbers import (
    COUPLED_MAGNET,
    MAGNETIC_IRON,
    POLARIZATION,
    POLYHEDRON,
    SHAPELESS,
    SIZE,
    set_error,
)
from magmotor.numerics.deferred import subroutine

LARGEST = 2.5
"""Largest polarization in T that any material has, iron and its alloys included; a coil may have
more."""


@subroutine
def read_shapes(table, kinds, m, offsets):
    """Write a row for each geom, if geoms have the numbers for a polarization, and these act."""
    if kinds & SHAPES_ACT == 0 or m[offsets.nuser_geom // 8] < 3:
        return
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    for geom in range(m[offsets.ngeom // 8]):
        added = add_row(table, SHAPES)
        row = shapes(table)[added]
        row.geom, row.body = geom, body_of[geom]
        row.weld = weld_of[row.body]
        row.freedoms = freedoms[row.weld]
    found = coils(table)
    for k in range(len(found) if kinds & COILS else 0):
        for i in elements_of(found[k].tuple, m, offsets):
            kind, geom, _ = element(i, m, offsets)
            if kind == GEOM:
                shapes(table)[geom].coil = k


@subroutine
def polarization_of(geom, m, offsets):
    """Return the polarization of a geom."""
    numbers = memory.numbers(
        m[offsets.geom_user // 8], memory.UNBOUNDED, m[offsets.nuser_geom // 8]
    )
    return numbers[geom, 0], numbers[geom, 1], numbers[geom, 2]


@subroutine
def is_magnet(geom, m, offsets):
    """Whether a geom has a polarization."""
    x, y, z = polarization_of(geom, m, offsets)
    return x != 0.0 or y != 0.0 or z != 0.0


@subroutine(forceinline=True)
def check_shapes(error, table, kinds, meshes, m, offsets):
    """Find an error in polarizations, or in the shapes and sizes of the geoms that have one.

    If these act, no coupling must name the body of such a geom, and no iron the geom itself.

    In the units of a model with a magnetic constant, a polarization may be any finite number.
    Whether meshes are convex takes long, so that it is checked only if `meshes`.
    """
    for row in shapes(table):
        geom, driven = row.geom, row.coil >= 0
        largest = LARGEST if header(table).constant < 0 and not driven else math.inf
        if error[0] >= 0 or not is_magnet(geom, m, offsets):
            continue
        x, y, z = polarization_of(geom, m, offsets)
        square = x * x + y * y + z * z
        if not (square <= largest * largest and square < math.inf):
            set_error(error, POLARIZATION, geom)
        else:
            _check_shape(error, geom, meshes, m, offsets)
        for pair in couplings(table)[: memory.UNBOUNDED if kinds & COUPLINGS else 0]:
            if error[0] < 0 and row.body in (pair.body, pair.other):
                set_error(error, COUPLED_MAGNET, geom, pair.tuple)
        for piece in pieces(table)[: memory.UNBOUNDED if kinds & IRON else 0]:
            if error[0] < 0 and piece.geom == geom:
                set_error(error, MAGNETIC_IRON, geom)


@subroutine
def _check_shape(error, geom, meshes, m, offsets):
    """Find an error in the type, the size or the mesh of a magnet."""
    kind = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)[geom]
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    used = 1 if kind == SPHERE else (2 if kind in (CAPSULE, CYLINDER) else 3)
    if kind == MESH:
        rule = broken_rule(geom, meshes, m, offsets)
        if rule >= 0:
            set_error(error, POLYHEDRON, geom, -1, rule)
    elif not SPHERE <= kind <= BOX:
        set_error(error, SHAPELESS, geom)
    else:
        for axis in range(used):
            if not 0.0 < size[geom, axis] < math.inf:
                set_error(error, SIZE, geom)
