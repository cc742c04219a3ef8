"""Checks of dipole sites: whether their moments are valid, and why no dipole acts on another.

A site's only `user` number is its moment. Without the check, further numbers, as of a vector, would
be ignored silently.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from numba import njit

from magmotor.mjcf import memory

NO_DIPOLES, ONE_RIGID_BODY, NONE_MOVES, SWITCHED_OFF = range(4)
"""Reasons why no dipole acts on another."""


@njit(forceinline=True)
def all_moments(m, offsets):
    """Check that each site's `user` numbers are one finite moment; else raise MuJoCo's error."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    given = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    for site in range(nsite):
        if not math.isfinite(given[site, 0]) or memory.any_number(given, site, 1, nuser):
            name_start = memory.integers(m[offsets.name_siteadr // 8], nsite)
            memory.fatal_moment(site, m[offsets.names // 8] + name_start[site])
            return False
    return True


@njit
def why_inert(m, offsets):
    """Return the reason why no dipole acts on another, in a model in which none does."""
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
    return SWITCHED_OFF if moves else NONE_MOVES
