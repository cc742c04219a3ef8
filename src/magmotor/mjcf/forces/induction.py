"""The moments of pieces of iron in the field of dipoles, applied fields, images and each other.

The moments make the energy stationary, U = sum_i w_i(m_i) - m_i.B_i - 1/2 sum_ij m_i.B_ij, where
w_i is the energy that a piece's magnetization stores, B_i the field of everything except iron, and
B_ij that of piece j at piece i. Therefore, the forces and torques are those of dipoles that keep
these moments: the derivatives of U at fixed moments.

The Gauss-Seidel method starts from no magnetization, so that the result depends on nothing but the
state. It converges since `spontaneous_magnetization.py` has shown that U has one minimum.
"""

import math

from magmotor.dipoles import sum_over_sources
from magmotor.mjcf.forces.dipole_table import NOBODY
from magmotor.mjcf.forces.iron_pieces import (
    ENERGY,
    FACTORS,
    OUTER,
    PIECE,
    SATURATION,
    SUSCEPTIBILITY,
    VOLUME,
)
from magmotor.mjcf.forces.mirror import add_image, mirrored
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY, magnetize

MOST_SWEEPS = 2000
"""Number of sweeps after which the moments do not converge; 500 spheres that touch need sixty."""

TOLERANCE = 1e-14
"""Largest change of a moment in the last sweep, relative to the largest moment."""

FINE, COINCIDENT, UNSTABLE = range(3)
"""Results of `find_instability` and `magnetize_pieces`."""


@subroutine
def magnetize_pieces(iron, pieces, mirror, frames) -> tuple[int, int]:
    """Find the moments of all pieces, whose fields from outside are known.

    `iron` has the rows of `sum_over_sources`, with the positions and a different label for each
    piece, and receives the moments, which must be zero; `frames` are those of all geoms. Returns
    how it went, and the piece that failed, or -1.
    """
    worst = 0
    for _ in range(MOST_SWEEPS):
        change = largest = 0.0
        for i in range(len(pieces)):
            square, moved, _ = update_moment(iron, pieces, i, mirror, frames, True)
            # Not `square > largest`, which NaN would not pass.
            if not square <= largest:
                largest = square
            if not moved <= change:
                change, worst = moved, i
        if not largest < math.inf:
            break
        if change <= TOLERANCE * TOLERANCE * largest:
            return FINE, -1
    return UNSTABLE, worst


@subroutine
def update_moment(iron, pieces, i, mirror, frames, real):
    """Replace the moment of piece i by that in the field of the others' present moments.

    If `real` is false, no field acts from outside and nothing saturates. Returns the squares of the
    moment and of its change, and whether another piece is at the same place.
    """
    row = pieces[i]
    total = _field_of_others(iron, i, len(pieces), mirror)
    bx, by, bz, saturation = total[3], total[4], total[5], 0.0
    if real:
        bx, by, bz = bx + row[OUTER], by + row[OUTER + 1], bz + row[OUTER + 2]
        saturation = row[SATURATION]
    moment = _moment(row, saturation, frames[int(row[PIECE])], bx, by, bz)
    square = moved = 0.0
    for k in range(3):
        square += moment[k] * moment[k]
        moved += (moment[k] - iron[3 + k, i]) * (moment[k] - iron[3 + k, i])
        # In place: the next piece already sees it.
        iron[3 + k, i] = moment[k]
    row[ENERGY] = moment[3]
    return square, moved, total[6]


@subroutine
def _field_of_others(iron, i, count, mirror):
    """Sum the field of all other pieces, and of all images, at piece i."""
    target = (iron[0, i], iron[1, i], iron[2, i], 0.0, 0.0, 0.0)
    total = sum_over_sources(target, iron[6, i], iron, count)
    if mirror[0] != 0.0:
        there = sum_over_sources(mirrored(mirror, target), NOBODY, iron, count)
        total = add_image(total, there, mirror)
    return total


@subroutine
def _moment(row, saturation, frame, bx, by, bz):
    """Return the moment of a piece in a field, and the energy that it stores."""
    scale = 1.0 / VACUUM_PERMEABILITY
    # In the frame of the geom, whose axes are those of the demagnetizing factors.
    x = scale * (frame[0] * bx + frame[3] * by + frame[6] * bz)
    y = scale * (frame[1] * bx + frame[4] * by + frame[7] * bz)
    z = scale * (frame[2] * bx + frame[5] * by + frame[8] * bz)
    factors = row[FACTORS], row[FACTORS + 1], row[FACTORS + 2]
    x, y, z, energy = magnetize((x, y, z), factors, row[SUSCEPTIBILITY], saturation)
    volume = row[VOLUME]
    x, y, z = volume * x, volume * y, volume * z
    return (
        frame[0] * x + frame[1] * y + frame[2] * z,
        frame[3] * x + frame[4] * y + frame[5] * z,
        frame[6] * x + frame[7] * y + frame[8] * z,
        volume * energy,
    )


@subroutine
def iron_energy(iron, pieces, mirror):
    """Return the energy of all pieces in J, whose moments have been found."""
    count = len(pieces)
    energy = 0.0
    for i in range(count):
        field = _field_of_others(iron, i, count, mirror)[3:6]
        energy += pieces[i, ENERGY]
        for k in range(3):
            # Half of what pieces have in the field of each other, since each pair counts twice.
            energy -= iron[3 + k, i] * (pieces[i, OUTER + k] + 0.5 * field[k])
    return energy
