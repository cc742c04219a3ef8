"""Forces and fields of many dipoles on one another, with each pair computed once.

The dipoles are stored by blocks of eight, with their forces and fields beside them. One loop
computes the forces between a dipole and whole blocks: its own sum stays in registers, and the
opposite forces are subtracted in the blocks, so that Newton's third law holds exactly for each
pair.

The blocks are divided into chunks, which meet like the teams of a league: in each round, every
chunk meets one other. The meetings of a round share no data and are tasks for MuJoCo's thread pool
(`mju_threadpool`). The order of all sums, and so the bits, are those of a single thread.
"""

from magmotor.dipoles import COINCIDENCE_SQUARED, PERMEABILITY_OVER_4PI, inner
from magmotor.mjcf import memory
from magmotor.mjcf.forces.dipole_table import LABEL, padded
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import External, subroutine
from magmotor.numerics.simd import (
    broadcast,
    fused,
    lane_numbers,
    load,
    minimum,
    negative,
    square_root,
    store,
    total,
    where_equal,
    where_less,
)

TILED = 256
"""Number of dipoles from which tiles are faster than one loop for each dipole."""

CHUNK, MOST_CHUNKS = 16, 32
"""Least number of blocks in a chunk, about 40 µs of work for a task, and most chunks."""

X, Y, Z, MX, MY, MZ, OWN, FX, FY, FZ, BX, BY, BZ, LABELS, WIDTH = range(0, 15 * COUNT, COUNT)
"""Columns of a block: positions, moments, rigid bodies, force, field, least and largest label."""

SEPARATE = 1e300
"""Squared distance (m^2) of dipoles that do not act on each other; its power -3/2 is 0."""

BLOCKS, TILES, CHUNKS, ROUND, HEADER = range(5)
"""Words of a job; a word for each chunk follows, which is 1 if any dipoles coincide."""

_word, _int = types.int64, types.int32
dispatch = External("mju_dispatch", types.void(_word, _word, _word, _word, _int))
"""Give a number of tasks, of a function and its argument, to the thread pool of an mjData."""

_task_address = memory.address_of("magmotor_tile_task")


def bind() -> None:
    """Bind the task and the function that dispatches it to the symbols in compiled code."""
    memory.bind_mujoco("mju_dispatch")
    memory.bind_compiled("magmotor_tile_task", _task())


@subroutine
def fill_tiles(stack, table, end):
    """Copy the first `end` dipoles of a table to blocks, with forces and fields of zero."""
    blocks = padded(end) // COUNT
    tiles = memory.numbers(memory.allocate(stack, 8 * WIDTH * blocks, 64), blocks, WIDTH)
    for b in range(blocks):
        for row in range(LABEL + 1):
            for k in range(COUNT):
                tiles[b, COUNT * row + k] = table[row, COUNT * b + k]
        for k in range(FX, WIDTH):
            tiles[b, k] = 0.0
        tiles[b, LABELS], tiles[b, LABELS + 1] = _range_of_labels(tiles, b)
    return tiles


@subroutine
def _range_of_labels(tiles, b):
    least = largest = tiles[b, OWN]
    for k in range(1, COUNT):
        least, largest = min(least, tiles[b, OWN + k]), max(largest, tiles[b, OWN + k])
    return least, largest


@subroutine
def dipole_and_sums(tiles, i):
    """Return position and moment of dipole i, and its force and field as by `sum_over_sources`."""
    b, k = i // COUNT, i % COUNT
    mu = PERMEABILITY_OVER_4PI
    return (
        (
            tiles[b, X + k], tiles[b, Y + k], tiles[b, Z + k],
            tiles[b, MX + k], tiles[b, MY + k], tiles[b, MZ + k],
        ),
        (
            mu * tiles[b, FX + k], mu * tiles[b, FY + k], mu * tiles[b, FZ + k],
            mu * tiles[b, BX + k], mu * tiles[b, BY + k], mu * tiles[b, BZ + k],
            False,
        ),
    )  # fmt: skip


@subroutine
def sum_over_pairs(model, stack, tiles):
    """Add the forces and fields of all dipoles on one another; return whether any coincide.

    `model` and `stack` are the addresses of mjModel and mjData, whose thread pool is used.
    """
    chunks = max(min(len(tiles) // CHUNK, MOST_CHUNKS) // 2 * 2, 1)
    address = memory.allocate(stack, 8 * (HEADER + chunks), 8)
    job = memory.words(address, HEADER + chunks)
    job[BLOCKS], job[TILES], job[CHUNKS] = len(tiles), tiles.ctypes.data, chunks
    job[HEADER:] = 0
    for number in range(chunks):
        job[ROUND] = number
        # In a round, no chunk meets two others, so that tasks need no locks; a round is a fixed set
        # of sums, so that the bits do not depend on the threads.
        dispatch(model, stack, _task_address(), address, chunks if number == 0 else chunks // 2)
    coincident = False
    for k in range(chunks):
        coincident = coincident or job[HEADER + k] != 0
    return coincident


@compiled_once(types.void(_word, _word, _word, _int, _int), error_model="numpy")
def _task(checksum: int):
    """Define the task: in round 0, a chunk with itself; later, a meeting of two chunks."""

    def task(model, data, address, thread, index):
        _ = checksum
        job = memory.words(address, memory.UNBOUNDED)
        blocks, chunks, number = job[BLOCKS], job[CHUNKS], job[ROUND]
        tiles = memory.numbers(job[TILES], blocks, WIDTH)
        one, other = _meeting(chunks, number, index)
        square = _sum_over_chunks(
            tiles,
            one * blocks // chunks, (one + 1) * blocks // chunks,
            other * blocks // chunks, (other + 1) * blocks // chunks,
        )  # fmt: skip
        if square < COINCIDENCE_SQUARED:
            job[HEADER + index] = 1

    return task


@subroutine
def _meeting(chunks, number, index):
    """Return the two chunks of a task: all but the last chunk move around a circle."""
    if number == 0:
        return index, index
    others = chunks - 1
    if index == 0:
        return number % others, others
    return (number + index) % others, (number - index) % others


@subroutine
def _sum_over_chunks(tiles, first, last, begin, end):
    """Add the forces and fields of two chunks of blocks, or of one; return the least distance^2."""
    nearest = SEPARATE
    for i in range(first, last):
        j = begin
        if first == begin:
            for lane in range(COUNT):
                nearest = min(nearest, _sum_with_labels(tiles, i, lane, i, i + 1))
            j = i + 1
        while j < end:
            # The labels of distant blocks differ, and need no comparison.
            stop, shared = j + 1, _may_share(tiles, i, j)
            while stop < end and shared == _may_share(tiles, i, stop):
                stop += 1
            for lane in range(COUNT):
                if shared:
                    nearest = min(nearest, _sum_with_labels(tiles, i, lane, j, stop))
                else:
                    nearest = min(nearest, _sum(tiles, i, lane, j, stop, False))
            j = stop
    return nearest


@subroutine
def _may_share(tiles, i, j):
    """Whether the ranges of labels of two blocks overlap."""
    return tiles[i, LABELS] <= tiles[j, LABELS + 1] and tiles[j, LABELS] <= tiles[i, LABELS + 1]


@subroutine
def _sum_with_labels(tiles, i, lane, begin, end):
    """Do `_sum` without pairs of one rigid body, and, in block i, only for the lanes after."""
    return _sum(tiles, i, lane, begin, end, True)


@subroutine(forceinline=True)
def _sum(tiles, i, lane, begin, end, labels):
    """Add the forces and fields of a dipole and the blocks from `begin` to `end` - 1.

    Returns the least squared distance. The formulas are those of `magmotor.dipoles`.
    """
    tx, ty, tz = (
        broadcast(tiles[i, X + lane]),
        broadcast(tiles[i, Y + lane]),
        broadcast(tiles[i, Z + lane]),
    )
    ax, ay, az = (
        broadcast(tiles[i, MX + lane]),
        broadcast(tiles[i, MY + lane]),
        broadcast(tiles[i, MZ + lane]),
    )
    own, number = broadcast(tiles[i, OWN + lane]), lane_numbers()
    # Within a block, a lane meets only those after it.
    after = broadcast(float(lane if begin == i else -1))
    zero = broadcast(0.0)
    nearest = separate = broadcast(SEPARATE)
    fx = fy = fz = bx = by = bz = zero
    for j in range(begin, end):
        x, y, z = tx - load(tiles, j, X), ty - load(tiles, j, Y), tz - load(tiles, j, Z)
        mx, my, mz = load(tiles, j, MX), load(tiles, j, MY), load(tiles, j, MZ)
        square = inner(x, y, z, x, y, z)
        if labels:
            square = where_equal(load(tiles, j, OWN), own, separate, square)
            square = where_less(after, number, square, separate)
        nearest = where_less(square, nearest, square, nearest)
        gx, gy, gz, near, cross, less = terms_of_pairs(x, y, z, square, ax, ay, az, mx, my, mz)
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        # Newton's third law: each pair is computed once.
        store(tiles, j, FX, load(tiles, j, FX) - gx)
        store(tiles, j, FY, load(tiles, j, FY) - gy)
        store(tiles, j, FZ, load(tiles, j, FZ) - gz)
        bx = fused(near, x, fused(less, mx, bx))
        by = fused(near, y, fused(less, my, by))
        bz = fused(near, z, fused(less, mz, bz))
        store(tiles, j, BX, fused(cross, x, fused(less, ax, load(tiles, j, BX))))
        store(tiles, j, BY, fused(cross, y, fused(less, ay, load(tiles, j, BY))))
        store(tiles, j, BZ, fused(cross, z, fused(less, az, load(tiles, j, BZ))))
    tiles[i, FX + lane] += total(fx)
    tiles[i, FY + lane] += total(fy)
    tiles[i, FZ + lane] += total(fz)
    tiles[i, BX + lane] += total(bx)
    tiles[i, BY + lane] += total(by)
    tiles[i, BZ + lane] += total(bz)
    return minimum(nearest)


@subroutine(inline="always")
def terms_of_pairs(x, y, z, square, ax, ay, az, mx, my, mz):
    """Return the forces on dipoles (ax, ay, az) by others at distances (x, y, z), and factors.

    The field at the first is near (x, y, z) + less (mx, my, mz), and that at the second is
    cross (x, y, z) + less (ax, ay, az). All lack the factor mu0/(4 pi).
    """
    one, three, five = broadcast(1.0), broadcast(3.0), broadcast(-5.0)
    inverse = one / square
    cubed = inverse * square_root(inverse)
    scale = three * cubed * inverse
    radial_a, radial_b = inner(ax, ay, az, x, y, z), inner(mx, my, mz, x, y, z)
    near, cross = scale * radial_b, scale * radial_a
    both = scale * fused(five * radial_a * inverse, radial_b, inner(ax, ay, az, mx, my, mz))
    return (
        fused(both, x, fused(cross, mx, near * ax)),
        fused(both, y, fused(cross, my, near * ay)),
        fused(both, z, fused(cross, mz, near * az)),
        near,
        cross,
        negative(cubed),
    )
