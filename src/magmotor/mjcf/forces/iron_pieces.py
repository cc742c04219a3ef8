"""Pieces of iron in one state, with the nodes on their surfaces; see also `iron_unions.py`.

The response of a piece to a potential at its nodes is a matrix; see `numerics/iron/response.py`.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.iron import BOX, CYLINDER, ELLIPSOID, SPHERE
from magmotor.mjcf.declarations.table import pieces, planes
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.iron_unions import RESPONSE as OF_UNION
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirror_of, mirrored
from magmotor.numerics.arrays import copy
from magmotor.numerics.deferred import jitable, subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

GEOM, SUSCEPTIBILITY, SATURATION, POSITION, FRAME, EXTENT = 0, 1, 2, 3, 6, 15
"""Columns of a piece: its first geom, its material, its pose, and the radius of the sphere around
it."""

(
    RESPONSE, FIRST, COUNT, RADIUS, BODY, WELD, MOVES, ENERGY, THREADED, NET, PASSING, RELUCTIVITY,
    STIFFENING, EXTRAPOLATED, ALONE, EXCESS, MUTUAL,
) = range(16, 33)  # fmt: skip
"""Further columns: the address of its response; its first node and how many there are; the radius
of the balls of charge; its body, the rigid body of that, and the degrees of freedom of that; its
energy in J in the potential of everything else; whether the piece is in the bore of a coil; its net
charge; twice the energy of the flux that passes from gap to gap, for a reluctivity of 1 and times
mu0; the reluctivity; the slope of that by what raises it; whether magnets are extrapolated, its
energy in their field alone, and by how much that is larger where they are nearer, for which see
`iron_answers.py`; and the potentials of net charges of 1 of all pieces, averaged over the piece, if
there is any gap."""

(
    PLACES, OUTER, POTENTIAL, CHARGE, CHANGE, MODE, INNER, ANSWERED, MAGNETS, NEARER, ANSWER,
    OTHERS, ROWS,
) = 0, *range(3, 15)  # fmt: skip
"""Rows of nodes: x y z in m; the potential in T m of everything except iron, and that of all; the
charges in T m^2; a row for their change; one for the modes of a saturating material; the potential
inside of the flux through gaps, for a reluctivity of 1, and how charges or modes answer it; the
potential of magnets alone, by how much it is higher where they are nearer, the charges in the
field of magnets alone, and those by everything else.

Potentials and charges are divided by the scale of moments, as polarizations are."""


@subroutine(forceinline=True)
def count_nodes(unions):
    """Return the numbers of columns for all nodes, and for those of the largest piece.

    They are -1 if a response is not known and could not be computed.
    """
    total = largest = 0
    for k in range(len(unions)):
        address = int(unions[k, OF_UNION])
        if address == 0:
            return -1, -1
        if address > 0:
            padded = memory.words(address, responses.START)[responses.PADDED]
            total, largest = total + padded, max(largest, padded)
    return total, largest


@subroutine
def unanswered_piece(unions, table):
    """Return the first geom of iron whose response could not be computed, or -1."""
    for k in range(len(unions)):
        if unions[k, OF_UNION] == 0.0:
            return pieces(table)[k].geom
    return -1


@subroutine(forceinline=True)
def read_pieces(rows, nodes, unions, scale, table, m, d, offsets):
    """Write one row for each piece that a field magnetizes, and its nodes; return how many.

    `scale` is that of moments, and `unions` are the rows of `iron_unions.py`.
    """
    position = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.geom_xmat // 8], memory.UNBOUNDED, 9)
    found, count, first = pieces(table), 0, 0
    for k in range(len(found)):
        if unions[k, OF_UNION] < 0.0:
            continue
        piece, row, address = found[k], rows[count], int(unions[k, OF_UNION])
        material = numbers_of(piece.material, m, offsets)
        words = memory.words(address, responses.START)
        numbers = memory.numbers(address, 1, responses.START)[0]
        row[GEOM], row[SUSCEPTIBILITY] = piece.geom, material[0]
        saturates = len(material) > 1 and material[0] > 0.0
        row[SATURATION] = scale * material[1] if saturates else 0.0
        copy(row[FRAME:EXTENT], frame[piece.geom])
        for axis in range(3):
            along = row[FRAME + 3 * axis : EXTENT]
            u, v, w = responses.CENTER, responses.CENTER + 1, responses.CENTER + 2
            shift = along[0] * numbers[u] + along[1] * numbers[v] + along[2] * numbers[w]
            row[POSITION + axis] = position[piece.geom, axis] + shift
        row[EXTENT] = numbers[responses.EXTENT]
        row[RESPONSE], row[FIRST], row[COUNT] = address, first, words[responses.COUNT]
        row[RADIUS] = numbers[responses.RADIUS]
        row[BODY], row[WELD], row[MOVES] = piece.body, piece.weld, piece.freedoms
        row[NET] = row[PASSING] = row[THREADED] = row[EXTRAPOLATED] = 0.0
        _place(nodes, row)
        first += words[responses.PADDED]
        count += 1
    return count


@subroutine
def _place(nodes, row):
    """Write the positions of the nodes of a piece, and no charges."""
    rows, own = response_rows(row), nodes_of(nodes, row)
    for axis in range(3):
        r0, r1, r2 = row[FRAME + 3 * axis], row[FRAME + 3 * axis + 1], row[FRAME + 3 * axis + 2]
        for k in range(own.shape[1]):
            along = r0 * rows[0, k] + r1 * rows[1, k] + r2 * rows[2, k]
            own[axis, k] = row[POSITION + axis] + along
    own[OUTER:] = 0.0


@subroutine
def response_rows(row):
    """Return the rows of a response: x y z of nodes, slopes, equilibrium, and both matrices."""
    address, rows = int(row[RESPONSE]), responses.ROWS + 2 * int(row[COUNT])
    padded = memory.words(address, responses.START)[responses.PADDED]
    return memory.numbers(address + 8 * responses.START, rows, padded)


@subroutine
def number_of(row, which):
    """Return a number of the response of a piece, such as its volume."""
    return memory.numbers(int(row[RESPONSE]), 1, responses.START)[0, which]


@subroutine
def nodes_of(nodes, row):
    """Return the rows of the nodes of a piece, without gaps: vectors of LLVM need that."""
    return memory.numbers(nodes.ctypes.data + 8 * ROWS * int(row[FIRST]), ROWS, int(row[COUNT]))


@subroutine
def radius_of_pair(piece, other):
    """Return the radius of the balls of charge of two pieces in each other's field."""
    a, b = piece[RADIUS], other[RADIUS]
    return math.sqrt(0.5 * (a * a + b * b))


@subroutine
def center_of(row):
    """Return the position of a piece."""
    return row[POSITION], row[POSITION + 1], row[POSITION + 2]


@subroutine
def reflected_center(row, mirror):
    """Return the position of a piece, reflected if there is a mirror."""
    x, y, z = center_of(row)
    if mirror[0] == 0.0:
        return x, y, z
    place = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
    return place[0], place[1], place[2]


@subroutine
def dipole_of_piece(nodes, row):
    """Return the dipole of a piece: its position, and its moment times the scale of moments."""
    x, y, z = center_of(row)
    own = nodes_of(nodes, row)
    mx = my = mz = 0.0
    for k in range(own.shape[1]):
        charge = own[CHARGE, k] / VACUUM_PERMEABILITY
        mx += charge * (own[0, k] - x)
        my += charge * (own[1, k] - y)
        mz += charge * (own[2, k] - z)
    return x, y, z, mx, my, mz


@subroutine(forceinline=True)
def read_mirror(table, m, d, offsets):
    """Return the mirror that a plane of iron is, or none."""
    found, mirror = planes(table), NO_MIRROR
    for k in range(len(found)):
        susceptibility = numbers_of(found[k].material, m, offsets)[0]
        mirror = mirror_of(found[k].geom, susceptibility, d, offsets)
    return mirror


@jitable
def ellipsoid(shape, a, b, c):
    """Return the semi-axes of an ellipsoid with a geom's proportions, and the geom's volume.

    The geom is given by its type and its size. Of a capsule, the whole length counts.
    """
    if shape == SPHERE:
        return a, a, a, 4.0 / 3.0 * math.pi * a**3
    if shape == ELLIPSOID:
        return a, b, c, 4.0 / 3.0 * math.pi * a * b * c
    if shape == BOX:
        return a, b, c, 8.0 * a * b * c
    if shape == CYLINDER:
        return a, a, b, 2.0 * math.pi * a * a * b
    return a, a, a + b, math.pi * a * a * (2.0 * b + 4.0 / 3.0 * a)
