"""Narrow gaps between pieces of iron, which pass more flux than nodes resolve.

The charges on both sides of a narrow gap nearly cancel each other, and nodes that are farther apart
than the gap is wide do not see how nearly. A piece of iron is almost an equipotential, so that what
they miss is one number for a gap: the flux Phi from one piece to the other. It leaves a net charge
-Phi on the first piece and Phi on the second one, distributed as on conductors. The energy of the
gap is Phi^2 (1/P + R)/(2 mu0), where P is the permeance that nodes miss; see `gap_permeances.py`.
R = (B/B_s)^4 L^2/(3 V) is zero but where an applied field B along the line between the centers is
so strong that it saturates both pieces, which are no equipotentials then; L and V are the length
and the volume of the first one. The energy of a net charge Q of a piece is

    W = Q (psi + Q/(2 C) + nu L^2 Q/(6 V))/mu0,

where psi is the potential of everything else, averaged as charges are on a conductor, and C is its
capacity. The last term is that of flux through a bar with the length L and the volume V of the
piece, and with its reluctivity nu, so that the piece saturates by both kinds of flux together; see
`induction.py`. Phi makes the energy of all iron stationary, so that the forces are those on the
charges and the derivatives of the energy by P.
"""

import math

from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.applied_fields import MOVES as OWNER_MOVES
from magmotor.mjcf.forces.applied_fields import OWNER, acts_on
from magmotor.mjcf.forces.charge_pairs import add_potentials
from magmotor.mjcf.forces.gap_permeances import REACH, gap_permeance
from magmotor.mjcf.forces.iron_pieces import (
    BODY,
    CHARGE,
    EXTENT,
    MODE,
    MOVES,
    NET,
    OPPOSED,
    POTENTIAL,
    RADIUS,
    SATURATION,
    STIFFNESS,
    SUSCEPTIBILITY,
    THREADED,
    WELD,
    center_of,
    dipole_of_piece,
    nodes_of,
    number_of,
    radius_of_pair,
    reluctance_of,
    response_rows,
)
from magmotor.mjcf.forces.iron_potentials import field_along_line, place_charges
from magmotor.mjcf.forces.mirror import NO_MIRROR, height_above
from magmotor.mjcf.forces.shape_wrenches import add_both
from magmotor.mjcf.forces.threaded_iron import geoms_of, potential_of_end
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

ONE, OTHER, THROUGH, FLUX, DRIVE, PERMEANCE, RELUCTANCE, SLOPE, LOAD, COLUMNS = range(10)
"""Columns of a gap: the pieces, the second of which is -1 for the plane of iron; the geom of that
piece through which the flux goes, or -1 for all; the flux over the scale of moments; the difference
of potentials that nodes do not see, in T m; P; 1/P + R, and the slope of R by the drive; by how
much the difference of potentials falls with the flux; and how many columns there are."""

PER_PIECE = 8
"""Number of gaps for each piece, at most."""

STRONG = 0.25
"""B_s/(mu0 M_s)."""


@subroutine
def find_gaps(state, m, offsets):
    """Write a row for each narrow gap; return how many there are.

    Points are on the smaller piece, unless that is in the bore of a coil. Each geom of such a piece
    has a gap of its own, since its potential depends on the end of the coil at which it is.
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
    gap[PERMEANCE] = gap_permeance(state, one, other, int(gap[THROUGH]), 0.0)[0]
    if gap[PERMEANCE] == 0.0:
        return False
    load = 1.0 / number_of(piece, responses.CAPACITY)
    own, row = nodes_of(state.nodes, piece), response_rows(piece)[4]
    for k in range(own.shape[1]):
        own[MODE, k] = 0.0
    if other < 0:
        count = place_charges(state.room, own, state.mirror)
        factor, source, radius = -state.mirror[0], own, piece[RADIUS]
        add_potentials(state.room, own[MODE], own, row[:count], radius, factor)
    else:
        second = state.pieces[other]
        load += 1.0 / number_of(second, responses.CAPACITY)
        source, count = nodes_of(state.nodes, second), place_charges(state.room, own, NO_MIRROR)
        charges = response_rows(second)[4][: source.shape[1]]
        add_potentials(state.room, own[MODE], source, charges, radius_of_pair(piece, second), -2.0)
    for k in range(count):
        load += row[k] * own[MODE, k]
    gap[LOAD] = load
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
def _length(start, end):
    """Return the distance of two points."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    return math.sqrt(x * x + y * y + z * z)


@subroutine
def _set_drive(state, gap, m, offsets):
    """Write the difference of potentials that nodes do not see: applied fields, ends of coils."""
    start, end = _ends(state, gap)
    gap[DRIVE] = 0.0
    for number in range(len(state.fields)):
        gap[DRIVE] += field_along_line(start, end, state.fields[number], m, offsets)[0]
    _set_reluctance(state, gap)
    if gap[THROUGH] < 0.0:
        return
    piece = state.pieces[int(gap[OTHER])]
    count = place_charges(state.room, nodes_of(state.nodes, piece), NO_MIRROR)
    for k in range(len(state.sources)):
        gap[DRIVE] += potential_of_end(
            state.room, count, piece, int(gap[THROUGH]), start, state.sources[k]
        )


@subroutine
def _set_reluctance(state, gap):
    """Let a strong applied field hinder the flux through a gap."""
    one, gap[SLOPE] = state.pieces[int(gap[ONE])], 0.0
    gap[RELUCTANCE], saturation = 1.0 / gap[PERMEANCE], one[SATURATION]
    if gap[OTHER] >= 0.0:
        second = state.pieces[int(gap[OTHER])][SATURATION]
        if saturation == 0.0 or 0.0 < second < saturation:
            saturation = second
    if saturation > 0.0:
        most = STRONG * VACUUM_PERMEABILITY * saturation * _length(*_ends(state, gap))
        ratio, bar = gap[DRIVE] / most, reluctance_of(one)
        gap[RELUCTANCE] += ratio * ratio * ratio * ratio * bar
        gap[SLOPE] = 4.0 * ratio * ratio * ratio / most * bar


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
    """Let the flux through a gap approach that for the present potentials; return its change.

    This is a step of Newton's method. The charges of both pieces follow.
    """
    one = state.pieces[int(gap[ONE])]
    excess = gap[DRIVE] + _potential(state, one) - gap[FLUX] * gap[RELUCTANCE]
    slope, most = gap[LOAD] + gap[RELUCTANCE] + one[STIFFNESS], _most(one)
    low, high = one[NET] - most, one[NET] + most
    if gap[OTHER] >= 0.0:
        other = state.pieces[int(gap[OTHER])]
        excess, slope = excess - _potential(state, other), slope + other[STIFFNESS]
        low, high = max(low, -other[NET] - _most(other)), min(high, _most(other) - other[NET])
        most = min(most, _most(other))
    low, high = max(low, -most - gap[FLUX]), min(high, most - gap[FLUX])
    change = min(max(excess / slope, low), high)
    if gap[OTHER] >= 0.0:
        _add_net(state, state.pieces[int(gap[OTHER])], change)
    _add_net(state, one, -change)
    gap[FLUX] += change
    return change


@subroutine
def _most(piece):
    """Return the largest flux through a piece, that which saturates its mean cross section."""
    if piece[SATURATION] == 0.0:
        return math.inf
    section = number_of(piece, responses.VOLUME) / (2.0 * piece[EXTENT])
    return VACUUM_PERMEABILITY * piece[SATURATION] * section


@subroutine
def _potential(state, piece):
    """Return the derivative of the energy of a piece by its net charge, times mu0, in T m."""
    own, row = nodes_of(state.nodes, piece), response_rows(piece)[4]
    total = piece[NET] / number_of(piece, responses.CAPACITY) + piece[OPPOSED]
    for k in range(own.shape[1]):
        total += row[k] * own[POTENTIAL, k]
    return total


@subroutine
def _add_net(state, piece, change):
    """Add to the net charge of a piece."""
    own, row = nodes_of(state.nodes, piece), response_rows(piece)[4]
    piece[NET] += change
    piece[OPPOSED] += change * piece[STIFFNESS]
    for k in range(own.shape[1]):
        own[CHARGE, k] += change * row[k]


@subroutine
def energy_of_gaps(state):
    """Return the energy in J of all gaps, and of their net charges in applied fields."""
    energy = 0.0
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        energy += gap[FLUX] * (0.5 * gap[FLUX] * gap[RELUCTANCE] - gap[DRIVE])
    return energy / VACUUM_PERMEABILITY


@subroutine
def moment_of_piece(state, i):
    """Return the moment of a piece times the scale of moments.

    On the side of a gap, there are the charges of the flux through it, too.
    """
    piece = state.pieces[i]
    x, y, z, mx, my, mz = dipole_of_piece(state.nodes, piece)
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        if i == gap[ONE] or i == gap[OTHER]:
            found = gap_permeance(state, int(gap[ONE]), int(gap[OTHER]), int(gap[THROUGH]), 0.0)
            charge = (gap[FLUX] if i == gap[ONE] else -gap[FLUX]) / VACUUM_PERMEABILITY
            mx, my = mx + charge * (found[1] - x), my + charge * (found[2] - y)
            mz += charge * (found[3] - z)
    return mx, my, mz


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
    drop = gap[FLUX] / gap[PERMEANCE]
    by_permeance = -0.5 * drop * drop / VACUUM_PERMEABILITY
    found = gap_permeance(state, int(gap[ONE]), other, int(gap[THROUGH]), by_permeance)
    add_both(
        int(one[BODY]), one[MOVES] > 0.0, body, moves, (*center_of(one), 0.0, 0.0, 0.0),
        (*found[4:], 0.0), NO_MIRROR, 1.0, center, applied,
    )  # fmt: skip


@subroutine
def _add_field(state, gap, row, m, offsets, center, applied):
    """Add the forces of a field on the net charges at both centers."""
    start, end = _ends(state, gap)
    f = field_along_line(start, end, row, m, offsets)
    owner, moves = int(row[OWNER]), row[OWNER_MOVES] > 0.0
    hindered = 0.5 * gap[FLUX] * gap[FLUX] * gap[SLOPE] / VACUUM_PERMEABILITY
    flux = gap[FLUX] / VACUUM_PERMEABILITY - hindered
    one, target = state.pieces[int(gap[ONE])], (*start, 0.0, 0.0, 0.0)
    # B is the integral over the distance of the centers, on which R depends as well.
    stretch = hindered * f[0] / _length(start, end) ** 2
    p, q, r = (
        stretch * (end[0] - start[0]), stretch * (end[1] - start[1]), stretch * (end[2] - start[2])
    )  # fmt: skip
    u, v, w = flux * f[4] - p, flux * f[5] - q, flux * f[6] - r
    x, y, z = flux * f[1] + p, flux * f[2] + q, flux * f[3] + r
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
