"""The dipoles of a model in one state, as a table for the loops of `magmotor.dipoles`.

The dipoles of one body form a magnet, and so does each piece of iron, and each magnet by its geom.
"""

from typing import NamedTuple

from magmotor.dipoles import sum_over_sources
from magmotor.mjcf import memory
from magmotor.mjcf.declarations.table import magnets as magnets_of
from magmotor.mjcf.declarations.table import sites as sites_of
from magmotor.mjcf.forces.iron_pieces import BODY as BODY_OF_PIECE
from magmotor.mjcf.forces.iron_pieces import GEOM as GEOM_OF_PIECE
from magmotor.mjcf.forces.iron_pieces import MOVES as MOVES_OF_PIECE
from magmotor.mjcf.forces.iron_pieces import POSITION as POSITION_OF_PIECE
from magmotor.mjcf.forces.iron_pieces import WELD as WELD_OF_PIECE
from magmotor.mjcf.forces.mirror import add_image, mirrored
from magmotor.mjcf.forces.shaped_magnets import BODY as BODY_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import (
    COIL,
    GEOM,
    KIND,
    MOMENT,
    POINT,
    POSITION,
    RADIUS,
    SPREAD,
)
from magmotor.mjcf.forces.shaped_magnets import MOVES as MOVES_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import WELD as WELD_OF_SHAPE
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine

LABEL = 6
"""Row of the table with the dipoles' rigid bodies, after positions and moments."""

FIRST, SIZE, BODY, MOVES, PAIRWISE = 7, 8, 9, 10, 11
"""Rows by magnet: first dipole, number of dipoles, body, and whether the body can move.

The last one lists the magnets that are evaluated pairwise.
"""

ELEMENT, ROWS = 12, 13
"""Row by dipole: its site, or, for iron and magnets by geom, the number of sites plus the geom."""

NOBODY = -2.0
"""Label that no dipole in the table has."""

FAR = 1e150
"""Coordinates (m) of padding dipoles; their square does not overflow."""


class Magnets(NamedTuple):
    """What a table contains: how many magnets, how many of them pairwise, and where they end.

    Grouped dipoles are in columns 0 to `end`, of which those from `shaped` on are magnets by their
    geom; `mixed` is whether they belong to more than one rigid body. Pairwise magnets, each padded,
    are in columns `boundary` to `after`. The last magnets are pieces of iron, in columns from
    `iron` on, where no sum over dipoles reaches; the first `sources` are those that have a moment.
    """

    number: int
    sources: int
    pairwise: int
    shaped: int
    end: int
    iron: int
    mixed: bool
    boundary: int
    after: int


@subroutine
def table_size(dipoles, coupled):
    """Return the first column of pairwise magnets in the table, and the number of columns."""
    boundary = padded(dipoles) + COUNT
    return boundary, boundary + (COUNT if coupled else 2) * boundary


@subroutine(forceinline=True)
def gather(table, boundary, scale, drives, pieces, shapes, own, count, m, d, offsets):
    """Fill the table with dipole sites, pieces of iron and magnets; return the `Magnets`.

    `scale` multiplies all moments, and `drives`, unless it is empty, those of the sites of coils;
    `own` is the table of the model, of whose magnets the first
    `count` act.
    """
    nsite = m[offsets.nsite // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, m[offsets.nuser_site // 8])
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
    declared, sites = magnets_of(own), sites_of(own)
    magnets = pairwise = end = 0
    after = boundary
    mixed = False
    for magnet in range(count):
        row = declared[magnet]
        separate = row.separate != 0
        first = after if separate else end
        j = first
        for site in range(row.first_site, row.end_site):
            strength = moment[site, 0]
            if strength != 0.0:
                if len(drives) > 0 and sites[site].coil >= 0:
                    strength *= drives[sites[site].coil]
                strength *= scale
                for k in range(3):
                    table[k, j] = position[site, k]
                    table[3 + k, j] = strength * frame[site, 3 * k + 2]
                table[LABEL, j] = row.weld
                table[ELEMENT, j] = site
                j += 1
        if j > first:
            table[FIRST, magnets] = first
            table[SIZE, magnets] = j - first
            table[BODY, magnets] = row.body
            table[MOVES, magnets] = row.freedoms
            if separate:
                table[PAIRWISE, pairwise] = magnets
                pairwise += 1
                _pad(table, j)
                after += padded(j - first)
            else:
                end = j
                mixed = mixed or table[LABEL, 0] != row.weld
            magnets += 1
    shaped = end
    for i in range(len(shapes)):
        _add_shape(table, end, magnets, shapes[i], nsite)
        mixed = mixed or table[LABEL, 0] != table[LABEL, end]
        end += 1
        magnets += 1
    _pad(table, end)
    iron, sources = end + COUNT, magnets
    for i in range(len(pieces)):
        _add_piece(table, iron + i, magnets, pieces[i], nsite)
        magnets += 1
    return Magnets(magnets, sources, pairwise, shaped, end, iron, mixed, boundary, after)


@subroutine
def _add_piece(table, column, magnet, piece, nsite):
    """Write a piece of iron to a column; it acts by its nodes, and has no moment here."""
    geom = int(piece[GEOM_OF_PIECE])
    for k in range(3):
        table[k, column] = piece[POSITION_OF_PIECE + k]
        table[3 + k, column] = 0.0
    table[LABEL, column], table[ELEMENT, column] = piece[WELD_OF_PIECE], nsite + geom
    table[FIRST, magnet], table[SIZE, magnet] = column, 1
    table[BODY, magnet], table[MOVES, magnet] = piece[BODY_OF_PIECE], piece[MOVES_OF_PIECE]


@subroutine
def _add_shape(table, end, magnet, shape, nsite):
    """Write the dipole of a magnet by its geom to column `end`."""
    for k in range(3):
        table[k, end], table[3 + k, end] = shape[POSITION + k], shape[MOMENT + k]
    table[LABEL, end], table[ELEMENT, end] = shape[WELD_OF_SHAPE], nsite + shape[GEOM]
    table[FIRST, magnet], table[SIZE, magnet] = end, 1
    table[BODY, magnet], table[MOVES, magnet] = shape[BODY_OF_SHAPE], shape[MOVES_OF_SHAPE]


@subroutine
def read_points(rows, table, number):
    """Write a row as of `shaped_magnets.py` for each dipole of the first magnets; return how many.

    The number is that of magnets.
    """
    count = 0
    for k in range(number):
        first = int(table[FIRST, k])
        for i in range(first, first + int(table[SIZE, k])):
            row = rows[count]
            row[GEOM] = row[KIND] = POINT
            row[RADIUS] = row[SPREAD] = row[COIL] = 0.0
            row[BODY_OF_SHAPE], row[WELD_OF_SHAPE] = table[BODY, k], table[LABEL, i]
            row[MOVES_OF_SHAPE] = table[MOVES, k]
            for axis in range(3):
                row[POSITION + axis], row[MOMENT + axis] = table[axis, i], table[3 + axis, i]
            count += 1
    return count


@subroutine
def padded(size):
    """Round a number of sources up to a multiple of eight."""
    return (size + COUNT - 1) // COUNT * COUNT


@subroutine
def _pad(table, end):
    """Write eight sources without a moment at column `end`."""
    for row in range(FIRST):
        for j in range(COUNT):
            table[row, end + j] = FAR if row < 3 else 0.0


@subroutine
def dipole(table, i):
    """Return the position and the moment of dipole i."""
    return table[0, i], table[1, i], table[2, i], table[3, i], table[4, i], table[5, i]


@subroutine
def sum_over_table(target, table, end, magnets):
    """Sum the force on a dipole, and the field at it, over all sources, whatever their labels.

    Of the grouped dipoles, only those before column `end` count. The arguments and the result are
    as in `magmotor.dipoles.sum_over_sources`.
    """
    total = sum_over_sources(target, NOBODY, table, end)
    if magnets.pairwise > 0:
        others = memory.from_column(table, magnets.boundary)
        count = magnets.after - magnets.boundary
        more = sum_over_sources(target, NOBODY, others, count)
        total = (
            total[0] + more[0], total[1] + more[1], total[2] + more[2], total[3] + more[3],
            total[4] + more[4], total[5] + more[5], total[6] or more[6],
        )  # fmt: skip
    return total


@subroutine
def add_images(total, target, table, end, magnets, mirror):
    """Add the force and the field of the images of the same sources, if there is a mirror."""
    if mirror[0] == 0.0:
        return total
    there = sum_over_table(mirrored(mirror, target), table, end, magnets)
    return add_image(total, there, mirror)
