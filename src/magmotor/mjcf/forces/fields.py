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

The force on a dipole is the gradient of m.B, so that it has a potential even where the table does
not obey Maxwell's equations. A field does not act on the rigid body to which it is fixed.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.forces.coils import are_controls_good, drive, wrong_drive
from magmotor.mjcf.forces.custom import (
    ACTUATOR,
    BODY,
    FEW,
    KIND,
    MISNAMED,
    NUMERIC,
    REPEATED,
    SECOND,
    SITE,
    VALID,
    element,
    elements_of,
    numbers_of,
    numeric_starts_with,
    tuple_starts_with,
)
from magmotor.numerics.cubic_convolution import FEWEST, interpolate
from magmotor.numerics.numba_cache import copy
from magmotor.numerics.subroutine import subroutine

FIELD = tuple(b"field")

UNIFORM, GRADIENT, HEADER = 3, 8, 9
"""Numbers of a uniform field, of one with a gradient, and before the nodes of a table."""

NAME, OWNER, SCALE, ORIGIN, FRAME, COLUMNS = 0, 1, 2, 3, 6, 15
"""Columns of a field: its numeric, its body, its scale, its origin and its axes."""


@subroutine
def read_fields(fields, scale, m, d, offsets):
    """Write one row for each field, whose flux densities are over `scale`; return their number."""
    count = 0
    for numeric in range(len(fields)):
        if numeric_starts_with(numeric, FIELD, m, offsets):
            _read_field(fields[count], numeric, m, d, offsets)
            fields[count, SCALE] /= scale
            count += 1
    return count


@subroutine
def _read_field(row, numeric, m, d, offsets):
    """Read a field."""
    row[:] = 0.0
    row[NAME], row[SCALE] = numeric, 1.0
    row[FRAME] = row[FRAME + 4] = row[FRAME + 8] = 1.0
    owner = _tuple_of(numeric, m, offsets)
    if owner >= 0:
        for i in elements_of(owner, m, offsets):
            _read_element(row, i, m, d, offsets)


@subroutine
def _tuple_of(numeric, m, offsets):
    """Return the tuple that places or drives a field, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, FIELD, m, offsets):
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                if kind == NUMERIC and number == numeric:
                    return k
    return -1


@subroutine
def _read_element(row, i, m, d, offsets):
    """Read the frame or the scale of a field from an element of its tuple."""
    kind, number, prm = element(i, m, offsets)
    if kind == ACTUATOR:
        row[SCALE] = drive(number, prm, are_controls_good(m, d, offsets), m, d, offsets)
    elif kind in (BODY, SITE):
        origins, frames = offsets.xpos, offsets.xmat
        row[OWNER] = number
        if kind == SITE:
            origins, frames = offsets.site_xpos, offsets.site_xmat
            body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
            row[OWNER] = body_of[number]
        copy(row[ORIGIN:FRAME], memory.numbers(d[origins // 8], memory.UNBOUNDED, 3)[number])
        copy(row[FRAME:COLUMNS], memory.numbers(d[frames // 8], memory.UNBOUNDED, 9)[number])


@subroutine
def field_and_gradient(row, x, y, z, m, offsets):
    """Return B of a field at a point and its derivatives (dBx/dx, dBx/dy, ...); NaN outside."""
    numbers = numbers_of(int(row[NAME]), m, offsets)
    x, y, z = _in_frame(row, x, y, z)
    r = row[FRAME:COLUMNS]
    own = _linear(numbers, x, y, z) if len(numbers) <= GRADIENT else _tabulated(numbers, x, y, z)
    s = row[SCALE]
    bx, by, bz = _rotated(r, s * own[0], s * own[1], s * own[2])
    # G' = R G R^T: first the rows of G, then the columns.
    ax, ay, az = _rotated(r, s * own[3], s * own[4], s * own[5])
    cx, cy, cz = _rotated(r, s * own[6], s * own[7], s * own[8])
    ex, ey, ez = _rotated(r, s * own[9], s * own[10], s * own[11])
    xx, yx, zx = _rotated(r, ax, cx, ex)
    xy, yy, zy = _rotated(r, ay, cy, ey)
    xz, yz, zz = _rotated(r, az, cz, ez)
    return bx, by, bz, xx, xy, xz, yx, yy, yz, zx, zy, zz


@subroutine
def place_in_field(numeric, x, y, z, m, d, offsets):
    """Return the coordinates of a point in the frame to which a field is fixed."""
    row = memory.numbers(memory.details_on_stack(), 1, COLUMNS)[0]
    _read_field(row, numeric, m, d, offsets)
    return _in_frame(row, x, y, z)


@subroutine
def acts_on(row, body, m, offsets):
    """Whether a field acts on dipoles of a body: its own rigid body is another, and one moves."""
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    own, other = weld_of[int(row[OWNER])], weld_of[body]
    return own != other and (freedoms[own] > 0 or freedoms[other] > 0)


@subroutine
def _in_frame(row, x, y, z):
    """Return the coordinates of a point in the frame of a field."""
    x, y, z = x - row[ORIGIN], y - row[ORIGIN + 1], z - row[ORIGIN + 2]
    r = row[FRAME:COLUMNS]
    return (
        r[0] * x + r[3] * y + r[6] * z,
        r[1] * x + r[4] * y + r[7] * z,
        r[2] * x + r[5] * y + r[8] * z,
    )


@subroutine
def _rotated(r, x, y, z):
    """Return a vector in the world's frame whose components along the axes `r` are given."""
    return (
        r[0] * x + r[1] * y + r[2] * z,
        r[3] * x + r[4] * y + r[5] * z,
        r[6] * x + r[7] * y + r[8] * z,
    )


@subroutine
def _linear(numbers, x, y, z):
    """Return a uniform field, or one with a gradient, in its own frame."""
    bx, by, bz = numbers[0], numbers[1], numbers[2]
    if len(numbers) == UNIFORM:
        return bx, by, bz, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz = numbers[3], numbers[4], numbers[5], numbers[6], numbers[7]
    zz = -xx - yy
    bx, by, bz = (
        bx + xx * x + xy * y + xz * z,
        by + xy * x + yy * y + yz * z,
        bz + xz * x + yz * y + zz * z,
    )
    return bx, by, bz, xx, xy, xz, xy, yy, yz, xz, yz, zz


@subroutine
def _tabulated(numbers, x, y, z):
    """Return a field from a table, in its own frame."""
    counts = int(numbers[0]), int(numbers[1]), int(numbers[2])
    sx, sy, sz = 1.0 / numbers[6], 1.0 / numbers[7], 1.0 / numbers[8]
    place = (x - numbers[3]) * sx, (y - numbers[4]) * sy, (z - numbers[5]) * sz
    f = interpolate(place, counts, numbers[HEADER:])
    return (
        f[0], f[1], f[2], f[3] * sx, f[4] * sy, f[5] * sz,
        f[6] * sx, f[7] * sy, f[8] * sz, f[9] * sx, f[10] * sy, f[11] * sz,
    )  # fmt: skip


@subroutine
def has_field(m, offsets, weld):
    """Whether a model has any field not fixed to the rigid body `weld`; -1 accepts any."""
    for numeric in range(m[offsets.nnumeric // 8]):
        is_field = numeric_starts_with(numeric, FIELD, m, offsets)
        if is_field and (weld < 0 or _rigid_body_of(numeric, m, offsets) != weld):
            return True
    return False


@subroutine
def _rigid_body_of(numeric, m, offsets):
    """Return the rigid body to which a field is fixed; 0 is the world."""
    body, owner = 0, _tuple_of(numeric, m, offsets)
    if owner >= 0:
        for i in elements_of(owner, m, offsets):
            kind, number, _ = element(i, m, offsets)
            if kind == BODY:
                body = number
            elif kind == SITE:
                body = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)[number]
    return np.int64(memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)[body])


@subroutine
def invalid_field(m, offsets, thorough):
    """Return the first invalid numeric that is a field, or -1; check all nodes if `thorough`."""
    for numeric in range(m[offsets.nnumeric // 8]):
        if numeric_starts_with(numeric, FIELD, m, offsets):
            numbers = numbers_of(numeric, m, offsets)
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
            if not valid or total != 0.0:
                return numeric
    return -1


@subroutine
def invalid_field_tuple(m, offsets) -> tuple[int, int, int, int]:
    """Return the first tuple of fields with a wrong element, as `VALID` describes it."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, FIELD, m, offsets):
            fields = frames = drives = 0
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                rule = other = -1
                if kind == NUMERIC:
                    fields += 1
                    rule = -1 if numeric_starts_with(number, FIELD, m, offsets) else MISNAMED
                    first = _tuple_of(number, m, offsets)
                    if rule < 0 and first != k:
                        rule, other = REPEATED, first
                elif kind in (BODY, SITE):
                    frames += 1
                elif kind == ACTUATOR:
                    drives += 1
                    rule = wrong_drive(i, m, offsets)
                else:
                    rule = KIND
                if rule < 0 and (frames > 1 or drives > 1):
                    rule = SECOND
                if rule >= 0:
                    return k, i, rule, other
            if fields == 0:
                return k, -1, FEW, -1
    return VALID
