"""The charges of pieces of iron in the potential of magnets, applied fields, images and each other.

The charges of a piece are a function of the potential phi at its nodes, of which the energy W of the
piece is the integral: dW = q.dphi/mu0. The charges of all pieces make U = sum_i W_i - 1/2 sum_ij
q_i.phi_ij/mu0 stationary, where phi_ij is the potential of the charges of piece j, or of images, at
piece i. Therefore, the forces are those on fixed charges.

A saturating material adds to the response of the nodes, which is linear: the mean field over the
piece, as in an ellipsoid that has the piece's moment in a uniform field, yields the magnetization
that is missing, which is that of charges M.n. It has an energy of its own.

The Gauss-Seidel method starts from no magnetization, so that the result depends on nothing but the
state.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.charge_pairs import add_potentials
from magmotor.mjcf.forces.iron_pieces import (
    CHANGE,
    CHARGE,
    COUNT,
    EXTENT,
    OUTER,
    POTENTIAL,
    RADIUS,
    RESPONSE,
    SATURATION,
    SUSCEPTIBILITY,
    center_of,
    dipole_of_piece,
    nodes_of,
    response_rows,
)
from magmotor.mjcf.forces.iron_potentials import place_charges
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirrored
from magmotor.mjcf.forces.shape_fields import flux_of_dipole
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY, magnetize
from magmotor.numerics.elementary import prefer_wide_vectors

MOST_SWEEPS = 500
"""Number of sweeps after which the charges do not converge."""

TOLERANCE = 1e-10
"""Largest change of a charge in the last sweep, relative to the largest charge."""

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
def radius_of_pair(piece, other):
    """Return the radius of the balls of charge of two pieces in each other's field."""
    a, b = piece[RADIUS], other[RADIUS]
    return math.sqrt(0.5 * (a * a + b * b))


@subroutine
def are_far(piece, other, mirror):
    """Whether two pieces, or one and the other's image, are dipoles for each other."""
    x, y, z = center_of(piece)
    u, v, w = center_of(other)
    if mirror[0] != 0.0:
        place = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
        x, y, z = place[0], place[1], place[2]
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
    x, y, z = center_of(piece)
    if mirror[0] != 0.0:
        place = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
        x, y, z = place[0], place[1], place[2]
    bx, by, bz = flux_of_dipole(dipole_of_piece(state.nodes, other), x, y, z)
    for k in range(count):
        along = bx * (room[0, k] - x) + by * (room[1, k] - y) + bz * (room[2, k] - z)
        own[POTENTIAL, k] -= factor * along


@subroutine
def set_charges(piece, own):
    """Set the charges of a piece in the potential at its nodes, and how much they change."""
    prefer_wide_vectors()
    count = int(piece[COUNT])
    change, charge = own[CHANGE], own[CHARGE]
    rows = response_rows(
        piece, memory.words(int(piece[RESPONSE]), responses.START)[responses.PADDED]
    )
    for k in range(count):
        change[k] = -charge[k]
        charge[k] = 0.0
    for j in range(count // 2):
        p, q = own[POTENTIAL, 2 * j], own[POTENTIAL, 2 * j + 1]
        one, two = rows[responses.ROWS + 2 * j], rows[responses.ROWS + 2 * j + 1]
        for k in range(count):
            charge[k] -= p * one[k] + q * two[k]
    if count % 2 == 1:
        p, one = own[POTENTIAL, count - 1], rows[responses.ROWS + count - 1]
        for k in range(count):
            charge[k] -= p * one[k]
    if piece[SATURATION] > 0.0:
        mx, my, mz, _ = _missing(piece, own, rows)
        for k in range(count):
            charge[k] -= mx * rows[3, k] + my * rows[4, k] + mz * rows[5, k]
    for k in range(count):
        change[k] += charge[k]


@subroutine
def _missing(piece, own, rows):
    """Return the polarization in T that saturation prevents, along the piece's axes.

    The last number is the difference of energies in J.
    """
    numbers = memory.numbers(int(piece[RESPONSE]), 1, responses.START)[0]
    volume = numbers[responses.VOLUME]
    hx = hy = hz = 0.0
    for k in range(own.shape[1]):
        hx -= own[POTENTIAL, k] * rows[3, k]
        hy -= own[POTENTIAL, k] * rows[4, k]
        hz -= own[POTENTIAL, k] * rows[5, k]
    per = 1.0 / (VACUUM_PERMEABILITY * volume)
    field = per * hx, per * hy, per * hz
    f = responses.FACTORS
    factors = numbers[f], numbers[f + 1], numbers[f + 2]
    x, y, z, energy = magnetize(field, factors, piece[SUSCEPTIBILITY], 0.0)
    u, v, w, less = magnetize(field, factors, piece[SUSCEPTIBILITY], piece[SATURATION])
    lx, ly, lz = x - u, y - v, z - w
    scale = VACUUM_PERMEABILITY
    work = scale * (lx * field[0] + ly * field[1] + lz * field[2])
    return scale * lx, scale * ly, scale * lz, volume * (less - energy + work)


@subroutine
def iron_energy(state):
    """Return the energy of all pieces in J, whose charges have been found."""
    energy = 0.0
    for i in range(len(state.pieces)):
        piece = state.pieces[i]
        own = nodes_of(state.nodes, piece)
        product = linear = 0.0
        for k in range(own.shape[1]):
            product += own[CHARGE, k] * (own[OUTER, k] - own[POTENTIAL, k])
        if piece[SATURATION] > 0.0:
            padded = memory.words(int(piece[RESPONSE]), responses.START)[responses.PADDED]
            rows = response_rows(piece, padded)
            mx, my, mz, missing = _missing(piece, own, rows)
            energy += missing
            for k in range(own.shape[1]):
                less = mx * rows[3, k] + my * rows[4, k] + mz * rows[5, k]
                linear += (own[CHARGE, k] + less) * own[POTENTIAL, k]
        else:
            for k in range(own.shape[1]):
                linear += own[CHARGE, k] * own[POTENTIAL, k]
        energy += 0.5 * (linear + product) / VACUUM_PERMEABILITY
    return energy
