"""Narrow gaps between pieces of iron, which pass more flux than nodes resolve.

The charges on both sides of a narrow gap nearly cancel each other, and nodes that are farther apart
than the gap is wide do not see how nearly. A piece of iron is almost an equipotential, so that what
they miss is one number for a gap: the flux Phi from one piece to the other. It leaves a net charge
-Phi on the first piece and Phi on the second one, distributed as on conductors. The energy of the
gap is that of a reluctance that saturates,

    V(Phi) = R Phi_s^2 (1 - sqrt(1 - (Phi/Phi_s)^2))/mu0,  R = 1/P + R_1 + R_2,  Phi_s = mu0 M_s A,

or R Phi^2/(2 mu0) without saturation. Here, R_1 and R_2 are reluctances of the pieces, P is the
permeance that nodes miss, and A is the area of the gap; see `gap_integrals.py`. Phi makes the
energy of all iron stationary, so that the forces are those on the charges and the derivatives of V.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.applied_fields import MOVES as OWNER_MOVES
from magmotor.mjcf.forces.applied_fields import OWNER, acts_on
from magmotor.mjcf.forces.charge_pairs import add_potentials
from magmotor.mjcf.forces.gap_integrals import REACH, gap_integrals
from magmotor.mjcf.forces.iron_pieces import (
    BODY,
    CHARGE,
    EXTENT,
    MODE,
    MOVES,
    NET,
    POTENTIAL,
    RADIUS,
    RESPONSE,
    SATURATION,
    SUSCEPTIBILITY,
    THREADED,
    WELD,
    center_of,
    nodes_of,
    radius_of_pair,
    response_rows,
)
from magmotor.mjcf.forces.iron_potentials import field_along_line, place_charges
from magmotor.mjcf.forces.mirror import NO_MIRROR, height_above
from magmotor.mjcf.forces.shape_wrenches import add_both
from magmotor.mjcf.forces.threaded_iron import geoms_of, potential_of_end
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

ONE, OTHER, THROUGH, FLUX, RELUCTANCE, DRIVE, PERMEANCE, AREA, LOAD, LIMIT, COLUMNS = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
)  # fmt: skip
"""Columns of a gap: the pieces, the second of which is -1 for the plane of iron; the geom of that on
which the flux goes through, or -1 for all; the flux over the scale of moments; R; the difference of
potentials that nodes do not see, in T m; P and A; by how much the difference of potentials falls
with the flux; the largest flux Phi_s, or 0 if there is none; and how many columns there are."""

PER_PIECE = 8
"""Number of gaps for each piece, at most."""

STEPS = 60
"""Number of steps for the flux that is never reached."""


@subroutine
def find_gaps(state, m, offsets):
    """Write a row for each narrow gap; return how many there are.

    Points are on the smaller piece, unless that is in the bore of a coil. Then each of its geoms has
    a gap of its own, since its potential depends on the end of the coil at which it is.
    """
    count, pieces = 0, state.pieces
    for i in range(len(pieces)):
        for j in range(-1, i):
            one, other = i, j
            if j >= 0 and pieces[i, THREADED] >= pieces[j, THREADED]:
                smaller = pieces[j, EXTENT] < pieces[i, EXTENT]
                if smaller or pieces[i, THREADED] > pieces[j, THREADED]:
                    one, other = j, i
            if not _are_near(state, one, other):
                continue
            split = other >= 0 and pieces[other, THREADED] != 0.0
            for geom in range(len(geoms_of(pieces[other])) if split else 1):
                gap = state.gaps[min(count, len(state.gaps) - 1)]
                gap[ONE], gap[OTHER], gap[THROUGH], gap[FLUX] = one, other, -1.0, 0.0
                if split:
                    gap[THROUGH] = geom
                if count < len(state.gaps) and _is_gap(state, gap):
                    _set_drive(state, gap, m, offsets)
                    count += 1
    return count


@subroutine
def _is_gap(state, gap):
    """Complete the row of a gap between two pieces; return whether there is any."""
    one, other = int(gap[ONE]), int(gap[OTHER])
    piece = state.pieces[one]
    sums = gap_integrals(state, one, other, int(gap[THROUGH]), 0.0, 0.0)
    if sums[0] == 0.0:
        return False
    gap[PERMEANCE], gap[AREA] = sums[0], sums[1]
    series, load = _series(piece), 1.0 / _number(piece, responses.CAPACITY)
    limit = piece[SATURATION]
    own, row = nodes_of(state.nodes, piece), response_of(piece)[4]
    for k in range(own.shape[1]):
        own[MODE, k] = 0.0
    if other < 0:
        count = place_charges(state.room, own, state.mirror)
        factor, source, radius = -state.mirror[0], own, piece[RADIUS]
        add_potentials(state.room, own[MODE], own, row[:count], radius, factor)
    else:
        second = state.pieces[other]
        series += _series(second)
        load += 1.0 / _number(second, responses.CAPACITY)
        if limit == 0.0 or 0.0 < second[SATURATION] < limit:
            limit = second[SATURATION]
        source, count = nodes_of(state.nodes, second), place_charges(state.room, own, NO_MIRROR)
        charges = response_of(second)[4][: source.shape[1]]
        add_potentials(state.room, own[MODE], source, charges, radius_of_pair(piece, second), -2.0)
    for k in range(count):
        load += row[k] * own[MODE, k]
    gap[LOAD], gap[LIMIT] = load, VACUUM_PERMEABILITY * limit * gap[AREA]
    gap[RELUCTANCE] = 1.0 / gap[PERMEANCE] + series
    return True


@subroutine
def _ends(state, gap):
    """Return the centers of both pieces, or of one and its foot on the plane."""
    start = center_of(state.pieces[int(gap[ONE])])
    if gap[OTHER] >= 0.0:
        return start, center_of(state.pieces[int(gap[OTHER])])
    x, y, z = start
    _, nx, ny, nz, _ = state.mirror
    height = height_above(state.mirror, x, y, z)
    return start, (x - height * nx, y - height * ny, z - height * nz)


@subroutine
def _set_drive(state, gap, m, offsets):
    """Write the difference of potentials that nodes do not see: applied fields, ends of coils."""
    start, end = _ends(state, gap)
    gap[DRIVE] = 0.0
    for number in range(len(state.fields)):
        gap[DRIVE] += field_along_line(start, end, state.fields[number], m, offsets)[0]
    piece = state.pieces[int(gap[OTHER])]
    for k in range(len(state.sources) if gap[THROUGH] >= 0.0 else 0):
        count = place_charges(state.room, nodes_of(state.nodes, piece), NO_MIRROR)
        gap[DRIVE] += potential_of_end(
            state.room, count, piece, int(gap[THROUGH]), start, state.sources[k]
        )


@subroutine
def response_of(piece):
    """Return the rows of the response of a piece."""
    words = memory.words(int(piece[RESPONSE]), responses.START)
    return response_rows(piece, words[responses.PADDED])


@subroutine
def _number(piece, which):
    """Return a number of the response of a piece."""
    return memory.numbers(int(piece[RESPONSE]), 1, responses.START)[0, which]


@subroutine
def _series(piece):
    """Return the reluctance of a piece, that of a bar into which flux goes at one end."""
    extent = piece[EXTENT]
    volume = _number(piece, responses.VOLUME)
    return 4.0 * extent * extent / (3.0 * piece[SUSCEPTIBILITY] * volume)


@subroutine
def _are_near(state, one, other):
    """Whether there may be a gap between two pieces, or one and the plane of iron."""
    first = state.pieces[one]
    if other < 0:
        return first[SUSCEPTIBILITY] > 0.0 and first[THREADED] == 0.0 and state.mirror[0] > 0.0
    second = state.pieces[other]
    (x, y, z), (u, v, w) = center_of(first), center_of(second)
    square = (x - u) * (x - u) + (y - v) * (y - v) + (z - w) * (z - w)
    most = first[EXTENT] + second[EXTENT] + REACH * radius_of_pair(first, second)
    attract = first[SUSCEPTIBILITY] > 0.0 and second[SUSCEPTIBILITY] > 0.0
    return attract and square < most * most and first[THREADED] == 0.0


@subroutine
def update_flux(state, gap):
    """Set the flux through a gap for the present potentials; return by how much it changes.

    The charges of both pieces follow.
    """
    one, last = state.pieces[int(gap[ONE])], gap[FLUX]
    excess = gap[DRIVE] + _potential(state, one)
    if gap[OTHER] >= 0.0:
        excess -= _potential(state, state.pieces[int(gap[OTHER])])
    gap[FLUX] = _flux(gap, excess + gap[LOAD] * last)
    change = gap[FLUX] - last
    _add_net(state, one, -change)
    if gap[OTHER] >= 0.0:
        _add_net(state, state.pieces[int(gap[OTHER])], change)
    return change


@subroutine
def _potential(state, piece):
    """Return the potential of a piece, which its response does not change, in T m."""
    own, row = nodes_of(state.nodes, piece), response_of(piece)[4]
    total = piece[NET] / _number(piece, responses.CAPACITY)
    for k in range(own.shape[1]):
        total += row[k] * own[POTENTIAL, k]
    return total


@subroutine
def _add_net(state, piece, change):
    """Add to the net charge of a piece."""
    own, row = nodes_of(state.nodes, piece), response_of(piece)[4]
    piece[NET] += change
    for k in range(own.shape[1]):
        own[CHARGE, k] += change * row[k]


@subroutine
def _flux(gap, drive):
    """Return the flux at which V' and the load balance a difference of potentials.

    Newton's method has x/sqrt(1 + x^2) = Phi/Phi_s as its unknown, for which it converges from x
    of a gap that does not saturate.
    """
    resistance, load, limit = gap[RELUCTANCE], gap[LOAD], gap[LIMIT]
    flux = drive / (resistance + load)
    if limit == 0.0:
        return flux
    x = flux / limit
    for _ in range(STEPS):
        root = math.sqrt(1.0 + x * x)
        excess = limit * (resistance * x + load * x / root) - drive
        step = excess / (limit * (resistance + load / (root * root * root)))
        x -= step
        if abs(step) <= 1e-14 * abs(x):
            break
    return limit * x / math.sqrt(1.0 + x * x)


@subroutine
def energy_of_gaps(state):
    """Return the energy in J of all gaps, and of their net charges in applied fields."""
    energy = 0.0
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        flux, limit = gap[FLUX], gap[LIMIT]
        energy -= flux * gap[DRIVE]
        if limit == 0.0:
            energy += 0.5 * gap[RELUCTANCE] * flux * flux
        else:
            x = flux / limit
            energy += gap[RELUCTANCE] * flux * flux / (1.0 + math.sqrt(1.0 - x * x))
    return energy / VACUUM_PERMEABILITY


@subroutine
def add_gap_wrenches(state, m, offsets, center, applied):
    """Add the derivatives of this energy to the wrenches on pieces, and on the owners of fields."""
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        if gap[FLUX] != 0.0:
            _add_gap(state, gap, center, applied)
            for number in range(len(state.fields)):
                _add_field(state, gap, state.fields[number], m, offsets, center, applied)


@subroutine
def _add_gap(state, gap, center, applied):
    """Add the wrenches on both sides of a gap."""
    one, other = state.pieces[int(gap[ONE])], int(gap[OTHER])
    body, moves, weld = -1, False, -1.0
    if other >= 0:
        second = state.pieces[other]
        body, moves, weld = int(second[BODY]), second[MOVES] > 0.0, second[WELD]
    if one[WELD] == weld or not (moves or one[MOVES] > 0.0):
        return
    flux, limit, root, by_area = gap[FLUX], gap[LIMIT], 1.0, 0.0
    if limit > 0.0:
        x = flux / limit
        root = math.sqrt(1.0 - x * x)
        # dV/dPhi_s of V = R Phi_s^2 (1 - root), times dPhi_s/dA
        by_area = gap[RELUCTANCE] * limit * (2.0 * (1.0 - root) - x * x / root)
        by_area *= limit / (gap[AREA] * VACUUM_PERMEABILITY)
    by_reluctance = flux * flux / ((1.0 + root) * VACUUM_PERMEABILITY)
    by_permeance = -by_reluctance / (gap[PERMEANCE] * gap[PERMEANCE])
    sums = gap_integrals(state, int(gap[ONE]), other, int(gap[THROUGH]), by_permeance, by_area)
    add_both(
        int(one[BODY]), one[MOVES] > 0.0, body, moves, (*center_of(one), 0.0, 0.0, 0.0),
        (*sums[2:], 0.0), NO_MIRROR, 1.0, center, applied,
    )  # fmt: skip


@subroutine
def _add_field(state, gap, row, m, offsets, center, applied):
    """Add the forces of a field on the net charges at both centers."""
    start, end = _ends(state, gap)
    f = field_along_line(start, end, row, m, offsets)
    flux, owner, moves = gap[FLUX] / VACUUM_PERMEABILITY, int(row[OWNER]), row[OWNER_MOVES] > 0.0
    one, target = state.pieces[int(gap[ONE])], (*start, 0.0, 0.0, 0.0)
    u, v, w = flux * f[4], flux * f[5], flux * f[6]
    x, y, z = flux * f[1], flux * f[2], flux * f[3]
    if gap[OTHER] < 0.0:
        # The foot moves along the plane with the center.
        _, nx, ny, nz, _ = state.mirror
        along = x * nx + y * ny + z * nz
        u, v, w = u + x - along * nx, v + y - along * ny, w + z - along * nz
    if acts_on(row, one[WELD], one[MOVES]):
        add_both(
            int(one[BODY]), one[MOVES] > 0.0, owner, moves, target,
            (u, v, w, 0.0, 0.0, 0.0, 0.0), NO_MIRROR, 1.0, center, applied,
        )  # fmt: skip
    if gap[OTHER] >= 0.0:
        other = state.pieces[int(gap[OTHER])]
        if acts_on(row, other[WELD], other[MOVES]):
            add_both(
                int(other[BODY]), other[MOVES] > 0.0, owner, moves, (*end, 0.0, 0.0, 0.0),
                (x, y, z, 0.0, 0.0, 0.0, 0.0), NO_MIRROR, 1.0, center, applied,
            )  # fmt: skip
