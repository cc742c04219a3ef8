"""Forces and torques on bodies with dipole sites, written into MuJoCo's own memory.

A dipole is a site: its z axis is the dipole's direction, its `user` number the moment in A m^2
(zero or none: not a dipole). The dipoles of one body are a magnet. Magnets of one rigid body
(bodies without a joint between them) do not act on one another.

A tuple whose name starts with `coupling` and whose elements are two bodies says how strongly their
magnets act on one another: `prm` times, the same in both elements. It holds for the very bodies
named, not for those welded to them. The factors of several tuples for one pair multiply.

Most magnets are sources all together, in one loop for each dipole of a magnet that can move. Those
that are long or coupled are taken apart: pair by pair, with the longer as the source, so that the
loops are long, and from the field at the shorter follow both wrenches, which cancel about any one
point.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import njit

from magmotor.dipoles import COINCIDENCE_SQUARED, sum_over_sources
from magmotor.mjcf import memory
from magmotor.mjcf.forces.dipole_sites import all_moments
from magmotor.numerics.eights import COUNT

LABEL = 6
"""Row of the table below the dipoles' positions and moments: their rigid body."""

FIRST, SIZE, BODY, MOVES, APART, ROWS = 7, 8, 9, 10, 11, 12
"""Rows by magnet: its first dipole, their number, its body, whether that can move.

The last row lists the magnets that are taken apart.
"""

LONG = 16
"""Sites that make a body's magnet long."""

FAR = 1e150
"""Coordinates in meters of what fills them up; their square is still a number."""

COUPLING = tuple(b"coupling")
BODY_TYPE = 1
"""mjOBJ_BODY."""


@njit(forceinline=True)
def set_magnetic_wrenches(m, d, offsets, applied):
    """Overwrite the wrench of each body that can move and has dipoles; return how many act.

    `m` and `d` are the words of mjModel and mjData, `offsets` their layout, `applied` (nbody, 6)
    the wrenches.
    """
    nsite = m[offsets.nsite // 8]
    if nsite == 0 or m[offsets.nuser_site // 8] == 0 or not all_moments(m, offsets):
        return 0
    ntuple = m[offsets.ntuple // 8]
    border = _filled(nsite) + COUNT
    columns = border + (2 if ntuple == 0 else COUNT) * border
    stack = d.ctypes.data
    memory.mark_stack(stack)
    room = memory.allocate(stack, 8 * (ROWS * columns + 3 * ntuple), 64)
    table = memory.numbers(room, ROWS, columns)
    couplings = memory.numbers(room + 8 * ROWS * columns, ntuple, 3)
    count = _read_couplings(couplings, m, offsets) if ntuple > 0 else 0
    if count < 0:
        memory.free_stack(stack)
        _report_coupling(-1 - count, m, offsets)
        return 0
    couplings = couplings[:count]
    magnets, apart, end, mixed = _gather(table, border, couplings, m, d, offsets, applied)
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
    coincident = acting = 0
    for k in range(magnets):
        together = table[FIRST, k] < border
        if together and mixed and table[MOVES, k] > 0.0:
            coincident += _act_together(table, k, end, center, applied)
            acting += 1
        for i in range(apart):
            other = int(table[APART, i])
            if (together or other > k) and _act(table, k, other, couplings):
                coincident += _interact(table, k, other, border, couplings, center, applied)
                acting += 1
    i = j = -1
    if coincident > 0:
        i, j = _find_coincidence(couplings, m, d, offsets)
    memory.free_stack(stack)
    if i >= 0:
        names = m[offsets.names // 8]
        place = memory.integers(m[offsets.name_siteadr // 8], nsite)
        memory.fatal_coincidence(i, names + place[i], j, names + place[j])
    return acting


@njit(forceinline=True)
def _gather(table, after, couplings, m, d, offsets, applied):
    """Fill the table and clear the wrenches of magnets that can move.

    Dipoles of magnets taken together start at column 0, those of each taken apart, filled up, at
    `after`. Returns how many magnets there are, how many are apart, the end of those together, and
    whether these are of more than one rigid body.
    """
    nsite = m[offsets.nsite // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, m[offsets.nuser_site // 8])
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
    magnets = apart = end = site = 0
    mixed = False
    while site < nsite:
        body = body_of[site]
        weld = weld_of[body]
        long = site + LONG <= nsite and body_of[site + LONG - 1] == body
        separate = long or _is_coupled(body, couplings)
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
                table[APART, apart] = magnets
                apart += 1
                _fill_up(table, j)
                after += _filled(j - first)
            else:
                end = j
                mixed = mixed or table[LABEL, 0] != weld
            magnets += 1
            if freedoms[weld] > 0:
                applied[body] = 0.0
    _fill_up(table, end)
    return magnets, apart, end, mixed


@njit
def _filled(size):
    """Number of sources, filled up to whole eights."""
    return (size + COUNT - 1) // COUNT * COUNT


@njit
def _fill_up(table, end):
    """Put sources without a moment at `end`, as many as it may take."""
    for row in range(FIRST):
        for j in range(COUNT):
            table[row, end + j] = FAR if row < 3 else 0.0


@njit(forceinline=True)
def _act_together(table, k, end, center, applied):
    """Add to a magnet's wrench what all taken together do; return how many dipoles coincide."""
    coincident = 0
    first = int(table[FIRST, k])
    for i in range(first, first + int(table[SIZE, k])):
        target = _dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], table, _filled(end))
        _add(int(table[BODY, k]), 1.0, target, total, center, applied)
        coincident += total[6]
    return coincident


@njit(forceinline=True)
def _act(table, k, other, couplings):
    """Whether two magnets act on one another."""
    apart = table[LABEL, int(table[FIRST, k])] != table[LABEL, int(table[FIRST, other])]
    moves = table[MOVES, k] + table[MOVES, other] > 0.0
    return apart and moves and _factor(table[BODY, k], table[BODY, other], couplings) != 0.0


@njit(forceinline=True)
def _interact(table, k, other, border, couplings, center, applied):
    """Add to two magnets' wrenches what they do to one another; return how many dipoles coincide.

    It all follows from the field of the longer one.
    """
    if table[SIZE, k] > table[SIZE, other]:
        k, other = other, k
    moves, reacts = table[MOVES, k] > 0.0, table[MOVES, other] > 0.0
    first, start = int(table[FIRST, k]), int(table[FIRST, other])
    body, source = int(table[BODY, k]), int(table[BODY, other])
    factor = _factor(body, source, couplings)
    sources = memory.from_column(table, start)
    count = int(table[SIZE, other])
    count = count if start < border else _filled(count)
    coincident = 0
    for i in range(first, first + int(table[SIZE, k])):
        target = _dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], sources, count)
        if moves:
            _add(body, factor, target, total, center, applied)
        if reacts:
            _add(source, -factor, target, total, center, applied)
        coincident += total[6]
    return coincident


@njit
def _dipole(table, i):
    """Position and moment of a dipole."""
    return table[0, i], table[1, i], table[2, i], table[3, i], table[4, i], table[5, i]


@njit
def _add(body, factor, target, total, center, applied):
    """Add to a body's wrench the force and torque on a dipole, times a factor."""
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
    """Whether a coupling names the body."""
    coupled = False
    for k in range(len(couplings)):
        coupled = coupled or couplings[k, 0] == body or couplings[k, 1] == body
    return coupled


@njit
def _factor(body, other, couplings):
    """How many times as strongly the magnets of two bodies act on one another."""
    factor = 1.0
    for k in range(len(couplings)):
        a, b = couplings[k, 0], couplings[k, 1]
        if (a == body and b == other) or (a == other and b == body):
            factor *= couplings[k, 2]
    return factor


@njit
def _read_couplings(couplings, m, offsets):
    """Write the couplings in rows: two bodies and a factor.

    Returns how many there are, or -1 - k when tuple k should be one and is not of two bodies.
    """
    ntuple = len(couplings)
    size = memory.integers(m[offsets.tuple_size // 8], ntuple)
    start = memory.integers(m[offsets.tuple_adr // 8], ntuple)
    kind = memory.integers(m[offsets.tuple_objtype // 8], memory.UNBOUNDED)
    element = memory.integers(m[offsets.tuple_objid // 8], memory.UNBOUNDED)
    strength = memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)
    place = memory.integers(m[offsets.name_tupleadr // 8], ntuple)
    count = 0
    for k in range(ntuple):
        if memory.starts_with(m[offsets.names // 8] + place[k], COUPLING):
            i, j = start[k], start[k] + 1
            bodies = size[k] == 2 and kind[i] == BODY_TYPE and kind[j] == BODY_TYPE
            if not (bodies and strength[0, i] == strength[0, j]):
                return -1 - k
            couplings[count, 0], couplings[count, 1] = element[i], element[j]
            couplings[count, 2] = strength[0, i]
            count += 1
    return count


@njit
def _report_coupling(k, m, offsets):
    """Raise MuJoCo's error that names a tuple."""
    place = memory.integers(m[offsets.name_tupleadr // 8], memory.UNBOUNDED)
    memory.fatal_coupling(k, m[offsets.names // 8] + place[k])


@njit
def _find_coincidence(couplings, m, d, offsets):
    """Two dipole sites that coincide and act on one another; -1, -1 if there are none."""
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
