"""The charges of iron in the potential of magnets, applied fields, images and other iron.

The charges of a piece are a function of the potential phi at its nodes, of which the energy W of
the piece is the integral: dW = q.dphi/mu0. The charges of all pieces make
U = sum_i W_i - 1/2 sum_ij q_i.phi_ij/mu0 stationary, where phi_ij is the potential of the charges
of piece j, or of images, at piece i. Therefore, the forces are those on fixed charges.

A material that saturates, M = chi H/sqrt(1 + (chi H/M_s)^2), has one reluctivity nu = H/M in the
whole piece, which makes the energy largest: -phi'S(nu) phi/(2 mu0) - V h(nu), with
dh/dnu = mu0 M^2/2. Then the mean of M^2 over the piece is that of the material, as is exact for an
ellipsoid in a uniform field.

The Gauss-Seidel method starts from no magnetization, so that the result depends on nothing but the
state.
"""

import math

from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.charge_pairs import add_potentials
from magmotor.mjcf.forces.gap_fluxes import update_fluxes
from magmotor.mjcf.forces.gaps import energy_of_gaps
from magmotor.mjcf.forces.iron_pieces import (
    ANSWERED,
    CHANGE,
    CHARGE,
    COUNT,
    ENERGY,
    EXTENT,
    INNER,
    MODE,
    NET,
    OUTER,
    PASSING,
    POTENTIAL,
    RELUCTIVITY,
    SATURATION,
    STIFFENING,
    SUSCEPTIBILITY,
    center_of,
    dipole_of_piece,
    nodes_of,
    number_of,
    radius_of_pair,
    reflected_center,
    response_rows,
)
from magmotor.mjcf.forces.iron_potentials import place_charges
from magmotor.mjcf.forces.mirror import NO_MIRROR
from magmotor.mjcf.forces.shape_fields import flux_of_dipole
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.elementary import prefer_wide_vectors

MOST_SWEEPS = 500
"""Number of sweeps after which the charges do not converge."""

TOLERANCE = 1e-10
"""Largest change of a charge in the last sweep, relative to the largest charge."""

LARGEST_COUNT = 200
"""Number of steps for the reluctivity that is never reached."""

FAR = 3.0
"""Gap of two pieces, over the larger radius, from which on they are dipoles for each other."""


@subroutine
def charge_pieces(state):
    """Find the charges of all pieces, whose potentials from outside are known.

    Returns the piece whose charges do not converge, or -1.
    """
    worst = -1
    for _ in range(MOST_SWEEPS):
        change = largest = 0.0
        for i in range(len(state.pieces)):
            own = nodes_of(state.nodes, state.pieces[i])
            _set_potential(state, i)
            set_charges(state.pieces[i], own)
            for k in range(own.shape[1]):
                # Not `abs(...) > largest`, which NaN would not pass.
                if not abs(own[CHARGE, k]) <= largest:
                    largest = abs(own[CHARGE, k])
                if not abs(own[CHANGE, k]) <= change:
                    change, worst = abs(own[CHANGE, k]), i
        for i in range(len(state.pieces) if len(state.gaps) > 0 else 0):
            _set_potential(state, i)
        change = max(change, update_fluxes(state))
        if not largest < math.inf:
            break
        alone = len(state.pieces) == 1 and state.mirror[0] == 0.0
        if alone or change <= TOLERANCE * largest:
            return -1
    return worst


@subroutine
def _set_potential(state, i):
    """Find the potential at the nodes of piece i in the field of the others' present charges."""
    own = nodes_of(state.nodes, state.pieces[i])
    for k in range(own.shape[1]):
        own[POTENTIAL, k] = own[OUTER, k]
    for j in range(len(state.pieces)):
        if j != i:
            _add_potential(state, i, j, NO_MIRROR, 1.0)
        if state.mirror[0] != 0.0:
            _add_potential(state, i, j, state.mirror, -state.mirror[0])


@subroutine
def are_far(piece, other, mirror):
    """Whether two pieces, or one and the other's image, are dipoles for each other."""
    if piece[NET] != 0.0 or other[NET] != 0.0:
        return False
    x, y, z = reflected_center(piece, mirror)
    u, v, w = center_of(other)
    distance = math.sqrt((x - u) * (x - u) + (y - v) * (y - v) + (z - w) * (z - w))
    one, two = piece[EXTENT], other[EXTENT]
    return distance - one - two > FAR * max(one, two)


@subroutine
def _add_potential(state, i, j, mirror, factor):
    """Add the potential of piece j, or of its image, to that at the nodes of piece i."""
    piece, other = state.pieces[i], state.pieces[j]
    own, source, room = nodes_of(state.nodes, piece), nodes_of(state.nodes, other), state.room
    count = place_charges(room, own, mirror)
    if not are_far(piece, other, mirror):
        radius = radius_of_pair(piece, other)
        add_potentials(room, own[POTENTIAL], source, source[CHARGE], radius, factor)
        return
    x, y, z = reflected_center(piece, mirror)
    bx, by, bz = flux_of_dipole(dipole_of_piece(state.nodes, other), x, y, z)
    for k in range(count):
        along = bx * (room[0, k] - x) + by * (room[1, k] - y) + bz * (room[2, k] - z)
        own[POTENTIAL, k] -= factor * along


@subroutine
def set_charges(piece, own):
    """Set the charges of a piece in the potential at its nodes, and how much they change.

    Flux that passes from gap to gap adds the potential nu times `INNER`.
    """
    prefer_wide_vectors()
    count = int(piece[COUNT])
    change, charge = own[CHANGE], own[CHARGE]
    rows, net = response_rows(piece), piece[NET]
    for k in range(count):
        change[k] = -charge[k]
        charge[k] = 0.0
    if piece[SATURATION] > 0.0:
        _set_saturated(piece, own, rows)
    else:
        nu = 1.0 / piece[SUSCEPTIBILITY]
        piece[RELUCTIVITY], piece[STIFFENING] = nu, 0.0
        for j in range(count // 2):
            p, q = own[POTENTIAL, 2 * j], own[POTENTIAL, 2 * j + 1]
            one, two = rows[responses.ROWS + 2 * j], rows[responses.ROWS + 2 * j + 1]
            for k in range(count):
                charge[k] -= p * one[k] + q * two[k]
        if count % 2 == 1:
            p, one = own[POTENTIAL, count - 1], rows[responses.ROWS + count - 1]
            for k in range(count):
                charge[k] -= p * one[k]
        energy = nu * piece[PASSING]
        for k in range(count):
            charge[k] -= nu * own[ANSWERED, k]
            energy += charge[k] * (own[POTENTIAL, k] + nu * own[INNER, k])
        piece[ENERGY] = 0.5 * energy / VACUUM_PERMEABILITY
    equilibrium, mean = rows[4], 0.5 * net / number_of(piece, responses.CAPACITY)
    for k in range(count):
        mean += equilibrium[k] * own[POTENTIAL, k]
        charge[k] += net * equilibrium[k]
        change[k] += charge[k]
    piece[ENERGY] += net * mean / VACUUM_PERMEABILITY


@subroutine
def _set_saturated(piece, own, rows):
    """Add the charges of a piece that saturates to zeros; set its energy and its reluctivity."""
    count, chi, saturation = int(piece[COUNT]), piece[SUSCEPTIBILITY], piece[SATURATION]
    volume = number_of(piece, responses.VOLUME)
    potential, charge, mode, slopes = own[POTENTIAL], own[CHARGE], own[MODE], rows[3]
    for j in range(count):
        row, total = rows[responses.ROWS + j], 0.0
        for k in range(count):
            total += row[k] * potential[k]
        mode[j] = total
    unit = 1.0 / (VACUUM_PERMEABILITY * saturation)
    unit = unit * unit / volume
    nu, rise = _reluctivity(mode, own[ANSWERED], slopes, chi, unit, piece[PASSING])
    piece[RELUCTIVITY], piece[STIFFENING] = nu, 2.0 * unit / rise
    more, energy = nu - 1.0 / chi, nu * piece[PASSING]
    for j in range(count):
        total = mode[j] + nu * own[ANSWERED, j]
        row, part = rows[responses.ROWS + j], total / (1.0 + more * slopes[j])
        energy -= total * part
        for k in range(count):
            charge[k] -= part * row[k]
    stored = more - more / (chi * nu)
    stored *= VACUUM_PERMEABILITY * saturation * saturation * volume
    piece[ENERGY] = 0.5 * (energy / VACUUM_PERMEABILITY - stored)


@subroutine
def _reluctivity(mode, answered, slopes, chi, unit, passing):
    """Return nu, for which the mean of (M/M_s)^2 over the piece is 1 - 1/(chi nu)^2.

    `unit` makes it of squares of modes. The mean falls with nu, and the other side rises: a step of
    Newton's method that leaves the interval with the root is replaced. Also returned is the slope
    of the other side minus the mean.
    """
    low, high, rise = 1.0 / chi, math.inf, 1.0
    nu = low
    for _ in range(LARGEST_COUNT):
        square, slope = unit * passing, 0.0
        more = nu - 1.0 / chi
        for j in range(len(mode)):
            part = 1.0 / (1.0 + more * slopes[j])
            total = part * (mode[j] + nu * answered[j])
            square += unit * total * (slopes[j] * total - 2.0 * answered[j])
            change = slopes[j] * total - answered[j]
            slope -= 2.0 * unit * part * change * change
        inverse = 1.0 / (chi * nu)
        excess = square - (1.0 - inverse * inverse)
        if excess > 0.0:
            low = nu
        else:
            high = nu
        rise = 2.0 * inverse * inverse / nu - slope
        step = excess / rise
        last, nu = nu, nu + step
        if not low <= nu <= high:
            nu = 2.0 * last if high == math.inf else math.sqrt(low * high)
        if abs(nu - last) <= 1e-15 * last:
            break
    return nu, rise


@subroutine
def iron_energy(state):
    """Return the energy of all pieces in J, whose charges have been found."""
    energy = 0.0
    for i in range(len(state.pieces)):
        own = nodes_of(state.nodes, state.pieces[i])
        mutual = 0.0
        for k in range(own.shape[1]):
            mutual += own[CHARGE, k] * (own[POTENTIAL, k] - own[OUTER, k])
        energy += state.pieces[i, ENERGY] - 0.5 * mutual / VACUUM_PERMEABILITY
    return energy + energy_of_gaps(state)
