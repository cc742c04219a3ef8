"""The potential at the nodes of iron of everything except iron: magnets, their images, and fields.

The field is mu0 H = -grad phi in T, and the potential phi is in T m.
"""

import math

from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.fields import GRADIENT
from magmotor.mjcf.error_numbers import BEHIND, CIRCUIT, NO_ERROR, OUTSIDE
from magmotor.mjcf.forces.applied_fields import NAME, field_and_gradient
from magmotor.mjcf.forces.bores import set_potentials_of_coil
from magmotor.mjcf.forces.dipole_table import ELEMENT
from magmotor.mjcf.forces.iron_pieces import (
    BODY,
    EXTENT,
    EXTRAPOLATED,
    GEOM,
    MAGNETS,
    NEARER,
    OUTER,
    SATURATION,
    center_of,
    nodes_of,
    reflected_center,
)
from magmotor.mjcf.forces.iron_pieces import THREADED as PIECE_THREADED
from magmotor.mjcf.forces.lifts import is_lifted, set_lifts, to_world
from magmotor.mjcf.forces.mirror import NO_MIRROR, height_above, mirrored
from magmotor.mjcf.forces.shape_distances import FAR, FAR_SPREAD, reach_of, squared_distance
from magmotor.mjcf.forces.shape_fields import set_continued_potentials, set_dipole_potentials
from magmotor.mjcf.forces.shaped_magnets import (
    COIL,
    KIND,
    LIFT,
    POINT,
    SPREAD,
    THREADED,
    dipole_of,
    in_frame,
)
from magmotor.mjcf.forces.shaped_magnets import GEOM as GEOM_OF_SHAPE
from magmotor.mjcf.forces.threaded_iron import INSIDE, RING, WIDE, thread_piece
from magmotor.numerics.deferred import subroutine

_LINE = (
    (0.5, 1.0),
    (0.06943184420297371, 0.17392742256872692), (0.33000947820757187, 0.3260725774312731),
    (0.6699905217924281, 0.3260725774312731), (0.9305681557970263, 0.17392742256872692),
)  # fmt: skip
"""Points and weights of Gauss and Legendre between 0 and 1: one, for linear fields, and four."""

FURTHER = 0.5
"""How much farther magnets are lifted to extrapolate their potential, over the lift."""

LONGEST, SPACINGS = 4.0, 6
"""Length of a line with four points, over the least spacing of a table; and where a table has its
spacings."""


@subroutine
def set_outer_potentials(state, m, offsets):
    """Find the potential of everything except iron at all nodes; return an error."""
    mirror = state.mirror
    for i in range(len(state.pieces)):
        piece = state.pieces[i]
        element = int(state.table[ELEMENT, state.magnets.iron + i])
        x, y, z = center_of(piece)
        if mirror[0] != 0.0 and height_above(mirror, x, y, z) <= 0.0:
            return BEHIND, element, int(piece[BODY])
        ring = _add_magnets(state, piece, NO_MIRROR, 1.0)
        if ring >= 0:
            return CIRCUIT, int(piece[GEOM]), ring
        if mirror[0] != 0.0:
            _add_magnets(state, piece, mirror, -mirror[0])
        for number in range(len(state.fields)):
            row = state.fields[number]
            if not _add_field(state, piece, row, m, offsets):
                return OUTSIDE, element, int(row[NAME])
    return NO_ERROR


@subroutine
def place_charges(room, own, mirror):
    """Write the places of nodes to the rows 0 to 2 of `room`, reflected if there is a mirror.

    Returns how many there are.
    """
    count = own.shape[1]
    for axis in range(3):
        for k in range(count):
            room[axis, k] = own[axis, k]
    for k in range(count if mirror[0] != 0.0 else 0):
        place = mirrored(mirror, (own[0, k], own[1, k], own[2, k], 0.0, 0.0, 0.0))
        room[0, k], room[1, k], room[2, k] = place[0], place[1], place[2]
    return count


@subroutine
def lower_charges(room, count, piece, row, times):
    """Lower nodes, instead of lifting a magnet that is too near, or some times as far."""
    u, v, w = times * row[LIFT], times * row[LIFT + 1], times * row[LIFT + 2]
    dx, dy, dz = to_world(piece, u, v, w)
    for k in range(count):
        room[0, k], room[1, k], room[2, k] = room[0, k] - dx, room[1, k] - dy, room[2, k] - dz


@subroutine
def set_all_lifts(state, piece):
    """Find what a piece is to coils, and how far all others are lifted; return whether any is."""
    room, rows = state.room, state.sources
    lifted = set_lifts(piece, rows)
    for k in range(len(rows)):
        row = rows[k]
        row[THREADED] = WIDE
        if row[COIL] != 0.0 and acts_as_shape(row, piece, NO_MIRROR):
            count = place_charges(room, nodes_of(state.nodes, piece), NO_MIRROR)
            row[THREADED] = thread_piece(room, count, piece, row)
            if row[THREADED] != WIDE:
                row[LIFT] = row[LIFT + 1] = row[LIFT + 2] = 0.0
    return lifted


@subroutine
def thread(room, count, piece, row, mirror):
    """Return what a piece, whose nodes are in the room, is to a coil; see `thread_piece`."""
    if mirror[0] != 0.0 or row[THREADED] == WIDE:
        return WIDE
    return thread_piece(room, count, piece, row)


@subroutine
def acts_as_shape(shape, piece, mirror):
    """Whether a magnet, or its image, is so near a piece that its shape counts."""
    if int(shape[KIND]) == POINT:
        return False
    x, y, z = reflected_center(piece, mirror)
    gap = math.sqrt(squared_distance(shape, x, y, z)) - piece[EXTENT]
    reach = FAR * reach_of(shape)
    return gap < 0.0 or gap * gap < max(reach * reach, FAR_SPREAD * shape[SPREAD])


@subroutine
def _add_magnets(state, piece, mirror, factor):
    """Add the potential of all magnets, or of their images, at the nodes of a piece.

    Returns the geom of a coil around a ring of iron, or -1.
    """
    own, room, rows = nodes_of(state.nodes, piece), state.room, state.sources
    direct, lifted = mirror[0] == 0.0, False
    if direct:
        lifted = set_all_lifts(state, piece)
        alone = len(state.pieces) == 1 and len(state.fields) == 0 and state.mirror[0] == 0.0
        piece[EXTRAPOLATED] = 1.0 if lifted and not alone else 0.0
    for k in range(len(rows)):
        row = rows[k]
        times = 1.0 if lifted and is_lifted(row) else 0.0
        threaded = _set_potentials(room, piece, own, row, mirror, times)
        if threaded == RING:
            return int(row[GEOM_OF_SHAPE])
        if threaded == INSIDE:
            piece[PIECE_THREADED] = 1.0
        for n in range(own.shape[1]):
            own[OUTER, n] += factor * room[4, n]
        if times != 0.0 and piece[EXTRAPOLATED] != 0.0:
            for n in range(own.shape[1]):
                own[NEARER, n] += room[4, n] / FURTHER
            _set_potentials(room, piece, own, row, mirror, 1.0 + FURTHER)
            for n in range(own.shape[1]):
                own[NEARER, n] -= room[4, n] / FURTHER
    if direct and (piece[SATURATION] > 0.0 or piece[EXTRAPOLATED] != 0.0):
        for n in range(own.shape[1]):
            own[MAGNETS, n] = own[OUTER, n]
            own[OUTER, n] += own[NEARER, n]
    return -1


@subroutine
def _set_potentials(room, piece, own, row, mirror, times):
    """Write the potential of a magnet, which is lifted some times, at the nodes of a piece.

    Returns what the piece is to a coil.
    """
    count, threaded = place_charges(room, own, mirror), WIDE
    if times != 0.0:
        lower_charges(room, count, piece, row, times)
    if not acts_as_shape(row, piece, mirror):
        set_dipole_potentials(room, count, dipole_of(row))
        return threaded
    threaded = thread(room, count, piece, row, mirror)
    for n in range(count if threaded != RING else 0):
        x, y, z = in_frame(row, room[0, n], room[1, n], room[2, n])
        room[0, n], room[1, n], room[2, n] = x, y, z
    if threaded == INSIDE:
        set_potentials_of_coil(room, count, row)
    elif threaded != RING:
        set_continued_potentials(room, count, row)
    return threaded


@subroutine
def _add_field(state, piece, row, m, offsets):
    """Add the potential of an applied field to that at nodes; return whether it is finite."""
    own, center = nodes_of(state.nodes, piece), center_of(piece)
    total = 0.0
    for k in range(own.shape[1]):
        node = own[0, k], own[1, k], own[2, k]
        change = field_along_line(center, node, row, m, offsets)[0]
        own[OUTER, k] -= change
        total += change
    return math.isfinite(total)


@subroutine
def field_along_line(start, end, row, m, offsets):
    """Return the integral of a field from one point to another, and its derivatives.

    The derivatives are by the places of the end and of the start. They are exact for the same
    points of quadrature, also where the interpolation of a table has a small curl.
    """
    numbers = numbers_of(int(row[NAME]), m, offsets)
    linear = len(numbers) <= GRADIENT
    u, v, w = start
    dx, dy, dz = end[0] - u, end[1] - v, end[2] - w
    total = nx = ny = nz = cx = cy = cz = 0.0
    segments = 1
    if not linear:
        spacing = min(numbers[SPACINGS], numbers[SPACINGS + 1], numbers[SPACINGS + 2])
        segments += int(math.sqrt(dx * dx + dy * dy + dz * dz) / (LONGEST * spacing))
    for number in range(segments):
        for point in range(0 if linear else 1, 1 if linear else len(_LINE)):
            t, weight = (number + _LINE[point][0]) / segments, _LINE[point][1] / segments
            f = field_and_gradient(row, u + t * dx, v + t * dy, w + t * dz, m, offsets)
            gx = f[3] * dx + f[6] * dy + f[9] * dz
            gy = f[4] * dx + f[7] * dy + f[10] * dz
            gz = f[5] * dx + f[8] * dy + f[11] * dz
            total += weight * (f[0] * dx + f[1] * dy + f[2] * dz)
            nx, ny, nz = (
                nx + weight * (t * gx + f[0]),
                ny + weight * (t * gy + f[1]),
                nz + weight * (t * gz + f[2]),
            )
            cx, cy, cz = cx + weight * gx, cy + weight * gy, cz + weight * gz
    return total, nx, ny, nz, cx - nx, cy - ny, cz - nz
