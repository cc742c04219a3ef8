"""Applied fields at a point, and the frames to which they are fixed.

The force on a dipole is the gradient of m.B, so that it has a potential even where a table does not
obey Maxwell's equations. A field does not act on the rigid body to which it is fixed.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import BODY, numbers_of
from magmotor.mjcf.declarations.fields import GRADIENT, HEADER, UNIFORM
from magmotor.mjcf.declarations.table import fields
from magmotor.mjcf.forces.drives import are_controls_good, drive_of
from magmotor.numerics.arrays import copy
from magmotor.numerics.cubic_convolution import interpolate
from magmotor.numerics.deferred import subroutine

NAME, OWNER, WELD, MOVES, SCALE, ORIGIN, FRAME, COLUMNS = 0, 1, 2, 3, 4, 5, 8, 17
"""Columns of a field in one state: its numeric; its body, the rigid body of that, and the degrees
of freedom of that; its scale, its origin and its axes."""


@subroutine(forceinline=True)
def read_fields(rows, scale, table, m, d, offsets):
    """Write one row for each field, whose flux densities are over `scale`."""
    declared = fields(table)
    for k in range(len(rows)):
        _read_field(rows[k], declared[k], m, d, offsets)
        rows[k, SCALE] /= scale


@subroutine(forceinline=True)
def _read_field(row, declared, m, d, offsets):
    """Read the frame and the drive of a field."""
    row[:] = 0.0
    row[NAME], row[OWNER] = declared.numeric, declared.body
    row[WELD], row[MOVES], row[SCALE] = declared.weld, declared.freedoms, 1.0
    row[FRAME] = row[FRAME + 4] = row[FRAME + 8] = 1.0
    if declared.actuator >= 0:
        row[SCALE] = drive_of(declared, are_controls_good(m, d, offsets), m, d, offsets)
    if declared.frame_type != 0:
        origins, frames = offsets.site_xpos, offsets.site_xmat
        if declared.frame_type == BODY:
            origins, frames = offsets.xpos, offsets.xmat
        k = declared.frame
        copy(row[ORIGIN:FRAME], memory.numbers(d[origins // 8], memory.UNBOUNDED, 3)[k])
        copy(row[FRAME:COLUMNS], memory.numbers(d[frames // 8], memory.UNBOUNDED, 9)[k])


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
def place_in_field(declared, x, y, z, m, d, offsets):
    """Return the coordinates of a point in the frame to which a field is fixed."""
    row = memory.numbers(memory.row_on_stack(), 1, COLUMNS)[0]
    _read_field(row, declared, m, d, offsets)
    return _in_frame(row, x, y, z)


@subroutine
def acts_on(row, weld, moves):
    """Whether a field acts on dipoles of a rigid body: it belongs to another, and one moves."""
    return row[WELD] != weld and (row[MOVES] > 0.0 or moves > 0.0)


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
