"""The dipoles of a model in one state, as a table for the loops of `magmotor.dipoles`.

A dipole is a site: the site's z axis is the dipole's direction, and its `user` number is the moment
in A m^2 (if missing or zero, the site is not a dipole). The dipoles of one body form a magnet.
Magnets of one rigid body (bodies without a joint between them) do not act on each other.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from numba import njit

from magmotor.mjcf import memory
from magmotor.mjcf.forces.couplings import is_coupled
from magmotor.numerics.simd import COUNT

LABEL = 6
"""Row of the table with the dipoles' rigid bodies, after positions and moments."""

FIRST, SIZE, BODY, MOVES, PAIRWISE, ROWS = 7, 8, 9, 10, 11, 12
"""Rows by magnet: first dipole, number of dipoles, body, and whether the body can move.

The last row lists the magnets that are evaluated pairwise.
"""

LARGE = 16
"""Number of sites that makes a body's magnet large."""

FAR = 1e150
"""Coordinates (m) of padding dipoles; their square does not overflow."""


@njit
def table_size(nsite, ntuple):
    """Return the first column of pairwise magnets in the table, and the number of columns."""
    boundary = padded(nsite) + COUNT
    return boundary, boundary + (2 if ntuple == 0 else COUNT) * boundary


@njit(forceinline=True)
def gather(table, after, couplings, m, d, offsets, applied):
    """Fill the table, and clear the wrenches of magnets that can move.

    The dipoles of grouped magnets start at column 0, and those of pairwise magnets, each padded, at
    column `after`. Returns the number of magnets, the number of pairwise ones, the end of the
    grouped dipoles, and whether these belong to more than one rigid body.
    """
    nsite = m[offsets.nsite // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, m[offsets.nuser_site // 8])
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
    magnets = pairwise = end = site = 0
    mixed = False
    while site < nsite:
        body = body_of[site]
        weld = weld_of[body]
        large = site + LARGE <= nsite and body_of[site + LARGE - 1] == body
        separate = large or is_coupled(body, couplings)
        first = after if separate else end
        j = first
        while site < nsite and body_of[site] == body:
            strength = moment[site, 0]
            if strength != 0.0:
                for k in range(3):
                    table[k, j] = position[site, k]
                    table[3 + k, j] = strength * frame[site, 3 * k + 2]
                table[LABEL, j] = weld
                j += 1
            site += 1
        if j > first:
            table[FIRST, magnets] = first
            table[SIZE, magnets] = j - first
            table[BODY, magnets] = body
            table[MOVES, magnets] = freedoms[weld]
            if separate:
                table[PAIRWISE, pairwise] = magnets
                pairwise += 1
                _pad(table, j)
                after += padded(j - first)
            else:
                end = j
                mixed = mixed or table[LABEL, 0] != weld
            magnets += 1
            if freedoms[weld] > 0:
                applied[body] = 0.0
    _pad(table, end)
    return magnets, pairwise, end, mixed


@njit
def padded(size):
    """Round a number of sources up to a multiple of eight."""
    return (size + COUNT - 1) // COUNT * COUNT


@njit
def _pad(table, end):
    """Write eight sources without a moment at column `end`."""
    for row in range(FIRST):
        for j in range(COUNT):
            table[row, end + j] = FAR if row < 3 else 0.0


@njit
def dipole(table, i):
    """Return the position and the moment of dipole i."""
    return table[0, i], table[1, i], table[2, i], table[3, i], table[4, i], table[5, i]
