"""Conducting plates, in which magnets that move induce eddy currents.

A tuple whose name starts with `conductor` names one numeric and planes, each the upper face of a
plate without edges. The numeric is the conductivity in S/m and, optionally, the thickness in m; 0,
or none, stands for a half-space.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    FEW,
    GEOM,
    KIND,
    NUMERIC,
    REPEATED,
    SECOND,
    SHAPE,
    element,
    elements_of,
    numbers_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.declarations.table import CONDUCTORS, add_row, conductors, refuse
from magmotor.mjcf.error_numbers import COLD, CONDUCTIVITY, CONDUCTOR, set_error
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
    numeric = -1
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        if kind == NUMERIC:
            numeric = number
    for i in elements_of(k, m, offsets):
        kind, geom, _ = element(i, m, offsets)
        if kind == GEOM:
            added = add_row(table, CONDUCTORS)
            row = conductors(table)[added]
            row.tuple, row.geom, row.numeric = k, geom, numeric


@subroutine
def _broken_rule(k, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    numerics = geoms = 0
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        rule = other = -1
        if kind == NUMERIC:
            numerics += 1
            rule = SECOND if numerics > 1 else -1
        elif kind == GEOM:
            geoms += 1
            other = _earlier_tuple(i, number, m, offsets)
            if other >= 0:
                rule = REPEATED
            elif shape[number] != PLANE:
                rule = SHAPE
        else:
            rule = KIND
        if rule >= 0:
            return i, rule, other
    return -1, FEW if numerics == 0 or geoms == 0 else -1, -1


@subroutine
def _earlier_tuple(i, geom, m, offsets):
    """Return the conductor in which an element before i names a geom, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            for j in elements_of(k, m, offsets):
                kind, other, _ = element(j, m, offsets)
                if kind == GEOM and other == geom and j < i:
                    return k
    return -1


@subroutine(forceinline=True)
def check_conductors(error, table, kinds, m, offsets):
    """Find an error in conductivities, or a body that noise keeps at a temperature."""
    for row in conductors(table):
        numbers = numbers_of(row.numeric, m, offsets)
        valid = 1 <= len(numbers) <= 2
        for i in range(len(numbers)):
            valid = valid and 0.0 <= numbers[i] < math.inf
        if not valid:
            set_error(error, CONDUCTIVITY, row.numeric)
            return
    nuser, bodies = m[offsets.nuser_body // 8], m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    for body in range(bodies if kinds & NOISE and len(conductors(table)) > 0 else 0):
        if memory.any_number(rows, body, 0, nuser):
            set_error(error, COLD, conductors(table)[0].tuple, body)
            return
