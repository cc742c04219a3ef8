"""Checks of dipole sites: whether their moments are valid, and why nothing acts on a model.

A site's only `user` number is its moment. Without the check, further numbers, as of a vector, would
be ignored silently.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.forces.fields import has_field
from magmotor.mjcf.forces.iron import count_pieces, has_mirror, is_piece
from magmotor.mjcf.forces.marks import (
    DIPOLES,
    FIELDS,
    IRON,
    NOISE,
    POTENTIALS,
    UNMARKED,
    has_magnetometer,
    has_numbers,
    has_user_numbers,
)
from magmotor.numerics.subroutine import subroutine

(
    NO_DIPOLES, ONE_RIGID_BODY, NONE_MOVES, SWITCHED_OFF, NOT_NAMED, NOT_MARKED, NOT_MAGNETIZED,
    LEFT_ALONE,
) = range(8)  # fmt: skip
"""Reasons why nothing acts on a model."""

MEASURED = -2
"""Stands for a reason if a magnetometer measures what acts on nothing."""


@subroutine(forceinline=True)
def invalid_moment(m, offsets):
    """Return the first site whose `user` numbers are not one finite moment, or -1."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    given = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    for site in range(nsite if nuser > 0 else 0):
        if not math.isfinite(given[site, 0]) or memory.any_number(given, site, 1, nuser):
            return site
    return -1


@subroutine
def count_dipoles(m, offsets):
    """Return the number of sites with a moment."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    count = 0
    for site in range(nsite if nuser > 0 else 0):
        count += moment[site, 0] != 0.0
    return count


@subroutine
def why_inert(m, offsets, kinds):
    """Return the reason why nothing acts on a model, and a number for its sentence.

    The reason is -1 if something acts, or is switched off, and it may be `MEASURED`. The number is
    that of sites that are no dipoles, or the bits of what no mark names.
    """
    if kinds & NOISE and has_numbers(m, offsets.nbody, offsets.nuser_body, offsets.body_user):
        return -1, 0
    if kinds & POTENTIALS and has_numbers(m, offsets.njnt, offsets.nuser_jnt, offsets.jnt_user):
        return -1, 0
    reason = _why_no_magnetism(m, offsets, kinds)
    if reason in (-1, LEFT_ALONE):
        return reason, 0
    count, pieces = count_dipoles(m, offsets), count_pieces(m, offsets)
    declared = (
        (DIPOLES if count > 0 else 0)
        | (FIELDS if has_field(m, offsets, -1) else 0)
        | (IRON if pieces > 0 else 0)
    )
    missing, measured = declared & ~kinds, has_magnetometer(m, offsets)
    if missing and _why_no_magnetism(m, offsets, kinds | missing) < 0:
        return NOT_MARKED, missing
    if measured and declared & kinds:
        return MEASURED, 0
    if missing and (measured or reason == NOT_NAMED):
        return NOT_MARKED, missing
    if kinds & IRON and pieces > 0 and not _has_magnetized(m, offsets):
        return NOT_MAGNETIZED, 0
    return reason, m[offsets.nsite // 8] - count


@subroutine
def _has_magnetized(m, offsets):
    """Whether any geom is of iron that a field magnetizes."""
    for geom in range(m[offsets.ngeom // 8]):
        if is_piece(geom, m, offsets):
            return True
    return has_mirror(m, offsets)


@subroutine
def _why_no_magnetism(m, offsets, kinds):
    """Return the reason why magnetism does not act; -1 if it does, or is switched off."""
    if kinds & (DIPOLES | IRON) == 0:
        if kinds & UNMARKED == 0 and count_dipoles(m, offsets) == 0:
            return NO_DIPOLES
        return LEFT_ALONE if kinds & UNMARKED and has_user_numbers(m, offsets) else NOT_NAMED
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    dipoles, first, several, moves = 0, -1, False, False
    for k in range(m[offsets.nsite // 8] + m[offsets.ngeom // 8]):
        weld = _rigid_body_of_dipole(k, m, offsets, kinds)
        if weld >= 0:
            first = weld if dipoles == 0 else first
            several = several or weld != first
            moves = moves or freedoms[weld] > 0
            dipoles += 1
    if dipoles == 0:
        return NO_DIPOLES
    given = kinds & FIELDS and has_field(m, offsets, -1 if several else first)
    if not several and not given and not (kinds & IRON and has_mirror(m, offsets)):
        return ONE_RIGID_BODY
    return -1 if moves or (given and m[offsets.ntuple // 8] > 0) else NONE_MOVES


@subroutine
def _rigid_body_of_dipole(k, m, offsets, kinds):
    """Return the rigid body of site k, or of geom k beyond the sites; -1 if that is no dipole."""
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    if k < nsite:
        moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
        body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
        acts = kinds & DIPOLES and nuser > 0 and moment[k, 0] != 0.0
        return np.int64(weld_of[body_of[k]]) if acts else -1
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    acts = kinds & IRON and is_piece(k - nsite, m, offsets)
    return np.int64(weld_of[body_of[k - nsite]]) if acts else -1
