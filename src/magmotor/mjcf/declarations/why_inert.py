"""Why nothing acts on a model."""

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.marks import (
    CONDUCTORS,
    DIPOLES,
    FIELDS,
    IRON,
    NOISE,
    POTENTIALS,
    SHAPES,
    UNMARKED,
)
from magmotor.mjcf.declarations.shapes import is_magnet
from magmotor.mjcf.declarations.table import (
    conductors,
    fields,
    magnetometers,
    magnets,
    pieces,
    planes,
    shapes,
)
from magmotor.mjcf.declarations.user_numbers import count_dipoles, has_numbers, has_user_numbers
from magmotor.numerics.deferred import subroutine

(
    NO_DIPOLES, ONE_RIGID_BODY, NONE_MOVES, SWITCHED_OFF, NOT_NAMED, NOT_MARKED, NOT_MAGNETIZED,
    LEFT_ALONE,
) = range(8)  # fmt: skip
"""Reasons why nothing acts on a model."""

MEASURED = -2
"""Stands for a reason if a magnetometer measures what acts on nothing."""


@subroutine
def why_inert(table, m, offsets, kinds):
    """Return the reason why nothing acts on a model, and a number for its sentence.

    The reason is -1 if something acts, or is switched off, and it may be `MEASURED`. The number is
    that of sites that are no dipoles, or the bits of what no mark names.
    """
    if kinds & NOISE and has_numbers(m, offsets.nbody, offsets.nuser_body, offsets.body_user):
        return -1, 0
    if kinds & POTENTIALS and has_numbers(m, offsets.njnt, offsets.nuser_jnt, offsets.jnt_user):
        return -1, 0
    reason = _why_no_magnetism(table, m, offsets, kinds)
    if reason in (-1, LEFT_ALONE):
        return reason, 0
    count, iron = count_dipoles(m, offsets), len(pieces(table)) + len(planes(table)) > 0
    declared = (
        (DIPOLES if count > 0 else 0)
        | (FIELDS if len(fields(table)) > 0 else 0)
        | (IRON if iron else 0)
    )
    missing, measured = declared & ~kinds, len(magnetometers(table)) > 0
    if missing and _why_no_magnetism(table, m, offsets, kinds | missing) < 0:
        return NOT_MARKED, missing
    if measured and declared & kinds:
        return MEASURED, 0
    if missing and (measured or reason == NOT_NAMED):
        return NOT_MARKED, missing
    if kinds & IRON and iron and not _any_is_magnetized(table, m, offsets):
        return NOT_MAGNETIZED, 0
    return reason, m[offsets.nsite // 8] - count


@subroutine
def _any_is_magnetized(table, m, offsets):
    """Whether a field magnetizes any iron."""
    for found in (pieces(table), planes(table)):
        for row in found:
            if _is_magnetized(row, m, offsets):
                return True
    return False


@subroutine
def _is_magnetized(row, m, offsets):
    """Whether the susceptibility of a piece or plane of iron is not 0."""
    numbers = numbers_of(row.material, m, offsets)
    return len(numbers) > 0 and numbers[0] != 0.0


@subroutine
def _why_no_magnetism(table, m, offsets, kinds):
    """Return the reason why magnetism does not act; -1 if it does, or is switched off."""
    if kinds & (DIPOLES | IRON | SHAPES) == 0:
        if kinds & UNMARKED == 0 and count_dipoles(m, offsets) == 0:
            return NO_DIPOLES
        return LEFT_ALONE if kinds & UNMARKED and has_user_numbers(m, offsets) else NOT_NAMED
    first, several, moves = _magnetic_bodies(table, m, offsets, kinds)
    if first < 0:
        return NO_DIPOLES
    given, faced = False, kinds & CONDUCTORS != 0 and len(conductors(table)) > 0
    for row in fields(table)[: memory.UNBOUNDED if kinds & FIELDS else 0]:
        given = given or several or row.weld != first
    for row in planes(table)[: memory.UNBOUNDED if kinds & IRON else 0]:
        faced = faced or _is_magnetized(row, m, offsets)
    if not several and not given and not faced:
        return ONE_RIGID_BODY
    return -1 if moves or (given and m[offsets.ntuple // 8] > 0) else NONE_MOVES


@subroutine
def _magnetic_bodies(table, m, offsets, kinds):
    """Return a rigid body with magnets or iron, or -1; whether there are others; if one moves."""
    nuser = m[offsets.nuser_site // 8]
    moment = memory.numbers(m[offsets.site_user // 8], memory.UNBOUNDED, nuser)
    found = np.int64(-1), False, False
    for row in magnets(table)[: memory.UNBOUNDED if kinds & DIPOLES else 0]:
        present = False
        for site in range(row.first_site, row.end_site):
            present = present or moment[site, 0] != 0.0
        found = _with(found, row) if present else found
    for row in pieces(table)[: memory.UNBOUNDED if kinds & IRON else 0]:
        found = _with(found, row) if _is_magnetized(row, m, offsets) else found
    for row in shapes(table)[: memory.UNBOUNDED if kinds & SHAPES else 0]:
        found = _with(found, row) if is_magnet(row.geom, m, offsets) else found
    return found


@subroutine
def _with(found, row):
    """Return the same with one more body."""
    first, several, moves = found
    first = row.weld if first < 0 else first
    return first, several or row.weld != first, moves or row.freedoms > 0
