"""Forces and fields of many dipoles within a tolerance: distant dipoles act as clusters.

A model declares a tolerance by `<numeric name="magnetic_tolerance" data="1e-3"/>`. The dipoles are
sorted into a tree of boxes, whose leaves are blocks of eight. A box acts by its multipoles where
they err by less than a fraction of the RMS force and of the RMS field of all dipoles. These are
estimated from neighbors; where the result is less, it is computed again.
"""

import math

from magmotor.dipoles import COINCIDENCE_SQUARED
from magmotor.mjcf import memory
from magmotor.mjcf.forces.box_tree import (
    BEGIN,
    CENTER,
    END,
    NEXT,
    RADIUS,
    VALUES,
    build,
    distance,
)
from magmotor.mjcf.forces.cluster_blocks import (
    HEADER,
    LEAF,
    NEAREST,
    NODE,
    REACH,
    STRENGTH,
    SUMMARY,
    allow,
    sum_on_all_blocks,
    sum_on_block,
    work_on_block,
)
from magmotor.mjcf.forces.dipole_table import FAR, LABEL, padded
from magmotor.mjcf.forces.multipoles import COUNTED, POWER, moments_of, next_moment
from magmotor.mjcf.forces.tiles import (
    BX,
    BY,
    BZ,
    FX,
    FY,
    FZ,
    MX,
    MY,
    MZ,
    SEPARATE,
    WIDTH,
    X,
    Y,
    Z,
)
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import broadcast, lane_numbers, load, total, where_less

FIXED = -1
"""Stands for the magnet of a dipole that cannot move."""

NEIGHBORS = 4
"""Blocks whose dipoles give the first estimate of the RMS field and force."""

CLUSTERED = 1000
"""Number of dipoles from which clusters may be faster than all pairs."""

ALL_PAIRS, SORTING = 0.65, 40.0
"""Times for a block, in units of that of the forces of one block on another: of another block if
each pair is computed once, and of sorting."""

ATTEMPTS = 4
"""Most sums for one result, of which the last allows no error: no estimate can be wrong in it."""


@subroutine
def cluster_bytes(ndipole):
    """Return the bytes that clusters take on the stack of mjData; tiles take fewer."""
    blocks = padded(ndipole) // COUNT
    return 8 * (blocks * (WIDTH + 2 * NODE + SUMMARY) + 2 * ndipole + ATTEMPTS * HEADER) + 512


@subroutine
def worthwhile_work(ndipole):
    """Return the work for which clusters are as fast as all pairs."""
    return ALL_PAIRS * (padded(ndipole) // COUNT) - SORTING


@subroutine
def are_sorted(table, end):
    """Whether the dipoles of each rigid body, except the world, follow one another."""
    last = 0.0
    for i in range(end):
        label = table[LABEL, i]
        if label != 0.0 and label < last:
            return False
        last = max(label, last)
    return True


@subroutine
def sum_by_clusters(model, stack, table, end, magnet, tolerance, most):
    """Compute the forces on the first `end` dipoles of a table, and the fields at them.

    `model` and `stack` are the addresses of mjModel and mjData, `magnet` holds numbers, or `FIXED`
    for dipoles that cannot move, and `most` is the most work that is worth it. Returns the dipoles
    as tiles, their order, whether any coincide, and whether they were computed.
    """
    # All memory is on the stack of mjData, and is free after the step.
    blocks = padded(end) // COUNT
    tiles = memory.numbers(memory.allocate(stack, 8 * WIDTH * blocks, 64), blocks, WIDTH)
    nodes = memory.numbers(memory.allocate(stack, 16 * NODE * blocks, 64), 2 * blocks, NODE)
    book = memory.numbers(memory.allocate(stack, 8 * SUMMARY * blocks, 64), blocks, SUMMARY)
    order = memory.words(memory.allocate(stack, 8 * end, 8), end)
    made = build(nodes, order, table, end)
    _fill(tiles, order, table, end)
    for k in range(made):
        _find_moments(nodes[k], tiles, end)
        if nodes[k, END] - nodes[k, BEGIN] == 1.0:
            book[int(nodes[k, BEGIN]), LEAF] = k
    _describe_blocks(book, nodes, order, table, magnet)
    field, force = _estimate(tiles, nodes, book, order, magnet)
    # A box may err by this part, since more boxes act at smaller tolerances; see the tests.
    share = 0.65 * tolerance * math.sqrt(math.sqrt(math.sqrt(tolerance)))
    for attempt in range(ATTEMPTS):
        allowed = share if attempt < ATTEMPTS - 1 else 0.0
        allow(nodes, book, allowed * field, allowed * force)
        if work_on_block(nodes, book) > most:
            return tiles, order, False, False
        sum_on_all_blocks(model, stack, tiles, nodes, book)
        before = field, force
        field, force = _root_mean_squares(tiles, order, magnet)
        # If the forces are smaller than estimated, too much was allowed.
        if field > 0.9 * before[0] and force > 0.9 * before[1]:
            break
    nearest = SEPARATE
    for b in range(blocks):
        nearest = min(nearest, book[b, NEAREST])
    return tiles, order, nearest < COINCIDENCE_SQUARED, True


@subroutine
def _fill(tiles, order, table, end):
    """Copy dipoles to blocks in a given order, and pad the last block."""
    for i in range(COUNT * len(tiles)):
        b, k = i // COUNT, i % COUNT
        for row in range(LABEL + 1):
            if i < end:
                tiles[b, COUNT * row + k] = table[row, order[i]]
            else:
                tiles[b, COUNT * row + k] = FAR if row < 3 else 0.0


@subroutine
def _find_moments(node, tiles, end):
    """Compute a node's moments about the center of its box, and the first moment left out."""
    zero = broadcast(0.0)
    cx, cy, cz = broadcast(node[CENTER]), broadcast(node[CENTER + 1]), broadcast(node[CENTER + 2])
    # Twenty names instead of an array keep the sums in registers.
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = zero
    s10 = s11 = s12 = s13 = s14 = s15 = s16 = s17 = s18 = s19 = zero
    for b in range(int(node[BEGIN]), int(node[END])):
        real = broadcast(float(end - COUNT * b))
        # The padding has no moment, but is so far away that its powers overflow: 0 x inf.
        t = moments_of(
            where_less(lane_numbers(), real, load(tiles, b, X) - cx, zero),
            where_less(lane_numbers(), real, load(tiles, b, Y) - cy, zero),
            where_less(lane_numbers(), real, load(tiles, b, Z) - cz, zero),
            load(tiles, b, MX),
            load(tiles, b, MY),
            load(tiles, b, MZ),
        )
        s0, s1, s2, s3, s4 = s0 + t[0], s1 + t[1], s2 + t[2], s3 + t[3], s4 + t[4]
        s5, s6, s7, s8, s9 = s5 + t[5], s6 + t[6], s7 + t[7], s8 + t[8], s9 + t[9]
        s10, s11, s12, s13, s14 = s10 + t[10], s11 + t[11], s12 + t[12], s13 + t[13], s14 + t[14]
        s15, s16, s17, s18, s19 = s15 + t[15], s16 + t[16], s17 + t[17], s18 + t[18], s19 + t[19]
    sums = (
        s0, s1, s2, s3, s4, s5, s6, s7, s8, s9,
        s10, s11, s12, s13, s14, s15, s16, s17, s18, s19,
    )  # fmt: skip
    for k in range(COUNTED):
        node[VALUES + k] = total(sums[k])
    node[VALUES + POWER] = next_moment(node[VALUES:], node[RADIUS])


@subroutine
def _describe_blocks(book, nodes, order, table, magnet):
    """Write the largest moment that can move, and the reach of the bodies, of each block."""
    count = len(order)
    for i in range(count):
        k = i // COUNT
        if i % COUNT == 0:
            book[k, REACH] = book[k, STRENGTH] = 0.0
        j = order[i]
        if magnet[j] == FIXED:
            continue
        moment = math.sqrt(table[3, j] ** 2 + table[4, j] ** 2 + table[5, j] ** 2)
        book[k, STRENGTH] = max(book[k, STRENGTH], moment)
        # The dipoles of a body follow one another in the table.
        node, label = nodes[int(book[k, LEAF])], table[LABEL, j]
        for step in (-1, 1):
            other = j
            while 0 <= other < count and table[LABEL, other] == label:
                book[k, REACH] = max(book[k, REACH], distance(node, table, other))
                other += step


@subroutine
def _estimate(tiles, nodes, book, order, magnet):
    """Return the RMS field and force by neighbors only."""
    allow(nodes, book, 0.0, 0.0)
    k = 0
    while k < 2 * len(tiles) - 1:
        begin, end = int(nodes[k, BEGIN]), int(nodes[k, END])
        if end - begin > NEIGHBORS:
            k += 1
            continue
        for b in range(begin, end):
            sum_on_block(b, tiles, nodes, book, k, int(nodes[k, NEXT]))
        k = int(nodes[k, NEXT])
    return _root_mean_squares(tiles, order, magnet)


@subroutine
def _root_mean_squares(tiles, order, magnet):
    """Return the RMS field and force of the dipoles that can move."""
    field = force = 0.0
    count = 0
    for i in range(len(order)):
        if magnet[order[i]] != FIXED:
            b, k = i // COUNT, i % COUNT
            force += tiles[b, FX + k] ** 2 + tiles[b, FY + k] ** 2 + tiles[b, FZ + k] ** 2
            field += tiles[b, BX + k] ** 2 + tiles[b, BY + k] ** 2 + tiles[b, BZ + k] ** 2
            count += 1
    return math.sqrt(field / max(count, 1)), math.sqrt(force / max(count, 1))
