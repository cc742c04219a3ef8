"""Magnetic forces and torques on bodies with dipole sites, written into MuJoCo's memory.

A dipole is a site: the site's z axis is the dipole's direction, and its `user` number is the moment
in A m^2 (if missing or zero, the site is not a dipole). The dipoles of one body form a magnet.
Magnets of one rigid body (bodies without a joint between them) do not act on each other.

A tuple whose name starts with `coupling` and whose elements are two bodies scales the interaction
of their magnets by `prm`, which must be the same for both elements. It applies to the named bodies
only, not to bodies welded to them. The factors of several tuples for one pair multiply.

Most magnets are grouped: one loop over all their dipoles computes the force on a dipole of a magnet
that can move. Magnets that are large or coupled are evaluated pairwise, with the larger one as the
source, which makes the loops long. The field at the smaller magnet determines both wrenches, which
are opposite about any common point.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import njit

from magmotor.dipoles import COINCIDENCE_SQUARED, sum_over_sources
from magmotor.mjcf import memory
from magmotor.mjcf.forces.marks import COUPLINGS
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

COUPLING = tuple(b"coupling")
ALIGNMENT = 1024
"""Bytes that MuJoCo may add for frames and alignment, generously."""

BODY_TYPE = 1
"""mjOBJ_BODY."""


@njit(forceinline=True)
def set_magnetic_wrenches(m, d, offsets, kinds, applied):
    """Overwrite the wrench of each body that can move and has dipoles.

    `m` and `d` are the words of mjModel and mjData, `offsets` is their layout, `kinds` are the bits
    of `forces_of`, and `applied` (nbody, 6) receives the wrenches. Returns the number of
    interactions, and two sites that coincide and act on each other; -1, -1 if there are none.
    """
    nsite = m[offsets.nsite // 8]
    if nsite == 0 or m[offsets.nuser_site // 8] == 0:
        return 0, -1, -1
    ntuple = m[offsets.ntuple // 8] if kinds & COUPLINGS else 0
    boundary, columns = _table_size(nsite, ntuple)
    stack = d.ctypes.data
    memory.mark_stack(stack)
    block = memory.allocate(stack, 8 * (ROWS * columns + 3 * ntuple), 64)
    table = memory.numbers(block, ROWS, columns)
    couplings = memory.numbers(block + 8 * ROWS * columns, ntuple, 3)
    couplings = couplings[: _read_couplings(couplings, m, offsets)]
    magnets, pairwise, end, mixed = _gather(table, boundary, couplings, m, d, offsets, applied)
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
    coincident = acting = 0
    for k in range(magnets):
        grouped = table[FIRST, k] < boundary
        if grouped and mixed and table[MOVES, k] > 0.0:
            coincident += _add_group_wrench(table, k, end, center, applied)
            acting += 1
        for i in range(pairwise):
            other = int(table[PAIRWISE, i])
            if (grouped or other > k) and _interact(table, k, other, couplings):
                coincident += _add_pair_wrenches(
                    table, k, other, boundary, couplings, center, applied
                )
                acting += 1
    i = j = -1
    if coincident > 0:
        i, j = _find_coincidence(couplings, m, d, offsets)
    memory.free_stack(stack)
    return acting, i, j


@njit
def _table_size(nsite, ntuple):
    """Return the first column of pairwise magnets in the table, and the number of columns."""
    boundary = _padded(nsite) + COUNT
    return boundary, boundary + (2 if ntuple == 0 else COUNT) * boundary


def stack_bytes(nsite: int, ntuple: int) -> int:
    """Return the bytes that `set_magnetic_wrenches` needs on the stack of `mjData`, at most."""
    _, columns = _table_size(nsite, ntuple)
    return 8 * (ROWS * columns + 3 * ntuple) + ALIGNMENT


@njit(forceinline=True)
def _gather(table, after, couplings, m, d, offsets, applied):
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
        separate = large or _is_coupled(body, couplings)
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
                after += _padded(j - first)
            else:
                end = j
                mixed = mixed or table[LABEL, 0] != weld
            magnets += 1
            if freedoms[weld] > 0:
                applied[body] = 0.0
    _pad(table, end)
    return magnets, pairwise, end, mixed


@njit
def _padded(size):
    """Round a number of sources up to a multiple of eight."""
    return (size + COUNT - 1) // COUNT * COUNT


@njit
def _pad(table, end):
    """Write eight sources without a moment at column `end`."""
    for row in range(FIRST):
        for j in range(COUNT):
            table[row, end + j] = FAR if row < 3 else 0.0


@njit(forceinline=True)
def _add_group_wrench(table, k, end, center, applied):
    """Add the wrench of all grouped magnets on magnet k; return how many dipoles coincide."""
    coincident = 0
    first = int(table[FIRST, k])
    for i in range(first, first + int(table[SIZE, k])):
        target = _dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], table, _padded(end))
        _add_wrench(int(table[BODY, k]), 1.0, target, total, center, applied)
        coincident += total[6]
    return coincident


@njit(forceinline=True)
def _interact(table, k, other, couplings):
    """Whether two magnets act on each other."""
    distinct = table[LABEL, int(table[FIRST, k])] != table[LABEL, int(table[FIRST, other])]
    moves = table[MOVES, k] + table[MOVES, other] > 0.0
    return distinct and moves and _factor(table[BODY, k], table[BODY, other], couplings) != 0.0


@njit(forceinline=True)
def _add_pair_wrenches(table, k, other, boundary, couplings, center, applied):
    """Add the wrenches of two magnets on each other; return how many dipoles coincide.

    Both follow from the field of the larger one.
    """
    if table[SIZE, k] > table[SIZE, other]:
        k, other = other, k
    moves, reacts = table[MOVES, k] > 0.0, table[MOVES, other] > 0.0
    first, start = int(table[FIRST, k]), int(table[FIRST, other])
    body, source = int(table[BODY, k]), int(table[BODY, other])
    factor = _factor(body, source, couplings)
    sources = memory.from_column(table, start)
    count = int(table[SIZE, other])
    count = count if start < boundary else _padded(count)
    coincident = 0
    for i in range(first, first + int(table[SIZE, k])):
        target = _dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], sources, count)
        if moves:
            _add_wrench(body, factor, target, total, center, applied)
        if reacts:
            _add_wrench(source, -factor, target, total, center, applied)
        coincident += total[6]
    return coincident


@njit
def _dipole(table, i):
    """Return the position and the moment of dipole i."""
    return table[0, i], table[1, i], table[2, i], table[3, i], table[4, i], table[5, i]


@njit
def _add_wrench(body, factor, target, total, center, applied):
    """Add the force and torque on a dipole, times a factor, to a body's wrench."""
    x, y, z, mx, my, mz = target
    fx, fy, fz, bx, by, bz, _ = total
    x -= center[body, 0]
    y -= center[body, 1]
    z -= center[body, 2]
    applied[body, 0] += factor * fx
    applied[body, 1] += factor * fy
    applied[body, 2] += factor * fz
    applied[body, 3] += factor * (my * bz - mz * by + y * fz - z * fy)
    applied[body, 4] += factor * (mz * bx - mx * bz + z * fx - x * fz)
    applied[body, 5] += factor * (mx * by - my * bx + x * fy - y * fx)


@njit
def _is_coupled(body, couplings):
    """Whether any coupling names the body."""
    coupled = False
    for k in range(len(couplings)):
        coupled = coupled or couplings[k, 0] == body or couplings[k, 1] == body
    return coupled


@njit
def _factor(body, other, couplings):
    """Return the factor by which couplings scale the interaction of two bodies."""
    factor = 1.0
    for k in range(len(couplings)):
        a, b = couplings[k, 0], couplings[k, 1]
        if (a == body and b == other) or (a == other and b == body):
            factor *= couplings[k, 2]
    return factor


@njit
def _read_couplings(couplings, m, offsets):
    """Write one row for each coupling, two bodies and a factor; return their number."""
    ntuple = len(couplings)
    start = memory.integers(m[offsets.tuple_adr // 8], ntuple)
    element = memory.integers(m[offsets.tuple_objid // 8], memory.UNBOUNDED)
    strength = memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)
    count = 0
    for k in range(ntuple):
        if _is_coupling(k, m, offsets):
            i = start[k]
            couplings[count, 0], couplings[count, 1] = element[i], element[i + 1]
            couplings[count, 2] = strength[0, i]
            count += 1
    return count


@njit
def invalid_coupling(m, offsets):
    """Return the first coupling that is not of two bodies with equal and finite `prm`, or -1."""
    ntuple = m[offsets.ntuple // 8]
    size = memory.integers(m[offsets.tuple_size // 8], ntuple)
    start = memory.integers(m[offsets.tuple_adr // 8], ntuple)
    kind = memory.integers(m[offsets.tuple_objtype // 8], memory.UNBOUNDED)
    strength = memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)
    for k in range(ntuple):
        if _is_coupling(k, m, offsets):
            i, j = start[k], start[k] + 1
            bodies = size[k] == 2 and kind[i] == BODY_TYPE and kind[j] == BODY_TYPE
            if not (bodies and strength[0, i] == strength[0, j] and abs(strength[0, i]) < np.inf):
                return k
    return -1


@njit
def _is_coupling(k, m, offsets):
    """Whether the name of tuple k starts with `coupling`."""
    start = memory.integers(m[offsets.name_tupleadr // 8], memory.UNBOUNDED)
    return memory.starts_with(m[offsets.names // 8] + start[k], COUPLING)


@njit
def _find_coincidence(couplings, m, d, offsets):
    """Find two dipole sites that coincide and act on each other; -1, -1 if there are none."""
    nsite = m[offsets.nsite // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, m[offsets.nuser_site // 8])
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    for i in range(nsite):
        for j in range(i):
            dipoles = moment[i, 0] != 0.0 and moment[j, 0] != 0.0
            gap = position[i] - position[j]
            near = np.sum(gap * gap) < COINCIDENCE_SQUARED
            a, b = weld_of[body_of[i]], weld_of[body_of[j]]
            may_act = a != b and freedoms[a] + freedoms[b] > 0
            if dipoles and near and may_act and _factor(body_of[i], body_of[j], couplings) != 0.0:
                return i, j
    return -1, -1
