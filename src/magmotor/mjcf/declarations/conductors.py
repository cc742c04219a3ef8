"""Conducting plates, in which magnets that move induce eddy currents.

A tuple whose name starts with `conductor` names one numeric and planes, each the upper face of a
plate without edges. The numeric is the conductivity in S/m and, optionally, the thickness in m; 0,
or none, stands for a half-space.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    GEOM,
    SHAPE,
    element,
    elements_of,
    numbers_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.declarations.materials import (
    are_numbers,
    broken_rule,
    check_noise,
    material_of,
)
from magmotor.mjcf.declarations.table import CONDUCTORS, add_row, conductors, refuse
from magmotor.mjcf.error_numbers import CONDUCTIVITY, CONDUCTOR, set_error
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"conductor")


@subroutine
def read_conductors(table, acts, m, offsets):
    """Write a row for each plane of valid tuples."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            i, rule, other = _broken_rule(k, m, offsets)
            if rule >= 0:
                refuse(table, acts, CONDUCTOR, k, i, rule, other)
            else:
                _add_planes(table, k, m, offsets)


@subroutine
def _add_planes(table, k, m, offsets):
    """Write a row for each plane of tuple k."""
    numeric = material_of(k, m, offsets)
    for i in elements_of(k, m, offsets):
        kind, geom, _ = element(i, m, offsets)
        if kind == GEOM:
            added = add_row(table, CONDUCTORS)
            row = conductors(table)[added]
            row.tuple, row.geom, row.numeric = k, geom, numeric


@subroutine
def _broken_rule(k, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1."""
    i, rule, other = broken_rule(k, PREFIX, GEOM, m, offsets)
    if rule >= 0:
        return i, rule, other
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    for i in elements_of(k, m, offsets):
        kind, geom, _ = element(i, m, offsets)
        if kind == GEOM and shape[geom] != PLANE:
            return i, SHAPE, -1
    return -1, -1, -1


@subroutine(forceinline=True)
def check_conductors(error, table, kinds, m, offsets):
    """Find an error in conductivities, or a body that noise keeps at a temperature."""
    for row in conductors(table):
        if not are_numbers(numbers_of(row.numeric, m, offsets), 1, 2):
            set_error(error, CONDUCTIVITY, row.numeric)
            return
        check_noise(error, row.tuple, 0, kinds, m, offsets)
