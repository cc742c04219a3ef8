"""Geoms of iron that are one piece: those of one rigid body and material that touch or overlap.

They are boxes whose edges are parallel, and which share some area or volume, since an edge does not
join them, or cylinders on one axis. Other geoms are pieces of their own.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.declarations.table import pieces
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.responses import response_of
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import columns, mul_quat, plus, rot_vec_quat

PIECE, RESPONSE, PLACE, COLUMNS = 0, 1, 2, 9
"""Columns of a geom of iron: the first geom of its piece, as a row of the table; the address of
the response of the piece that starts with it, 0 for none yet and -1 where none does; its position
and its quaternion in the rigid body; and how many columns there are."""

CLOSED = 1e-6
"""Gaps narrower than this, over the size of the larger box, are none, and so is such a turn."""

ROUNDED = 1e-9
"""Where a box is in its piece is known up to this, over the size of the first box."""


WORDS = COLUMNS + responses.PER_GEOM
"""Words that `find_unions` and `find_responses` need for each geom, and as many more."""


@subroutine
def find_unions(place, count, table, m, offsets):
    """Find which geoms of iron are one piece, and return the rows of the geoms.

    `place` is the address of words for all of them, whose number is `count`.
    """
    found, rows = pieces(table), memory.numbers(place, count, COLUMNS)
    for k in range(count):
        rows[k, PIECE], rows[k, RESPONSE] = k, -1.0
        _place_in_body(rows[k], found[k].geom, m, offsets)
        for j in range(k):
            same = found[j].material == found[k].material and found[j].weld == found[k].weld
            same = same and rows[j, PIECE] != rows[k, PIECE]
            if same and _are_joined(rows, j, k, found, m, offsets):
                _join(rows, k, rows[j, PIECE], rows[k, PIECE])
    return rows


@subroutine
def find_responses(rows, table, m, offsets):
    """Find the responses of pieces, of whose geoms the rows are known."""
    found = pieces(table)
    key = memory.numbers(rows.ctypes.data + 8 * rows.size, 1, memory.UNBOUNDED)[0]
    for k in range(len(rows)):
        material = numbers_of(found[k].material, m, offsets)
        if rows[k, PIECE] == k and material[0] != 0.0:
            geoms = _set_key(key, rows, k, found, material, m, offsets)
            rows[k, RESPONSE] = response_of(key, geoms)


@subroutine
def _join(rows, last, one, other):
    """Make one piece of two, which starts with the first geom of both."""
    for i in range(last + 1):
        if rows[i, PIECE] == max(one, other):
            rows[i, PIECE] = min(one, other)


@subroutine
def _place_in_body(row, geom, m, offsets):
    """Write the position and the quaternion of a geom in its rigid body."""
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    parent_of = memory.integers(m[offsets.body_parentid // 8], memory.UNBOUNDED)
    x = memory.numbers(m[offsets.geom_pos // 8], memory.UNBOUNDED, 3)[geom]
    q = memory.numbers(m[offsets.geom_quat // 8], memory.UNBOUNDED, 4)[geom]
    position, turn = (x[0], x[1], x[2]), (q[0], q[1], q[2], q[3])
    body = body_of[geom]
    while body != weld_of[body]:
        x = memory.numbers(m[offsets.body_pos // 8], memory.UNBOUNDED, 3)[body]
        q = memory.numbers(m[offsets.body_quat // 8], memory.UNBOUNDED, 4)[body]
        own = q[0], q[1], q[2], q[3]
        position = plus((x[0], x[1], x[2]), 1.0, rot_vec_quat(own, position))
        turn, body = mul_quat(own, turn), parent_of[body]
    for k in range(3):
        row[PLACE + k] = position[k]
    for k in range(4):
        row[PLACE + 3 + k] = turn[k]


@subroutine
def _placed(rows, j, k):
    """Return the position and the axes of geom k in the frame of geom j."""
    one, other = rows[j, PLACE:], rows[k, PLACE:]
    back = one[3], -one[4], -one[5], -one[6]
    shift = other[0] - one[0], other[1] - one[1], other[2] - one[2]
    turn = mul_quat(back, (other[3], other[4], other[5], other[6]))
    return rot_vec_quat(back, shift), columns(turn)


@subroutine
def _along(axes, axis, size):
    """Return half of the length of a turned box along an axis, or 0 if it is not parallel."""
    half = 0.0
    for k in range(3):
        part = abs(axes[k][axis])
        if part > 0.5:
            half = size[k]
        elif part > CLOSED:
            return 0.0
    return half


@subroutine
def _are_joined(rows, j, k, found, m, offsets):
    """Whether two geoms are parallel boxes that share area or volume, or such cylinders."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    one, other = found[j].geom, found[k].geom
    if shape[one] != shape[other] or not (shape[one] == BOX or shape[one] == CYLINDER):
        return False
    place, axes = _placed(rows, j, k)
    closed, touching = 0.0, 0
    for axis in range(3):
        closed = max(closed, CLOSED * max(size[one, axis], size[other, axis]))
    if shape[one] == CYLINDER:
        off = max(max(abs(place[0]), abs(place[1])) / closed, abs(axes[2][0]) / CLOSED)
        gap = abs(place[2]) - size[one, 1] - size[other, 1]
        return max(off, abs(axes[2][1]) / CLOSED, gap / closed) < 1.0
    for axis in range(3):
        half = _along(axes, axis, size[other])
        depth = size[one, axis] + half - abs(place[axis])
        if half == 0.0 or not depth > -closed:
            return False
        touching += depth < closed
    return touching <= 1


@subroutine
def _set_key(key, rows, first, found, material, m, offsets):
    """Write the numbers on which the response of a piece depends; return its number of geoms."""
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    key[0], key[1] = material[0], material[2] if len(material) > 2 else 0.0
    saturates = len(material) > 1 and material[0] > 0.0 and material[1] > 0.0
    key[2], count = 1.0 if saturates else 0.0, 0
    start = found[first].geom
    step = ROUNDED * max(size[start, 0], size[start, 1], size[start, 2])
    for k in range(first, len(rows)):
        if rows[k, PIECE] == first:
            geom, own = found[k].geom, key[responses.MATERIAL + responses.PER_GEOM * count :]
            place, axes = _placed(rows, first, k)
            own[0], count = shape[geom], count + 1
            for axis in range(3):
                own[1 + axis] = size[geom, axis]
                own[4 + axis] = 0.0
                if k != first:
                    if shape[geom] == BOX:
                        own[1 + axis] = _along(axes, axis, size[geom])
                    own[4 + axis] = step * math.floor(place[axis] / step + 0.5)
    return count
