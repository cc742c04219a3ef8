"""Forces and fields of many dipoles within a tolerance: distant dipoles act as clusters.

A model declares a tolerance by `<numeric name="magnetic_tolerance" data="1e-3"/>`. The dipoles are
sorted into a tree of boxes, whose leaves are blocks of eight. On a block, a box of the tree acts by
its multipoles if the first moment left out is small enough there; else its halves act, and at last
each of its dipoles. Small enough means a fraction of the RMS force and of the RMS field of all
dipoles. These are estimated from neighbors; where the result is less, it is computed again.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
import math
from functools import cache

from numba import njit, types

from magmotor.dipoles import COINCIDENCE_SQUARED, inner
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
from magmotor.mjcf.forces.dipole_table import FAR, LABEL, padded
from magmotor.mjcf.forces.multipoles import (
    COUNTED,
    POWER,
    moments_of,
    multipole_force_and_field,
    next_moment,
)
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
    OWN,
    SEPARATE,
    WIDTH,
    X,
    Y,
    Z,
    terms_of_pairs,
)
from magmotor.numerics.numba_cache import compiled_once
from magmotor.numerics.simd import (
    COUNT,
    broadcast,
    fused,
    lane_numbers,
    load,
    minimum,
    store,
    total,
    where_equal,
    where_less,
)

FIXED = -1
"""Stands for the magnet of a dipole that cannot move."""

NEED, NODE = VALUES + COUNTED, VALUES + COUNTED + 1
"""Column of the gap that a node needs to act by its multipoles, and number of columns."""

NEAREST_GAP = 1.25
"""Least gap between a box and a block, in radii of the box, for the multipoles to converge."""

LEAF, REACH, STRENGTH, NEAREST, SUMMARY = range(5)
"""Columns of a block: its node, distance within which its bodies' dipoles are from its center,
largest moment that can move, and least squared distance."""

NEIGHBORS = 4
"""Blocks whose dipoles give the first estimate of the RMS field and force."""

CLUSTERED = 1000
"""Number of dipoles from which clusters may be faster than all pairs."""

SAMPLED = 16
"""One block in so many is asked for its work."""

ALL_PAIRS, SORTING, VISIT, MULTIPOLES = 0.65, 40.0, 0.1, 0.4
"""Times in units of that of the forces of one block on another, for a block: of another block if
each pair is computed once, of sorting, of a visit of a node, and of its multipoles."""

SPAN = 8
"""Blocks of a task, about 100 us of work."""

BLOCKS, TILES, NODES, BOOK, HEADER = range(5)
"""Words of a job."""

_word, _int = types.int64, types.int32
_dispatch = types.ExternalFunction("mju_dispatch", types.void(_word, _word, _word, _word, _int))
_task_address = memory.variable("magmotor_cluster_task")


@cache
def bind() -> None:
    """Bind the task to its symbol in compiled code."""
    memory.bind_variable("magmotor_cluster_task", _address())


@cache
def _address() -> ctypes.c_int64:
    return ctypes.c_int64(_task().address)


@njit
def cluster_bytes(ndipole):
    """Return the bytes that clusters take on the stack of mjData; tiles take fewer."""
    blocks = padded(ndipole) // COUNT
    return 8 * (blocks * (WIDTH + 2 * NODE + SUMMARY) + 2 * ndipole + HEADER) + 512


@njit
def worthwhile_work(ndipole):
    """Return the work for which clusters are as fast as all pairs."""
    return ALL_PAIRS * (padded(ndipole) // COUNT) - SORTING


@njit
def are_sorted(table, end):
    """Whether the dipoles of each rigid body, except the world, follow one another."""
    last = 0.0
    for i in range(end):
        label = table[LABEL, i]
        if label != 0.0 and label < last:
            return False
        last = max(label, last)
    return True


@njit
def sum_by_clusters(model, stack, table, end, magnet, tolerance, most):
    """Compute the forces on the first `end` dipoles of a table, and the fields at them.

    `model` and `stack` are the addresses of mjModel and mjData, `magnet` holds numbers, or `FIXED`
    for dipoles that cannot move, and `most` is the most work that is worth it. Returns the dipoles
    as tiles, their order, whether any coincide, and whether they were computed.
    """
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
    address = memory.allocate(stack, 8 * HEADER, 8)
    job = memory.words(address, HEADER)
    job[BLOCKS], job[TILES], job[NODES] = blocks, tiles.ctypes.data, nodes.ctypes.data
    job[BOOK] = book.ctypes.data
    # A box may err by this part, since more boxes act at smaller tolerances; see the tests.
    share = 0.65 * tolerance * math.sqrt(math.sqrt(math.sqrt(tolerance)))
    for attempt in range(4):
        # The last attempt allows no error: no estimate can be wrong in it.
        allowed = share if attempt < 3 else 0.0
        _allow(nodes, book, allowed * field, allowed * force)
        if _work(nodes, book) > most:
            return tiles, order, False, False
        _dispatch(model, stack, _task_address(), address, (blocks + SPAN - 1) // SPAN)
        before = field, force
        field, force = _root_mean_squares(tiles, order, magnet)
        if field > 0.9 * before[0] and force > 0.9 * before[1]:
            break
    nearest = SEPARATE
    for b in range(blocks):
        nearest = min(nearest, book[b, NEAREST])
    return tiles, order, nearest < COINCIDENCE_SQUARED, True


@njit(error_model="numpy")
def _allow(nodes, book, field, force):
    """Write the gap between a block and each box from which on the box errs by less than allowed.

    The field of the first moment left out, M, is at most 20 M/r^6, and its gradient 120 M/r^7; a
    geometric series bounds the rest.
    """
    strength = 0.0
    for b in range(len(book)):
        strength = max(strength, book[b, STRENGTH])
    for k in range(2 * len(book) - 1):
        radius, error = nodes[k, RADIUS], 20.0 * nodes[k, VALUES + POWER]
        nodes[k, NEED] = math.inf
        if field > 0.0 and force > 0.0 and error < math.inf:
            nodes[k, NEED] = max(
                NEAREST_GAP * radius,
                _gap(radius, error / field, 5),
                _gap(radius, 6.0 * error * strength / force, 6),
            )


@njit(error_model="numpy")
def _gap(radius, value, power):
    """Return g with (g - radius) g^power = value, or a little more."""
    if radius == 0.0 or value == 0.0:
        return 0.0
    g = 2.0 * radius
    while _product(g, radius, power) < value:
        g *= 2.0
    for _ in range(4):  # Newton's method, from above
        slope = _product(g, radius, power) * (1.0 / (g - radius) + power / g)
        g -= (_product(g, radius, power) - value) / slope
    return g


@njit
def _product(g, radius, power):
    """Return (g - radius) g^power; the C library's power has other bits on other processors."""
    value = g - radius
    for _ in range(power):
        value *= g
    return value


@njit
def _work(nodes, book):
    """Estimate the work on a block, in units of that of another block's dipoles.

    It is counted for one block in sixteen.
    """
    work = 0.0
    counted = 0
    for b in range(0, len(book), SAMPLED):
        counted += 1
        k = 0
        leaf, reach = int(book[b, LEAF]), book[b, REACH]
        x, y, z = nodes[leaf, CENTER], nodes[leaf, CENTER + 1], nodes[leaf, CENTER + 2]
        while k < 2 * len(book) - 1:
            work += VISIT
            if _may_act(nodes, k, x, y, z, nodes[leaf, RADIUS], reach):
                work += MULTIPOLES
                k = int(nodes[k, NEXT])
            else:
                work += nodes[k, END] - nodes[k, BEGIN] == 1.0
                k += 1
    return work / counted


@njit
def _fill(tiles, order, table, end):
    """Copy dipoles to blocks in a given order, and pad the last block."""
    for i in range(COUNT * len(tiles)):
        b, k = i // COUNT, i % COUNT
        for row in range(LABEL + 1):
            if i < end:
                tiles[b, COUNT * row + k] = table[row, order[i]]
            else:
                tiles[b, COUNT * row + k] = FAR if row < 3 else 0.0


@njit(error_model="numpy")
def _find_moments(node, tiles, end):
    """Compute a node's moments about the center of its box, and the first moment left out."""
    zero = broadcast(0.0)
    cx, cy, cz = broadcast(node[CENTER]), broadcast(node[CENTER + 1]), broadcast(node[CENTER + 2])
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = zero
    s10 = s11 = s12 = s13 = s14 = s15 = s16 = s17 = s18 = s19 = zero
    for b in range(int(node[BEGIN]), int(node[END])):
        real = broadcast(float(end - COUNT * b))
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


@njit
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


@njit
def _estimate(tiles, nodes, book, order, magnet):
    """Return the RMS field and force by neighbors only."""
    _allow(nodes, book, 0.0, 0.0)
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


@njit
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


@compiled_once(types.void(_word, _word, _word, _int, _int), error_model="numpy")
def _task(checksum: int):
    """Define the task, which computes the forces on some blocks."""

    def task(model, data, address, thread, index):
        _ = checksum
        job = memory.words(address, HEADER)
        blocks = job[BLOCKS]
        tiles = memory.numbers(job[TILES], blocks, WIDTH)
        nodes = memory.numbers(job[NODES], 2 * blocks, NODE)
        book = memory.numbers(job[BOOK], blocks, SUMMARY)
        for b in range(SPAN * index, min(SPAN * (index + 1), blocks)):
            sum_on_block(b, tiles, nodes, book, 0, 2 * blocks - 1)

    return task


@njit(inline="always")
def _may_act(nodes, k, x, y, z, radius, reach):
    """Whether the multipoles of node k may act on a block with a center, a radius and a reach.

    No dipole of the block's own bodies may be in the box.
    """
    x, y, z = nodes[k, CENTER] - x, nodes[k, CENTER + 1] - y, nodes[k, CENTER + 2] - z
    away = max(nodes[k, NEED] + radius, nodes[k, RADIUS] + reach)
    return x * x + y * y + z * z > away * away


@njit(error_model="numpy")
def sum_on_block(b, tiles, nodes, book, first, last):
    """Write the force on each dipole of a block, and the field at it, by some of the nodes."""
    tx, ty, tz = load(tiles, b, X), load(tiles, b, Y), load(tiles, b, Z)
    ax, ay, az = load(tiles, b, MX), load(tiles, b, MY), load(tiles, b, MZ)
    own, leaf = load(tiles, b, OWN), int(book[b, LEAF])
    center = nodes[leaf, CENTER], nodes[leaf, CENTER + 1], nodes[leaf, CENTER + 2]
    radius, reach = nodes[leaf, RADIUS], book[b, REACH]
    nearest = separate = broadcast(SEPARATE)
    fx = fy = fz = bx = by = bz = broadcast(0.0)
    k = first if book[b, STRENGTH] > 0.0 else last
    while k < last:
        x, y, z = center
        if _may_act(nodes, k, x, y, z, radius, reach):
            gx, gy, gz, cx, cy, cz = multipole_force_and_field(
                nodes, k, VALUES,
                tx - broadcast(nodes[k, CENTER]),
                ty - broadcast(nodes[k, CENTER + 1]),
                tz - broadcast(nodes[k, CENTER + 2]),
                ax, ay, az,
            )  # fmt: skip
            fx, fy, fz, bx, by, bz = fx + gx, fy + gy, fz + gz, bx + cx, by + cy, bz + cz
            k = int(nodes[k, NEXT])
            continue
        j, divided = int(nodes[k, BEGIN]), nodes[k, END] - nodes[k, BEGIN] > 1.0
        k += 1
        if not divided:
            for i in range(COUNT):
                dx = tx - broadcast(tiles[j, X + i])
                dy = ty - broadcast(tiles[j, Y + i])
                dz = tz - broadcast(tiles[j, Z + i])
                mx, my, mz = (
                    broadcast(tiles[j, MX + i]),
                    broadcast(tiles[j, MY + i]),
                    broadcast(tiles[j, MZ + i]),
                )
                square = inner(dx, dy, dz, dx, dy, dz)
                square = where_equal(broadcast(tiles[j, OWN + i]), own, separate, square)
                nearest = where_less(square, nearest, square, nearest)
                gx, gy, gz, near, _, less = terms_of_pairs(
                    dx, dy, dz, square, ax, ay, az, mx, my, mz
                )
                fx, fy, fz = fx + gx, fy + gy, fz + gz
                bx = fused(near, dx, fused(less, mx, bx))
                by = fused(near, dy, fused(less, my, by))
                bz = fused(near, dz, fused(less, mz, bz))
    store(tiles, b, FX, fx)
    store(tiles, b, FY, fy)
    store(tiles, b, FZ, fz)
    store(tiles, b, BX, bx)
    store(tiles, b, BY, by)
    store(tiles, b, BZ, bz)
    book[b, NEAREST] = minimum(nearest)
