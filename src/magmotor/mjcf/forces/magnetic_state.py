"""Everything magnetic of a model in one state: dipoles, iron and its moments, fields, a mirror."""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np

from magmotor.mjcf import layout, memory
from magmotor.mjcf.declarations import table as declared
from magmotor.mjcf.declarations.marks import (
    COILS,
    COUPLINGS,
    DIPOLES,
    FIELDS,
    HYSTERESIS,
    IRON,
    SHAPES,
)
from magmotor.mjcf.declarations.model_numbers import moment_scale
from magmotor.mjcf.declarations.reader import acting_kinds, table_of
from magmotor.mjcf.error_numbers import BEHIND, NO_ERROR, OUTSIDE, UNANSWERED, UNSOLVED
from magmotor.mjcf.forces import applied_fields as applied
from magmotor.mjcf.forces.applied_fields import NAME, acts_on, field_and_gradient, read_fields
from magmotor.mjcf.forces.charges import MOST
from magmotor.mjcf.forces.charges import ROWS as ROWS_OF_CHARGES
from magmotor.mjcf.forces.clusters import cluster_bytes
from magmotor.mjcf.forces.coupling_factors import read_couplings
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    ELEMENT,
    FIRST,
    LABEL,
    MOVES,
    ROWS,
    SIZE,
    Magnets,
    add_images,
    gather,
    read_points,
    sum_over_table,
    table_size,
)
from magmotor.mjcf.forces.drives import read_drives
from magmotor.mjcf.forces.field_points import count_points, dipole_at
from magmotor.mjcf.forces.gap_paths import PER_PIECE, columns_of_gap
from magmotor.mjcf.forces.gaps import find_gaps
from magmotor.mjcf.forces.hysteresis import COLUMNS as COLUMNS_OF_MEMORY
from magmotor.mjcf.forces.hysteresis import set_moments
from magmotor.mjcf.forces.induction import charge_pieces
from magmotor.mjcf.forces.iron_answers import separate_answers
from magmotor.mjcf.forces.iron_fields import flux_of_iron
from magmotor.mjcf.forces.iron_pieces import (
    GEOM,
    MUTUAL,
    count_nodes,
    read_mirror,
    read_pieces,
    unanswered_piece,
)
from magmotor.mjcf.forces.iron_pieces import ROWS as ROWS_OF_NODES
from magmotor.mjcf.forces.iron_potentials import set_outer_potentials
from magmotor.mjcf.forces.iron_unions import WORDS, find_responses, find_unions
from magmotor.mjcf.forces.mirror import NO_MIRROR, height_above
from magmotor.mjcf.forces.shape_fields import flux_of_shapes
from magmotor.mjcf.forces.shaped_magnets import COLUMNS as COLUMNS_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import read_shapes
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine

ALIGNMENT = 1024
"""Bytes that MuJoCo may add for frames and alignment, generously."""


class MagneticState(NamedTuple):
    """What `read_state` returns; all arrays are on the stack of `mjData`.

    `table` and `magnets` are described in `dipole_table.py`, `fields` in `applied_fields.py`,
    `mirror` in `mirror.py`, `pieces` and `nodes` in `iron_pieces.py`, and `shapes` in
    `shaped_magnets.py`; `sources` are these and, near iron, rows of all dipoles; `room` has the
    rows of `charges.py`, for the charges of a magnet or the nodes of a piece; `gaps` has those of
    `gaps.py`; `couplings` has rows of two bodies and a factor, `memories` those of `hysteresis.py`,
    `scale` is that of the moments (see `model_numbers.py`), and `error` is for `report`.
    """

    table: Any
    magnets: Magnets
    couplings: Any
    fields: Any
    pieces: Any
    nodes: Any
    gaps: Any
    shapes: Any
    sources: Any
    room: Any
    memories: Any
    mirror: tuple[float, float, float, float, float]
    scale: float
    error: tuple[int, int, int]


class Sizes(NamedTuple):
    """How many of each there are at most: dipoles, of sites of magnets, and so on.

    `nodes` are those of all pieces of iron, and `largest` those of one.
    """

    magnets: int
    sites: int
    couplings: int
    fields: int
    pieces: int
    coils: int
    shapes: int
    nodes: int
    largest: int
    gaps: int
    room: int
    memories: int


@subroutine
def _geoms_of_iron(table, kinds):
    """Return the number of geoms of iron that act."""
    return len(declared.pieces(table)) if kinds & IRON else 0


@subroutine
def _sizes(table, kinds, nodes, largest):
    """Return the sizes of what acts, with `nodes` of iron, and `largest` of one piece."""
    magnets = declared.magnets(table)
    count = len(magnets) if kinds & DIPOLES else 0
    sites = 0
    for k in range(count):
        sites += magnets[k].end_site - magnets[k].first_site
    shapes = len(declared.shapes(table)) if kinds & SHAPES else 0
    pieces = _geoms_of_iron(table, kinds)
    alone = pieces == 1 and len(declared.planes(table)) == 0
    return Sizes(
        count,
        sites,
        len(declared.couplings(table)) if kinds & COUPLINGS else 0,
        len(declared.fields(table)) if kinds & FIELDS else 0,
        pieces,
        len(declared.coils(table)) if kinds & COILS and count + shapes > 0 else 0,
        shapes,
        nodes,
        max(largest, 0),
        0 if alone else PER_PIECE * pieces,
        max(largest, MOST if shapes > 0 else 0),
        len(declared.memories(table)) if kinds & HYSTERESIS and count > 0 else 0,
    )


@subroutine
def _dipoles(sizes):
    """Return the largest number of dipoles."""
    return sizes.sites + sizes.pieces + sizes.shapes


@subroutine
def _sources(sizes):
    """Return the largest number of magnets by their geom, and of dipoles and a probe near iron."""
    return sizes.shapes + (sizes.sites + 1 if sizes.pieces > 0 else 0)


@subroutine
def _stack_words(sizes):
    """Return the number of 64-bit words that `read_state` allocates."""
    _, columns = table_size(_dipoles(sizes), sizes.couplings > 0)
    return (
        ROWS * columns
        + 3 * sizes.couplings
        + applied.COLUMNS * sizes.fields
        + (MUTUAL + sizes.pieces) * sizes.pieces
        + columns_of_gap(sizes.largest) * sizes.gaps
        + ROWS_OF_NODES * max(sizes.nodes, 0)
        + sizes.coils
        + COLUMNS_OF_SHAPE * _sources(sizes)
        + ROWS_OF_CHARGES * sizes.room
        + COLUMNS_OF_MEMORY * sizes.memories
    )


def stack_bytes(model: mujoco.MjModel) -> int:
    """Return the bytes that magnetism needs on the stack of `mjData`, at most."""
    room = np.empty(WORDS * (model.ngeom + 1))
    return _stack_bytes(layout.current())(model._address, room.ctypes.data)


@compiled_once()
def _stack_bytes(checksum: int, offsets: layout.Layout):
    """Define `stack_bytes` for one layout of the structs."""

    def stack_bytes(model, room):
        _ = checksum
        m, table = memory.words(model, memory.UNBOUNDED), table_of(model, False)
        kinds = acting_kinds(table, m, offsets)
        unions = find_unions(room, _geoms_of_iron(table, kinds), table, m, offsets)
        find_responses(unions, table, m, offsets)
        nodes, largest = count_nodes(unions)
        sizes = _sizes(table, kinds, nodes, largest)
        words = _stack_words(sizes) + WORDS * (len(unions) + 1)
        return 8 * words + cluster_bytes(_dipoles(sizes)) + ALIGNMENT

    return stack_bytes


@subroutine(forceinline=True)
def _room(d, sizes):
    """Return arrays on the stack of `mjData`, in the order of `_stack_words`."""
    boundary, columns = table_size(_dipoles(sizes), sizes.couplings > 0)
    place = memory.allocate(d.ctypes.data, 8 * _stack_words(sizes), 64)
    table = memory.numbers(place, ROWS, columns)
    place += 8 * ROWS * columns
    couplings = memory.numbers(place, sizes.couplings, 3)
    place += 8 * 3 * sizes.couplings
    fields = memory.numbers(place, sizes.fields, applied.COLUMNS)
    place += 8 * applied.COLUMNS * sizes.fields
    pieces = memory.numbers(place, sizes.pieces, MUTUAL + sizes.pieces)
    place += 8 * pieces.size
    nodes = memory.numbers(place, ROWS_OF_NODES, max(sizes.nodes, 0))
    place += 8 * ROWS_OF_NODES * max(sizes.nodes, 0)
    gaps = memory.numbers(place, sizes.gaps, columns_of_gap(sizes.largest))
    place += 8 * gaps.size
    drives = memory.numbers(place, 1, sizes.coils)[0]
    place += 8 * sizes.coils
    sources = memory.numbers(place, _sources(sizes), COLUMNS_OF_SHAPE)
    place += 8 * COLUMNS_OF_SHAPE * _sources(sizes)
    room = memory.numbers(place, ROWS_OF_CHARGES, sizes.room)
    place += 8 * ROWS_OF_CHARGES * sizes.room
    memories = memory.numbers(place, sizes.memories, COLUMNS_OF_MEMORY)
    return table, boundary, couplings, fields, pieces, nodes, gaps, drives, sources, room, memories


@subroutine(forceinline=True)
def read_dipoles(m, d, offsets, own, kinds):
    """Read dipoles and couplings only; the arguments are those of `read_state`."""
    sizes, scale = _sizes(own, kinds, 0, 0), moment_scale(own, m, offsets)
    table, boundary, couplings, fields, pieces, nodes, gaps, drives, shapes, room, memories = _room(
        d, sizes
    )
    read_couplings(couplings, own, m, offsets)
    magnets = gather(
        table, boundary, scale, drives, pieces, shapes, own, sizes.magnets, m, d, offsets
    )  # fmt: skip
    return MagneticState(
        table, magnets, couplings, fields, pieces, nodes, gaps, shapes, shapes, room, memories,
        NO_MIRROR, scale, NO_ERROR,
    )  # fmt: skip


@subroutine
def read_state(m, d, offsets, own, kinds):
    """Read everything magnetic, and find the moments of iron; `own` is the table of the model.

    The caller marks the stack of `mjData` before, and frees it afterwards.
    """
    scale, geoms = moment_scale(own, m, offsets), _geoms_of_iron(own, kinds)
    place = memory.allocate(d.ctypes.data, 8 * WORDS * (geoms + 1), 64)
    unions = find_unions(place, geoms, own, m, offsets)
    find_responses(unions, own, m, offsets)
    nodes, largest = count_nodes(unions)
    sizes = _sizes(own, kinds, nodes, largest)
    table, boundary, couplings, fields, pieces, nodes, gaps, drives, sources, room, memories = (
        _room(d, sizes)
    )
    read_couplings(couplings, own, m, offsets)
    read_fields(fields, scale, own, m, d, offsets)
    if sizes.coils > 0:
        read_drives(drives, own, m, d, offsets)
    mirror, count = NO_MIRROR, 0
    if kinds & SHAPES:
        count = read_shapes(sources, scale, drives, own, m, d, offsets)
    shapes = sources[:count]
    if kinds & IRON:
        known = sizes.nodes >= 0
        found = read_pieces(pieces, nodes, unions, scale, own, m, d, offsets) if known else 0
        pieces = pieces[:found]
        mirror = read_mirror(own, m, d, offsets)
    magnets = gather(
        table, boundary, scale, drives, pieces, shapes, own, sizes.magnets, m, d, offsets
    )  # fmt: skip
    if len(pieces) > 0:
        count += read_points(sources[count:], table, magnets.sources - len(shapes))
    sources = sources[:count]
    error = _dipole_behind(table, magnets, mirror)
    if sizes.nodes < 0:
        error = UNANSWERED, unanswered_piece(unions, own), -1
    state = MagneticState(
        table, magnets, couplings, fields, pieces, nodes, gaps, shapes, sources, room, memories,
        mirror, scale, error,
    )  # fmt: skip
    if error[0] < 0 and len(pieces) > 0:
        error = set_outer_potentials(state, m, offsets)
        gaps = gaps[: find_gaps(state, m, offsets) if error[0] < 0 else 0]
        state = MagneticState(
            table, magnets, couplings, fields, pieces, nodes, gaps, shapes, sources, room, memories,
            mirror, scale, error,
        )  # fmt: skip
        worst = charge_pieces(state) if error[0] < 0 else -1
        if worst >= 0:
            error = UNSOLVED, int(pieces[worst, GEOM]), -1
        if error[0] < 0:
            separate_answers(state)
    elif error[0] < 0 and len(memories) > 0:  # iron must not act, too
        error = set_moments(state, own, m, d, offsets)
    return MagneticState(
        table, magnets, couplings, fields, pieces, nodes, gaps, shapes, sources, room, memories,
        mirror, scale, error,
    )  # fmt: skip


@subroutine
def _dipole_behind(table, magnets, mirror):
    """Return an error if a dipole is below the plane of iron."""
    for k in range(magnets.number if mirror[0] != 0.0 else 0):
        for i in range(int(table[FIRST, k]), int(table[FIRST, k] + table[SIZE, k])):
            if height_above(mirror, table[0, i], table[1, i], table[2, i]) <= 0.0:
                return BEHIND, int(table[ELEMENT, i]), int(table[BODY, k])
    return NO_ERROR


@subroutine
def misplaced_dipole(state, m, offsets):
    """Return an error if a dipole is outside the table of a field that acts on it."""
    table = state.table
    for k in range(state.magnets.number):
        for i in range(int(table[FIRST, k]), int(table[FIRST, k] + table[SIZE, k])):
            for number in range(len(state.fields)):
                row = state.fields[number]
                if not acts_on(row, table[LABEL, i], table[MOVES, k]):
                    continue
                count = count_points(state, i, row, m, offsets)
                for point in range(count):
                    x, y, z, _, _, _ = dipole_at(state, i, point, count)
                    f = field_and_gradient(row, x, y, z, m, offsets)
                    if not math.isfinite(f[0] + f[1] + f[2]):
                        return OUTSIDE, int(table[ELEMENT, i]), int(row[NAME])
    return NO_ERROR


@subroutine
def field_at(state, end, x, y, z, m, offsets):
    """Compute the field at a point, without that of the grouped dipoles from column `end` on.

    That of magnets by their geom, and of iron, is included.

    It is over the scale of the moments. Returns a total as in `magmotor.dipoles.sum_over_sources`,
    without force; an error or -1; and the numeric outside of whose table the point is.
    """
    target = (x, y, z, 0.0, 0.0, 0.0)
    total = sum_over_table(target, state.table, end, state.magnets)
    if state.mirror[0] != 0.0 and height_above(state.mirror, x, y, z) <= 0.0:
        return total, BEHIND, -1
    # The field of images is that of the iron on this side of the plane only.
    total = add_images(total, target, state.table, end, state.magnets, state.mirror)
    bx, by, bz = total[3], total[4], total[5]
    if len(state.shapes) > 0:
        ux, uy, uz = flux_of_shapes(state, x, y, z)
        bx, by, bz = bx + ux, by + uy, bz + uz
    if len(state.pieces) > 0:
        ux, uy, uz = flux_of_iron(state, x, y, z)
        bx, by, bz = bx + ux, by + uy, bz + uz
    for i in range(len(state.fields)):
        f = field_and_gradient(state.fields[i], x, y, z, m, offsets)
        bx, by, bz = bx + f[0], by + f[1], bz + f[2]
        if not math.isfinite(f[0] + f[1] + f[2]):
            return total, OUTSIDE, int(state.fields[i, NAME])
    return (0.0, 0.0, 0.0, bx, by, bz, total[6]), -1, -1
