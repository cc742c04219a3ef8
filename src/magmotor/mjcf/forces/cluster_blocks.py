"""Forces and fields on one block of eight dipoles, by the boxes of a tree.

A box acts on the block by its multipoles if the first moment left out is small enough there; else
its halves act, and at last each of its dipoles.
"""

import math

from magmotor.dipoles import inner
from magmotor.mjcf import memory
from magmotor.mjcf.forces.box_tree import BEGIN, CENTER, END, NEXT, RADIUS, VALUES
from magmotor.mjcf.forces.multipoles import COUNTED, POWER, multipole_force_and_field
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
    dispatch,
    terms_of_pairs,
)
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import broadcast, fused, load, minimum, store, where_equal, where_less

NEED, NODE = VALUES + COUNTED, VALUES + COUNTED + 1
"""Column of the gap that a node needs to act by its multipoles, and number of columns."""

NEAREST_GAP = 1.25
"""Least gap between a box and a block, in radii of the box, for the multipoles to converge."""

LEAF, REACH, STRENGTH, NEAREST, SUMMARY = range(5)
"""Columns of a block: its node, distance within which its bodies' dipoles are from its center,
largest moment that can move, and least squared distance."""

SAMPLED = 16
"""One block in so many is asked for its work."""

VISIT, MULTIPOLES = 0.1, 0.4
"""Times of a visit of a node, and of its multipoles, in units of that of a block's dipoles."""

SPAN = 8
"""Blocks of a task, about 100 µs of work."""

BLOCKS, TILES, NODES, BOOK, HEADER = range(5)
"""Words of a job."""

_word, _int = types.int64, types.int32
_task_address = memory.address_of("magmotor_cluster_task")


def bind() -> None:
    """Bind the task to its symbol in compiled code."""
    memory.bind_compiled("magmotor_cluster_task", _task())


@subroutine
def allow(nodes, book, field, force):
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


@subroutine
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


@subroutine
def _product(g, radius, power):
    """Return (g - radius) g^power; the C library's power has other bits on other processors."""
    value = g - radius
    for _ in range(power):
        value *= g
    return value


@subroutine
def work_on_block(nodes, book):
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


@subroutine
def sum_on_all_blocks(model, stack, tiles, nodes, book):
    """Write the forces on all dipoles, and the fields at them, by the nodes of the whole tree."""
    address = memory.allocate(stack, 8 * HEADER, 8)
    job = memory.words(address, HEADER)
    job[BLOCKS], job[TILES], job[NODES] = len(book), tiles.ctypes.data, nodes.ctypes.data
    job[BOOK] = book.ctypes.data
    dispatch(model, stack, _task_address(), address, (len(book) + SPAN - 1) // SPAN)


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


@subroutine
def sum_on_block(b, tiles, nodes, book, first, last):
    """Write the force on each dipole of a block, and the field at it, by some of the nodes."""
    tx, ty, tz = load(tiles, b, X), load(tiles, b, Y), load(tiles, b, Z)
    ax, ay, az = load(tiles, b, MX), load(tiles, b, MY), load(tiles, b, MZ)
    own, leaf = load(tiles, b, OWN), int(book[b, LEAF])
    center = nodes[leaf, CENTER], nodes[leaf, CENTER + 1], nodes[leaf, CENTER + 2]
    radius, reach = nodes[leaf, RADIUS], book[b, REACH]
    nearest = separate = broadcast(SEPARATE)
    fx = fy = fz = bx = by = bz = broadcast(0.0)
    # What cannot move needs no force.
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
            # The whole subtree is done.
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
                # Dipoles of the own rigid body, the target among them, count as infinitely far.
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


@subroutine(inline="always")
def _may_act(nodes, k, x, y, z, radius, reach):
    """Whether the multipoles of node k may act on a block with a center, a radius and a reach.

    No dipole of the block's own bodies may be in the box.
    """
    x, y, z = nodes[k, CENTER] - x, nodes[k, CENTER + 1] - y, nodes[k, CENTER + 2] - z
    # Multipoles include all dipoles of a box, also those that must not act on the block.
    away = max(nodes[k, NEED] + radius, nodes[k, RADIUS] + reach)
    return x * x + y * y + z * z > away * away
