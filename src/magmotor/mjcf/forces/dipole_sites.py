"""Checks of dipole sites: whether their moments are valid, and why nothing acts on a model.

A site's only `user` number is its moment. Without the check, further numbers, as of a vector, would
be ignored silently.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from numba import njit

from magmotor.mjcf import memory
from magmotor.mjcf.forces.marks import (
    DIPOLES,
    NOISE,
    POTENTIALS,
    UNMARKED,
    has_numbers,
    has_user_numbers,
)

NO_DIPOLES, ONE_RIGID_BODY, NONE_MOVES, SWITCHED_OFF, NOT_NAMED, LEFT_ALONE = range(6)
"""Reasons why nothing acts on a model."""


@njit(forceinline=True)
def invalid_moment(m, offsets):
    """Return the first site whose `user` numbers are not one finite moment, or -1."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    given = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    for site in range(nsite if nuser > 0 else 0):
        if not math.isfinite(given[site, 0]) or memory.any_number(given, site, 1, nuser):
            return site
    return -1


@njit
def count_dipoles(m, offsets):
    """Return the number of sites with a moment."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    count = 0
    for site in range(nsite if nuser > 0 else 0):
        count += moment[site, 0] != 0.0
    return count


@njit
def why_inert(m, offsets, kinds):
    """Return the reason why nothing acts on a model; -1 if something does, or is switched off."""
    if kinds & NOISE and has_numbers(m, offsets.nbody, offsets.nuser_body, offsets.body_user):
        return -1
    if kinds & POTENTIALS and has_numbers(m, offsets.njnt, offsets.nuser_jnt, offsets.jnt_user):
        return -1
    if kinds & DIPOLES == 0:
        return LEFT_ALONE if kinds & UNMARKED and has_user_numbers(m, offsets) else NOT_NAMED
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    dipoles = 0
    first, several, moves = weld_of[0], False, False
    for site in range(nsite if nuser > 0 else 0):
        if moment[site, 0] != 0.0:
            weld = weld_of[body_of[site]]
            if dipoles == 0:
                first = weld
            several = several or weld != first
            moves = moves or freedoms[weld] > 0
            dipoles += 1
    if dipoles == 0:
        return NO_DIPOLES
    if not several:
        return ONE_RIGID_BODY
    return -1 if moves else NONE_MOVES
