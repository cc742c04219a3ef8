"""Narrow gaps between pieces of iron, which pass more flux than nodes resolve.

The charges on both sides of a narrow gap nearly cancel each other, and nodes that are farther apart
than the gap is wide do not see how nearly. A piece of iron is almost an equipotential, so that what
they miss is one number for a gap: the flux Phi from one piece to the other. It leaves a net charge
-Phi on the first piece and Phi on the second one, distributed as on conductors. The energy of the
gap is Phi^2/(2 mu0 P), where P is the permeance that nodes miss; see `gap_permeances.py`.

With a net charge Q and fluxes w that enter a piece at its nodes, its energy is

    W = (-p'S p/2 + Q (psi + Q/(2 C)) + nu w'G w/2)/mu0,    p = phi + nu G w,

where psi is the potential phi of everything else, averaged as charges are on a conductor, and C is
the capacity. G are the reluctances of the piece, and nu its reluctivity, so that it saturates by
all kinds of flux together; see `induction.py` and `gap_paths.py`. The fluxes make the energy of all
iron stationary, so that the forces are those on the charges and the derivatives of the energy by P
and by the places of gaps.
"""

from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.charge_pairs import add_potentials
from magmotor.mjcf.forces.gap_paths import (
    DRIVE,
    FLUX,
    ONE,
    OTHER,
    PERMEANCE,
    PLACE,
    THROUGH,
    path_of,
    set_answer,
    set_shares,
)
from magmotor.mjcf.forces.gap_permeances import REACH, set_permeance
from magmotor.mjcf.forces.iron_pieces import (
    EXTENT,
    MODE,
    MUTUAL,
    SUSCEPTIBILITY,
    THREADED,
    center_of,
    dipole_of_piece,
    nodes_of,
    number_of,
    radius_of_pair,
    response_rows,
)
from magmotor.mjcf.forces.iron_potentials import field_along_line, place_charges
from magmotor.mjcf.forces.mirror import NO_MIRROR, height_above
from magmotor.mjcf.forces.threaded_iron import geoms_of, potential_of_end
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY


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
                if count == len(state.gaps):
                    break
                gap = state.gaps[count]
                gap[ONE], gap[OTHER], gap[THROUGH], gap[FLUX] = one, other, -1.0, 0.0
                if split:
                    gap[THROUGH] = geom
                if _is_gap(state, gap):
                    _set_drive(state, gap, m, offsets)
                    count += 1
    if count > 0:
        _set_mutual_potentials(state)
    return count


@subroutine
def _is_gap(state, gap):
    """Complete the row of a gap between two pieces, and its paths; return whether there is any."""
    set_permeance(state, gap)
    if gap[PERMEANCE] == 0.0:
        return False
    set_shares(state, gap)
    for side in range(1 if gap[OTHER] < 0.0 else 2):
        piece = state.pieces[int(gap[side])]
        set_answer(path_of(gap, piece, side), piece)
    return True


@subroutine
def _set_mutual_potentials(state):
    """Write the potentials of the net charge 1 of pieces at the equilibrium of pieces with gaps."""
    for i in range(len(state.pieces)):
        piece = state.pieces[i]
        own, equilibrium = nodes_of(state.nodes, piece), response_rows(piece)[4]
        for j in range(i + 1):
            other = state.pieces[j]
            source, radius = nodes_of(state.nodes, other), radius_of_pair(piece, other)
            charges = response_rows(other)[4][: source.shape[1]]
            total = 1.0 / number_of(piece, responses.CAPACITY) if i == j else 0.0
            for n in range(own.shape[1]):
                own[MODE, n] = 0.0
            if i != j:
                place_charges(state.room, own, NO_MIRROR)
                add_potentials(state.room, own[MODE], source, charges, radius, 1.0)
            if state.mirror[0] != 0.0:
                place_charges(state.room, own, state.mirror)
                factor = -state.mirror[0]
                add_potentials(state.room, own[MODE], source, charges, radius, factor)
            for n in range(own.shape[1]):
                total += equilibrium[n] * own[MODE, n]
            piece[MUTUAL + j] = other[MUTUAL + i] = total


@subroutine
def ends_of(state, gap):
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
    start, end = ends_of(state, gap)
    gap[DRIVE] = 0.0
    for number in range(len(state.fields)):
        gap[DRIVE] += field_along_line(start, end, state.fields[number], m, offsets)[0]
    if gap[THROUGH] < 0.0:
        return
    piece = state.pieces[int(gap[OTHER])]
    count = place_charges(state.room, nodes_of(state.nodes, piece), NO_MIRROR)
    for k in range(len(state.sources)):
        gap[DRIVE] += potential_of_end(
            state.room, count, piece, int(gap[THROUGH]), start, state.sources[k]
        )


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
def energy_of_gaps(state):
    """Return the energy in J of all gaps, and of their net charges in applied fields."""
    energy = 0.0
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        energy += gap[FLUX] * (0.5 * gap[FLUX] / gap[PERMEANCE] - gap[DRIVE])
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
            charge = (gap[FLUX] if i == gap[ONE] else -gap[FLUX]) / VACUUM_PERMEABILITY
            mx, my = mx + charge * (gap[PLACE] - x), my + charge * (gap[PLACE + 1] - y)
            mz += charge * (gap[PLACE + 2] - z)
    return mx, my, mz
