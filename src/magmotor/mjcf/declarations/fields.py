"""Applied fields: uniform, with a gradient, or a table; fixed to the world, a body or a site.

A numeric whose name starts with `field` is a field. Its numbers are, in this order:

- the flux density B_x B_y B_z in T, of a uniform field;
- B at the origin, then the derivatives G_xx G_xy G_xz G_yy G_yz in T/m. The others follow from
  Maxwell's equations: G is symmetric and has no trace;
- or a table: the numbers of nodes n_x n_y n_z, the first node x y z and the spacings in m, then B
  of each node, z fastest. See `magmotor.numerics.cubic_convolution`.

A tuple whose name starts with `field` says more about the numerics among its elements: a body or a
site is the frame to which the field is fixed, which also feels the reaction; an actuator scales the
field as it does a coil (see `coils.py`).
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.coils import wrong_drive
from magmotor.mjcf.declarations.custom import (
    ACTUATOR,
    BODY,
    FEW,
    KIND,
    MISNAMED,
    NUMERIC,
    REPEATED,
    SECOND,
    SITE,
    element,
    elements_of,
    numbers_of,
    numeric_starts_with,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.table import FIELDS, add_row, fields, refuse
from magmotor.mjcf.error_numbers import FIELD, FIELD_TUPLE, set_error
from magmotor.numerics.cubic_convolution import FEWEST
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"field")

UNIFORM, GRADIENT, HEADER = 3, 8, 9
"""Numbers of a uniform field, of one with a gradient, and before the nodes of a table."""


@subroutine
def read_fields(table, acts, m, offsets):
    """Write a row for each field."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            i, rule, other = _broken_rule(k, m, offsets)
            if rule >= 0:
                refuse(table, acts, FIELD_TUPLE, k, i, rule, other)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    for numeric in range(m[offsets.nnumeric // 8]):
        if numeric_starts_with(numeric, PREFIX, m, offsets):
            added = add_row(table, FIELDS)
            row = fields(table)[added]
            row.numeric, row.tuple = numeric, _tuple_of(numeric, m, offsets)
            row.body = row.frame_type = row.frame = 0
            if row.tuple >= 0:
                _place(row, m, offsets)
            row.weld = weld_of[row.body]
            row.freedoms = freedoms[row.weld]


@subroutine
def _place(row, m, offsets):
    """Write the frame and the drive of a field from the elements of its tuple."""
    body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
    for i in elements_of(row.tuple, m, offsets):
        kind, number, _ = element(i, m, offsets)
        if kind == ACTUATOR:
            row.element, row.actuator = i, number
        elif kind in (BODY, SITE):
            row.frame_type, row.frame, row.body = kind, number, number
            if kind == SITE:
                row.body = body_of[number]


@subroutine
def _tuple_of(numeric, m, offsets):
    """Return the tuple that places or drives a field, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                if kind == NUMERIC and number == numeric:
                    return k
    return -1


@subroutine
def _broken_rule(k, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1."""
    named = frames = drives = 0
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        rule = other = -1
        if kind == NUMERIC:
            named += 1
            rule = -1 if numeric_starts_with(number, PREFIX, m, offsets) else MISNAMED
            first = _tuple_of(number, m, offsets)
            if rule < 0 and first != k:
                rule, other = REPEATED, first
        elif kind in (BODY, SITE):
            frames += 1
        elif kind == ACTUATOR:
            drives += 1
        else:
            rule = KIND
        if rule < 0 and (frames > 1 or drives > 1):
            rule = SECOND
        if rule >= 0:
            return i, rule, other
    return -1, FEW if named == 0 else -1, -1


@subroutine(forceinline=True)
def check_fields(error, table, thorough, m, offsets):
    """Find an error in the numbers of fields and their actuators; in all nodes if `thorough`."""
    found = fields(table)
    for k in range(len(found)):
        if not _are_valid(numbers_of(found[k].numeric, m, offsets), thorough):
            set_error(error, FIELD, found[k].numeric)
            return
    for k in range(len(found)):
        rule = wrong_drive(found[k], m, offsets) if found[k].actuator >= 0 else -1
        if rule >= 0:
            set_error(error, FIELD_TUPLE, found[k].tuple, found[k].element, rule)
            return


def are_valid(numbers, thorough):
    """Whether numbers are those of a field; of a table, the nodes are read if `thorough`."""
    size = len(numbers)
    valid = size in (UNIFORM, GRADIENT)
    if size > HEADER:
        nodes = 3.0
        valid = True
        for k in range(3):
            count = numbers[k]
            valid = valid and FEWEST <= count < size and count == math.floor(count)
            valid = valid and numbers[6 + k] > 0.0
            nodes *= count
        valid = valid and size == HEADER + nodes
    total = 0.0
    for k in range(size if thorough else min(size, HEADER)):
        total += 0.0 * numbers[k]
    return valid and total == 0.0


_are_valid = subroutine(are_valid, forceinline=True)
