"""Forces and torques of the dipoles of different rigid bodies on one another.

Most magnets are grouped: one loop over all their dipoles computes the force on a dipole of a magnet
that can move. Of many dipoles, each pair is computed once, by tiles; within a tolerance, distant
ones act as clusters. Magnets that are large or coupled are evaluated pairwise, with the larger one
as the source, which makes the loops long. The field at the smaller magnet determines both wrenches,
which are opposite about any common point.
"""

from typing import Any

from magmotor.dipoles import sum_over_sources
from magmotor.mjcf import memory
from magmotor.mjcf.forces import cluster_blocks, tiles
from magmotor.mjcf.forces.clusters import (
    CLUSTERED,
    FIXED,
    are_sorted,
    sum_by_clusters,
    worthwhile_work,
)
from magmotor.mjcf.forces.coupling_factors import coupling_factor
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    FIRST,
    LABEL,
    MOVES,
    PAIRWISE,
    ROWS,
    SIZE,
    dipole,
    padded,
)
from magmotor.mjcf.forces.tiles import TILED, dipole_and_sums, fill_tiles, sum_over_pairs
from magmotor.mjcf.late_functions import LateFunction
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine

_word, _number = types.int64, types.float64
_MANY = types.int64(_word, _word, _number, *8 * [_word])
_clusters = LateFunction("magmotor_clusters_address", _MANY, lambda: _compiled_clusters())
_clusters_are_ready, _add_clustered_wrenches = _clusters.is_ready, _clusters.call
_tiles = LateFunction("magmotor_tiles_address", _MANY, lambda: _compiled_tiles())
_tiles_are_ready, _add_tiled_wrenches = _tiles.is_ready, _tiles.call


def bind() -> None:
    """Bind what this module calls to symbols."""
    _tiles.bind()
    _clusters.bind()


def _compiled_tiles() -> Any:
    tiles.bind()
    return _tiled()


def _compiled_clusters() -> Any:
    tiles.bind()
    cluster_blocks.bind()
    return _clustered()


@subroutine(forceinline=True)
def add_dipole_wrenches(
    model, stack, tolerance, table, magnets, couplings, center, applied
):  # fmt: skip
    """Add the wrenches of all magnets on one another.

    `model` and `stack` are the addresses of mjModel and mjData, and `tolerance` is that of many
    dipoles. `table` and `magnets` are what `gather` fills and returns, `couplings` has rows of two
    bodies and a factor, `center` (nbody, 3) is about what the torques act, and `applied` (nbody, 6)
    receives the wrenches. Returns the number of interactions, and of coincidences.
    """
    boundary, end = magnets.boundary, magnets.end
    coincident = acting = 0
    count, mixed = magnets.sources, magnets.mixed
    place = memory.pair_on_stack()
    result = memory.words(place, 2)
    arguments = (
        model, stack, tolerance, table.ctypes.data, table.shape[1], count, boundary, end,
        center.ctypes.data, applied.ctypes.data, place,
    )  # fmt: skip
    # From the fastest to the most general; what has been done is left out of the next.
    many = mixed and tolerance > 0.0 and end >= CLUSTERED and are_sorted(table, end)
    if many and _clusters_are_ready():
        acting = _add_clustered_wrenches(arguments)
        coincident, mixed = result[0], result[1] == 0
    many = mixed and end >= TILED and _mostly_move(table, count, boundary, end)
    if many and _tiles_are_ready():
        acting = _add_tiled_wrenches(arguments)
        coincident, mixed = result[0], False
    for k in range(count):
        grouped = table[FIRST, k] < boundary
        if grouped and mixed and table[MOVES, k] > 0.0:
            coincident += _add_group_wrench(table, k, end, center, applied)
            acting += 1
        for i in range(magnets.pairwise):
            other = int(table[PAIRWISE, i])
            if (grouped or other > k) and _interact(table, k, other, couplings):
                coincident += _add_pair_wrenches(
                    table, k, other, boundary, couplings, center, applied
                )
                acting += 1
    return acting, coincident


@subroutine
def _mostly_move(table, count, boundary, end):
    """Whether at least half of the grouped dipoles can move."""
    moving = 0.0
    for k in range(count):
        if table[FIRST, k] < boundary and table[MOVES, k] > 0.0:
            moving += table[SIZE, k]
    return 2 * moving >= end


@compiled_once(_MANY, error_model="numpy")
def _tiled(checksum: int):
    """Define `_add_tiled_wrenches`."""

    def add_tiled_wrenches(
        model, stack, tolerance, table, columns, count, boundary, end, center, applied, result
    ):  # fmt: skip
        """Add the wrenches of all grouped magnets on one another, with each pair computed once.

        Arrays are given by their addresses. `result` receives whether any dipoles coincide. Returns
        the number of magnets that can move.
        """
        _ = checksum
        table = memory.numbers(table, ROWS, columns)
        center = memory.numbers(center, memory.UNBOUNDED, 3)
        applied = memory.numbers(applied, memory.UNBOUNDED, 6)
        memory.mark_stack(stack)
        blocks = fill_tiles(stack, table, end)
        memory.words(result, 1)[0] = sum_over_pairs(model, stack, blocks)
        acting = 0
        for k in range(count):
            if table[FIRST, k] < boundary and table[MOVES, k] > 0.0:
                acting += 1
                first = int(table[FIRST, k])
                for i in range(first, first + int(table[SIZE, k])):
                    target, total = dipole_and_sums(blocks, i)
                    add_wrench(int(table[BODY, k]), 1.0, target, total, center, applied)
        memory.free_stack(stack)
        return acting

    return add_tiled_wrenches


@compiled_once(_MANY, error_model="numpy")
def _clustered(checksum: int):
    """Define `_add_clustered_wrenches`."""

    def add_clustered_wrenches(
        model, stack, tolerance, table, columns, count, boundary, end, center, applied, result
    ):  # fmt: skip
        """Do the same within a tolerance; `result` also receives whether this was done."""
        _ = checksum
        table = memory.numbers(table, ROWS, columns)
        center = memory.numbers(center, memory.UNBOUNDED, 3)
        applied = memory.numbers(applied, memory.UNBOUNDED, 6)
        memory.mark_stack(stack)
        magnet = memory.words(memory.allocate(stack, 8 * end, 8), end)
        acting = 0
        for k in range(count):
            moves, first = table[MOVES, k] > 0.0, int(table[FIRST, k])
            if first < boundary:
                acting += moves
                for i in range(first, first + int(table[SIZE, k])):
                    magnet[i] = k if moves else FIXED
        blocks, order, coincident, done = sum_by_clusters(
            model, stack, table, end, magnet, tolerance, worthwhile_work(end)
        )
        for i in range(end if done else 0):
            k = magnet[order[i]]
            if k != FIXED:
                target, total = dipole_and_sums(blocks, i)
                add_wrench(int(table[BODY, k]), 1.0, target, total, center, applied)
        memory.free_stack(stack)
        words = memory.words(result, 2)
        words[0], words[1] = coincident, done
        return acting if done else 0

    return add_clustered_wrenches


@subroutine(forceinline=True)
def _add_group_wrench(table, k, end, center, applied):
    """Add the wrench of all grouped magnets on magnet k; return how many dipoles coincide."""
    coincident = 0
    first = int(table[FIRST, k])
    for i in range(first, first + int(table[SIZE, k])):
        target = dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], table, padded(end))
        add_wrench(int(table[BODY, k]), 1.0, target, total, center, applied)
        coincident += total[6]
    return coincident


@subroutine(forceinline=True)
def _interact(table, k, other, couplings):
    """Whether two magnets act on each other."""
    distinct = table[LABEL, int(table[FIRST, k])] != table[LABEL, int(table[FIRST, other])]
    moves = table[MOVES, k] + table[MOVES, other] > 0.0
    return (
        distinct and moves and coupling_factor(table[BODY, k], table[BODY, other], couplings) != 0.0
    )


@subroutine(forceinline=True)
def _add_pair_wrenches(table, k, other, boundary, couplings, center, applied):
    """Add the wrenches of two magnets on each other; return how many dipoles coincide.

    Both follow from the field of the larger one.
    """
    # Lanes hold sources: few targets and many sources leave fewest lanes empty.
    if table[SIZE, k] > table[SIZE, other]:
        k, other = other, k
    moves, reacts = table[MOVES, k] > 0.0, table[MOVES, other] > 0.0
    first, start = int(table[FIRST, k]), int(table[FIRST, other])
    body, source = int(table[BODY, k]), int(table[BODY, other])
    factor = coupling_factor(body, source, couplings)
    sources = memory.from_column(table, start)
    count = int(table[SIZE, other])
    count = count if start < boundary else padded(count)
    coincident = 0
    for i in range(first, first + int(table[SIZE, k])):
        target = dipole(table, i)
        total = sum_over_sources(target, table[LABEL, i], sources, count)
        # The reaction acts at the same point, so that the angular momentum is conserved, too.
        if moves:
            add_wrench(body, factor, target, total, center, applied)
        if reacts:
            add_wrench(source, -factor, target, total, center, applied)
        coincident += total[6]
    return coincident


@subroutine
def add_wrench(body, factor, target, total, center, applied):
    """Add the force and torque on a dipole, times a factor, to a body's wrench."""
    x, y, z, mx, my, mz = target
    fx, fy, fz, bx, by, bz, _ = total
    x -= center[body, 0]
    y -= center[body, 1]
    z -= center[body, 2]
    applied[body, 0] += factor * fx
    applied[body, 1] += factor * fy
    applied[body, 2] += factor * fz
    # m x B, and the moment of the force about the center.
    applied[body, 3] += factor * (my * bz - mz * by + y * fz - z * fy)
    applied[body, 4] += factor * (mz * bx - mx * bz + z * fx - x * fz)
    applied[body, 5] += factor * (mx * by - my * bx + x * fy - y * fx)
