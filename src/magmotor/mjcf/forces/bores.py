"""Coils by their geom: what is in the bore is in the field B, not in that of a magnet's charges.

A geom that a coil drives stands for a winding on its side. Outside, its field is that of the
charges J.n on its ends, -grad phi; in the bore, it is J - grad phi. For iron and for charges, J is
the gradient of another potential psi, which has one value at a place if what is there does not
close a ring through the bore: with z along J, and ends at z = -l and l,

    psi = -J z in the bore, -J l beyond its upper end, and J l beyond its lower one.

The geoms of a piece of iron are convex, so that each is either in the bore, and psi depends on the
height of its nodes, or outside of it and of the winding. Then it has the value of the end at which
it is attached to what is in the bore, also beside the winding, such as the wall of a pot.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.charges import ORDERS, set_charges
from magmotor.mjcf.forces.iron_pieces import FRAME, POSITION, RESPONSE, ellipsoid
from magmotor.mjcf.forces.iron_unions import CLOSED
from magmotor.mjcf.forces.shape_distances import squared_distance
from magmotor.mjcf.forces.shaped_magnets import COIL, KIND, LENGTHS, POLARIZATION, RADIUS, in_frame
from magmotor.mjcf.forces.shaped_magnets import FRAME as FRAME_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import POSITION as POSITION_OF_SHAPE
from magmotor.numerics.deferred import jitable, subroutine
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.shapes.box import box_contains, box_field, box_potential
from magmotor.numerics.shapes.cylinder import (
    cylinder_contains,
    cylinder_field,
    cylinder_potential,
)

END, ENDS = 7, 8
"""Rows of a room: 0 for a point that is in the bore, and 1 or -1 for one that is attached beyond
the upper or the lower end; and the same for each geom of a piece. That is `UNKNOWN` at first, or
`NEVER` 0."""

UNKNOWN, NEVER = 2.0, 3.0

FINEST = len(ORDERS) - 1
"""Level of the charges of a magnet in a bore."""

WIDE, OUTSIDE, INSIDE, RING = range(4)
"""What a piece is to a coil: too wide for the bore; or outside or in it; or a ring through it."""

TIGHT = 1e-6
"""How much wider than the bore what is in it may be, over the width of the bore."""


@jitable
def _axis_of(coil):
    """Return the axis of a coil, and half its length."""
    if int(coil[KIND]) == CYLINDER:
        return 2, coil[LENGTHS + 1]
    axis = 2
    for k in range(2):
        if coil[POLARIZATION + k] != 0.0:
            axis = k
    return axis, coil[LENGTHS + axis]


@subroutine
def is_in_bore(coil, x, y, z):
    """Whether a point of the world is in the bore of a coil."""
    u, v, w = in_frame(coil, x, y, z)
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    if int(coil[KIND]) == CYLINDER:
        return cylinder_contains(u, v, w, a, b)
    return box_contains(u, v, w, a, b, c)


@subroutine
def _crosses(coil, place, arm):
    """Whether the line from `place` - `arm` to `place` + `arm` in the world crosses the bore."""
    x, y, z = in_frame(coil, place[0], place[1], place[2])
    p, q, r = in_frame(coil, place[0] + arm[0], place[1] + arm[1], place[2] + arm[2])
    first, last = -1.0, 1.0
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    p, q, r = p - x, q - y, r - z
    if int(coil[KIND]) == CYLINDER:
        first, last = _within(first, last, z, r, b)
        square = p * p + q * q
        nearest = -(p * x + q * y) / square if square > 0.0 else first
        t = min(max(nearest, first), last)
        u, v = x + t * p, y + t * q
        return first < last and u * u + v * v < a * a
    first, last = _within(first, last, x, p, a)
    first, last = _within(first, last, y, q, b)
    first, last = _within(first, last, z, r, c)
    return first < last


@subroutine
def _within(first, last, x, step, half):
    """Return the part of an interval of t in which x + t step is between -half and half."""
    if step == 0.0:
        return (first, last) if abs(x) < half else (first, first)
    one, two = (-half - x) / step, (half - x) / step
    return max(first, min(one, two)), min(last, max(one, two))


@subroutine
def _passes(coil, place, frame, lengths):
    """Whether a body with a center, axes (row by row), and half lengths along them is in a bore.

    The lines through its center along its axes stand for it.
    """
    found = False
    for k in range(3):
        half = lengths[0] if k == 0 else (lengths[1] if k == 1 else lengths[2])
        arm = half * frame[k], half * frame[3 + k], half * frame[6 + k]
        found = found or _crosses(coil, place, arm)
    return found


@jitable
def fits(coil, kind, lengths):
    """Whether a body of a type, with half lengths along its axes, fits in the bore of a coil."""
    a, b, c = lengths
    small, large = min(a, b, c), max(a, b, c)
    middle = a + b + c - small - large
    axis, _ = _axis_of(coil)
    if int(coil[KIND]) == CYLINDER:
        across = math.sqrt(small * small + middle * middle) if kind == BOX else middle
        return across <= (1.0 + TIGHT) * coil[LENGTHS]
    one, two = coil[LENGTHS + (axis + 1) % 3], coil[LENGTHS + (axis + 2) % 3]
    wide, narrow = (1.0 + TIGHT) * max(one, two), (1.0 + TIGHT) * min(one, two)
    return small <= narrow and middle <= wide


@subroutine
def magnet_fits(row, coil):
    """Whether a magnet fits in the bore of the other one, which is a coil then."""
    if coil[COIL] == 0.0 or int(row[KIND]) == MESH:
        return coil[COIL] > 0.0 and row[RADIUS] <= coil[RADIUS]
    return fits(coil, int(row[KIND]), _lengths_of_shape(row))


@subroutine
def _lengths_of_shape(row):
    """Return half the lengths of a magnet along its axes; 0 for a mesh."""
    if int(row[KIND]) == MESH:
        return 0.0, 0.0, 0.0
    sizes = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    a, b, c, _ = ellipsoid(int(row[KIND]), sizes[0], sizes[1], sizes[2])
    return a, b, c


@subroutine
def thread_charges(room, row, coil):
    """Whether a magnet that fits is in the bore of a coil; if so, its charges are written.

    Returns how many there are, or 0.
    """
    reach = row[RADIUS] + coil[RADIUS]
    p, f = POSITION_OF_SHAPE, FRAME_OF_SHAPE
    x, y, z = row[p], row[p + 1], row[p + 2]
    if squared_distance(coil, x, y, z) > reach * reach:
        return 0
    inside = _passes(coil, (x, y, z), row[f:], _lengths_of_shape(row))
    count = set_charges(room, row, FINEST)
    for k in range(count):
        inside = inside or is_in_bore(coil, room[0, k], room[1, k], room[2, k])
        room[END, k] = 0.0
    return count if inside else 0


@subroutine
def thread_piece(room, count, piece, coil):
    """Write at which end of a coil each node of a piece is, if it is in the bore; return whether.

    The nodes are in the rows 0 to 2 of `room`. Other magnets are too narrow for anything.
    """
    if coil[COIL] == 0.0:
        return WIDE
    geoms, ends = _geoms_of(piece), room[ENDS]
    number, found, wide = len(geoms), False, True
    for g in range(number):
        lengths, inside = _lengths_of(geoms[g]), False
        ends[g] = NEVER
        if fits(coil, int(geoms[g, TYPE]), lengths):
            place = _in_world(piece, geoms[g, PLACE], geoms[g, PLACE + 1], geoms[g, PLACE + 2])
            inside, wide = _passes(coil, place, piece[FRAME:], lengths), False
            ends[g], found = 0.0 if inside else UNKNOWN, found or inside
    if wide:
        return WIDE
    for k in range(count):
        g = _nearest(piece, geoms, room[0, k], room[1, k], room[2, k]) if number > 1 else 0
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


TYPE, SIZE, PLACE = 0, 1, 4
"""Columns of a geom of a piece, in the frame of the first one."""


@subroutine
def _geoms_of(piece):
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
def _center_of(piece):
    """Return the center of a piece in the frame of its first geom."""
    numbers = memory.numbers(int(piece[RESPONSE]), 1, responses.START)[0]
    center = responses.CENTER
    return numbers[center], numbers[center + 1], numbers[center + 2]


@subroutine
def _in_world(piece, x, y, z):
    """Return a point in the frame of the first geom in the world."""
    u, v, w = _center_of(piece)
    x, y, z, f, p = x - u, y - v, z - w, FRAME, POSITION
    return (
        piece[p] + piece[f] * x + piece[f + 1] * y + piece[f + 2] * z,
        piece[p + 1] + piece[f + 3] * x + piece[f + 4] * y + piece[f + 5] * z,
        piece[p + 2] + piece[f + 6] * x + piece[f + 7] * y + piece[f + 8] * z,
    )


@subroutine
def _nearest(piece, geoms, x, y, z):
    """Return the geom on which a node is."""
    x, y, z, f = x - piece[POSITION], y - piece[POSITION + 1], z - piece[POSITION + 2], FRAME
    u, v, w = _center_of(piece)
    u += piece[f] * x + piece[f + 3] * y + piece[f + 6] * z
    v += piece[f + 1] * x + piece[f + 4] * y + piece[f + 7] * z
    w += piece[f + 2] * x + piece[f + 5] * y + piece[f + 8] * z
    found, least = 0, math.inf
    for g in range(len(geoms)):
        a, b, c = _lengths_of(geoms[g])
        p, q, r = u - geoms[g, PLACE], v - geoms[g, PLACE + 1], w - geoms[g, PLACE + 2]
        if int(geoms[g, TYPE]) == CYLINDER:
            height = max(math.sqrt(p * p + q * q) - a, abs(r) - c)
        else:
            height = max(abs(p) - a, abs(q) - b, abs(r) - c)
        if height < least:
            found, least = g, height
    return found


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
    axis, _ = _axis_of(coil)
    place = _in_world(piece, x, y, z)
    place = in_frame(coil, place[0], place[1], place[2])
    height = place[0] if axis == 0 else (place[1] if axis == 1 else place[2])
    return math.copysign(1.0, height)


@subroutine
def _shared(x, a, y, b):
    """Return the middle of what two intervals share, and its length."""
    low, high = max(x - a, y - b), min(x + a, y + b)
    return 0.5 * (low + high), high - low


@subroutine
def set_potentials_of_coil(room, count, coil):
    """Write the potential in T m to row 4, at points in rows 0 to 2 in the frame of the coil."""
    prefer_wide_vectors()
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    jx, jy, jz = coil[POLARIZATION], coil[POLARIZATION + 1], coil[POLARIZATION + 2]
    x, y, z, phi = room[0], room[1], room[2], room[4]
    if int(coil[KIND]) == CYLINDER:
        for k in range(count):
            phi[k] = cylinder_potential(x[k], y[k], z[k], a, b, 0.0, 0.0, jz)
    else:
        for k in range(count):
            phi[k] = box_potential(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    axis, half = _axis_of(coil)
    height, end = room[axis], room[END]
    for k in range(count):
        inside = min(max(height[k], -half), half)
        phi[k] -= coil[POLARIZATION + axis] * (inside if end[k] == 0.0 else half * end[k])


@subroutine
def set_fields_of_coil(room, count, coil):
    """Write the negative gradient of that potential in T to the rows 4 to 6."""
    prefer_wide_vectors()
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    jx, jy, jz = coil[POLARIZATION], coil[POLARIZATION + 1], coil[POLARIZATION + 2]
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    if int(coil[KIND]) == CYLINDER:
        for k in range(count):
            hx[k], hy[k], hz[k] = cylinder_field(x[k], y[k], z[k], a, b, 0.0, 0.0, jz)
    else:
        for k in range(count):
            hx[k], hy[k], hz[k] = box_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    axis, half = _axis_of(coil)
    height, end, along = room[axis], room[END], room[4 + axis]
    for k in range(count):
        if end[k] == 0.0 and abs(height[k]) < half:
            along[k] += coil[POLARIZATION + axis]
