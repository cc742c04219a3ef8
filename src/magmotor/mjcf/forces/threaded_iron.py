"""Pieces of iron in the bore of a coil, such as cores and plungers, and what is attached to them.

The geoms of a piece are convex, so that each is either in the bore, and the potential psi of
`bores.py` depends on the height of its nodes; or outside of it and of the winding. Then it has the
value of the end at which it is attached to what is in the bore, also beside the winding, such as
the wall of a pot.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.bores import END, axis_of, fits, is_in_bore, passes
from magmotor.mjcf.forces.distances import distance_from_geom
from magmotor.mjcf.forces.iron_pieces import FRAME, POSITION, RESPONSE, ellipsoid
from magmotor.mjcf.forces.iron_unions import CLOSED
from magmotor.mjcf.forces.lifts import place_on_piece, to_world
from magmotor.mjcf.forces.shaped_magnets import COIL, POLARIZATION, in_frame
from magmotor.numerics.deferred import subroutine

ENDS = 8
"""Row of a room: the same as `END` for each geom of a piece. That is `UNKNOWN` at first, or `NEVER`
0."""

UNKNOWN, NEVER = 2.0, 3.0

WIDE, OUTSIDE, INSIDE, RING = range(4)
"""What a piece is to a coil: too wide for the bore; or outside or in it; or a ring through it."""

TYPE, SIZE, PLACE = 0, 1, 4
"""Columns of a geom of a piece, in the frame of the first one."""


@subroutine
def thread_piece(room, count, piece, coil):
    """Return what a piece is to a coil; in the bore, write at which end each node is.

    The nodes are in the rows 0 to 2 of `room`. Any piece is too wide for magnets that are no coils.
    """
    if coil[COIL] == 0.0:
        return WIDE
    geoms, ends = geoms_of(piece), room[ENDS]
    number, found, wide = len(geoms), False, True
    for g in range(number):
        lengths, inside = _lengths_of(geoms[g]), False
        ends[g] = NEVER
        if fits(coil, int(geoms[g, TYPE]), lengths):
            place = _in_world(piece, geoms[g, PLACE], geoms[g, PLACE + 1], geoms[g, PLACE + 2])
            inside, wide = passes(coil, place, piece[FRAME:], lengths), False
            ends[g], found = 0.0 if inside else UNKNOWN, found or inside
    if wide:
        return WIDE
    for k in range(count):
        place, g = place_on_piece(piece, room[0, k], room[1, k], room[2, k]), 0
        if number > 1:
            g = distance_from_piece(piece, -1, *place)[4]
        room[END, k] = g
        if ends[g] == UNKNOWN and is_in_bore(coil, room[0, k], room[1, k], room[2, k]):
            ends[g], found = 0.0, True
    if not found:
        return OUTSIDE
    for g in range(number):
        ends[g] = min(ends[g], UNKNOWN)
    ring = _attach(ends, geoms, piece, coil)
    for k in range(count):
        room[END, k] = ends[int(room[END, k])]
    return RING if ring else INSIDE


@subroutine
def geoms_of(piece):
    """Return the geoms of a piece, as its response knows them."""
    address = int(piece[RESPONSE])
    words = memory.words(address, responses.START)
    start = address + 8 * (words[responses.KEY] + responses.MATERIAL)
    return memory.numbers(start, words[responses.GEOMS], responses.PER_GEOM)


@subroutine
def _lengths_of(geom):
    """Return half the lengths of a geom along its axes."""
    a, b, c, _ = ellipsoid(int(geom[TYPE]), geom[SIZE], geom[SIZE + 1], geom[SIZE + 2])
    return a, b, c


@subroutine
def origin_of(piece):
    """Return the center of a piece in the frame of its first geom."""
    numbers = memory.numbers(int(piece[RESPONSE]), 1, responses.START)[0]
    center = responses.CENTER
    return numbers[center], numbers[center + 1], numbers[center + 2]


@subroutine
def _in_world(piece, x, y, z):
    """Return a point in the frame of the first geom in the world."""
    u, v, w = origin_of(piece)
    x, y, z = to_world(piece, x - u, y - v, z - w)
    return piece[POSITION] + x, piece[POSITION + 1] + y, piece[POSITION + 2] + z


@subroutine
def distance_from_piece(piece, only, x, y, z):
    """Return the distance of a point from a piece, its gradient, and the nearest geom.

    The point is in the frame of the piece. If `only` is not -1, no other geom counts.
    """
    (u, v, w), geoms = origin_of(piece), geoms_of(piece)
    x, y, z, found = x + u, y + v, z + w, 0
    least, gx, gy, gz = math.inf, 0.0, 0.0, 0.0
    for g in range(len(geoms)):
        if only >= 0 and only != g:
            continue
        p, q, r = x - geoms[g, PLACE], y - geoms[g, PLACE + 1], z - geoms[g, PLACE + 2]
        d = distance_from_geom(geoms[g], p, q, r)
        if d[0] < least:
            found = g
            least, gx, gy, gz = d
    return least, gx, gy, gz, found


@subroutine
def potential_of_end(room, count, piece, geom, place, coil):
    """Return the potential psi of a coil on a geom of a piece whose nodes are in the room.

    A geom in the bore has that of the end at which a place is.
    """
    if coil[COIL] == 0.0 or thread_piece(room, count, piece, coil) != INSIDE:
        return 0.0
    (axis, half), end = axis_of(coil), room[ENDS, geom]
    if end == 0.0:
        x, y, z = in_frame(coil, place[0], place[1], place[2])
        end = math.copysign(1.0, x if axis == 0 else (y if axis == 1 else z))
    return -coil[POLARIZATION + axis] * half * end


@subroutine
def _attach(ends, geoms, piece, coil):
    """Find at which end geoms outside of the bore are attached; return whether some are at both."""
    number, changed, ring = len(geoms), True, False
    while changed:
        changed = False
        for g in range(number):
            for h in range(number):
                if ends[g] == UNKNOWN and ends[h] != UNKNOWN:
                    end = _end_of_joint(geoms[g], geoms[h], piece, coil)
                    if end != 0.0:
                        ends[g], changed = (end if ends[h] == 0.0 else ends[h]), True
    for g in range(number):
        for h in range(g):
            if ends[g] != ends[h]:
                end = _end_of_joint(geoms[g], geoms[h], piece, coil)
                ring = ring or (end != 0.0 and ends[g] + ends[h] != end)
    return ring


@subroutine
def _end_of_joint(one, other, piece, coil):
    """Return 1 or -1 if two geoms of a piece are joined above or below the middle of a coil, or 0.

    Both are boxes, or cylinders on one axis.
    """
    (a, b, c), (u, v, w) = _lengths_of(one), _lengths_of(other)
    x, across = _shared(one[PLACE], a, other[PLACE], u)
    y, along = _shared(one[PLACE + 1], b, other[PLACE + 1], v)
    z, up = _shared(one[PLACE + 2], c, other[PLACE + 2], w)
    closed = CLOSED * max(a, b, c, u, v, w)
    touching = (across < closed) + (along < closed) + (up < closed)
    if min(across, along, up) < -closed or touching > 1:
        return 0.0
    axis, _ = axis_of(coil)
    place = _in_world(piece, x, y, z)
    place = in_frame(coil, place[0], place[1], place[2])
    height = place[0] if axis == 0 else (place[1] if axis == 1 else place[2])
    return math.copysign(1.0, height)


@subroutine
def _shared(x, a, y, b):
    """Return the middle of what two intervals share, and its length."""
    low, high = max(x - a, y - b), min(x + a, y + b)
    return 0.5 * (low + high), high - low
