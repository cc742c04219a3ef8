"""The `user` numbers of sites, bodies and joints: moments, Brownian wrenches and potentials.

A site's only `user` number is its moment. Without the check, further numbers, as of a vector, would
be ignored silently. MuJoCo pads all lists to the longest in the model with zeros.
"""

import math

from magmotor.mjcf import memory
from magmotor.numerics.deferred import subroutine

SLIDE, HINGE = 2, 3
"""mjJNT_SLIDE and mjJNT_HINGE."""


@subroutine
def has_user_numbers(m, offsets):
    """Whether any site, body or joint has `user` numbers."""
    return (
        has_numbers(m, offsets.nsite, offsets.nuser_site, offsets.site_user)
        or has_numbers(m, offsets.nbody, offsets.nuser_body, offsets.body_user)
        or has_numbers(m, offsets.njnt, offsets.nuser_jnt, offsets.jnt_user)
    )


@subroutine
def has_numbers(m, count, nuser, user):
    """Whether any `user` number of a type of element is not zero."""
    rows, columns = m[count // 8], m[nuser // 8]
    given = memory.numbers(m[user // 8], rows, columns)
    present = False
    for row in range(rows):
        present = present or memory.any_number(given, row, 0, columns)
    return present


@subroutine
def invalid_moment(m, offsets):
    """Return the first site whose `user` numbers are not one finite moment, or -1."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    given = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    for site in range(nsite if nuser > 0 else 0):
        if not math.isfinite(given[site, 0]) or memory.any_number(given, site, 1, nuser):
            return site
    return -1


@subroutine
def moment_of(site, m, offsets):
    """Return the moment of a site, or 0 if no site has numbers."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    return memory.numbers(m[offsets.site_user // 8], nsite, nuser)[site, 0] if nuser > 0 else 0.0


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
def invalid_row(m, offsets):
    """Return the first body whose `user` numbers are not finite rows of six, or -1."""
    nuser, bodies = m[offsets.nuser_body // 8], m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    for body in range(bodies):
        rest = memory.any_number(rows, body, nuser - nuser % 6, nuser)
        if rest or not memory.all_finite(rows, body, nuser):
            return body
    return -1


@subroutine
def invalid_potential(m, offsets):
    """Return the first joint with invalid `user` numbers, or -1.

    They must be finite pairs, and the joint must be a slide or a hinge.
    """
    nuser, joints = m[offsets.nuser_jnt // 8], m[offsets.njnt // 8]
    waves = memory.numbers(m[offsets.jnt_user // 8], joints, nuser)
    kind = memory.integers(m[offsets.jnt_type // 8], joints)
    for joint in range(joints):
        single = nuser % 2 == 1 and waves[joint, nuser - 1] != 0.0
        linear = kind[joint] == SLIDE or kind[joint] == HINGE
        finite = memory.all_finite(waves, joint, nuser)
        if single or not finite or (not linear and memory.any_number(waves, joint, 0, nuser)):
            return joint
    return -1
