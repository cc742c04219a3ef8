"""The energy of dipoles, iron, fields and images in one another's field."""

import math

from magmotor.dipoles import COINCIDENCE_SQUARED, PERMEABILITY_OVER_4PI
from magmotor.mjcf import memory
from magmotor.mjcf.forces.applied_fields import acts_on, field_and_gradient
from magmotor.mjcf.forces.coil_columns import is_coil
from magmotor.mjcf.forces.coupling_factors import coupling_factor
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    FIRST,
    LABEL,
    MOVES,
    SIZE,
    add_images,
    dipole,
)
from magmotor.mjcf.forces.field_points import count_points, dipole_at
from magmotor.mjcf.forces.hysteresis import stored_energy
from magmotor.mjcf.forces.induction import iron_energy
from magmotor.mjcf.forces.iron_wrenches import energy_of_faces
from magmotor.mjcf.forces.mirror import NOTHING, mirrored
from magmotor.mjcf.forces.shape_fields import dipole_at_dipole
from magmotor.mjcf.forces.shape_wrenches import add_shape_corrections
from magmotor.numerics.deferred import subroutine


@subroutine
def energy_of(state, m, offsets):
    """Return the energy in J of a `MagneticState`, of which the magnetic wrenches are derivatives.

    Dipoles of one rigid body have none in one another's field, nor in the field that is fixed to
    it; iron has. Nor have dipoles in the field of others, or in a given one, if neither moves.
    """
    table, magnets = state.table, state.magnets
    energy = 0.0
    if len(state.pieces) > 0:
        energy = iron_energy(state) + energy_of_faces(state)
    for k in range(magnets.sources):
        first, last = int(table[FIRST, k]), int(table[FIRST, k] + table[SIZE, k])
        for other in range(k):
            energy += _energy_of_pair(state, k, other)
        for i in range(first, last):
            target = dipole(table, i)
            images = add_images(NOTHING, target, table, magnets.shaped, magnets, state.mirror)
            energy -= 0.5 * _product(target, images[3:6])
            if state.mirror[0] != 0.0:
                energy += 0.5 * _energy_in_images(target, state)
            for number in range(len(state.fields)):
                row = state.fields[number]
                if acts_on(row, table[LABEL, first], table[MOVES, k]):
                    count = count_points(state, i, row, m, offsets)
                    for point in range(count):
                        part = dipole_at(state, i, point, count)
                        field = field_and_gradient(row, part[0], part[1], part[2], m, offsets)
                        energy -= _product(part, field[:3])
    if len(state.shapes) > 0:
        nothing = memory.numbers(0, 0, 3), memory.numbers(0, 0, 6)
        energy += add_shape_corrections(state, *nothing, True)
    return energy + stored_energy(state.memories)


@subroutine
def _energy_in_images(target, state):
    """Return the energy of a dipole in the images of the dipoles of magnets by their geom."""
    table, magnets, energy = state.table, state.magnets, 0.0
    there = mirrored(state.mirror, target)
    for i in range(magnets.shaped, magnets.end):
        energy -= state.mirror[0] * dipole_at_dipole(there, dipole(table, i))[6]
    return energy


@subroutine
def _product(target, field):
    """Return the scalar product of a dipole's moment and a field."""
    return target[3] * field[0] + target[4] * field[1] + target[5] * field[2]


@subroutine
def _energy_of_pair(state, k, other):
    """Return the energy of two magnets in each other's field; 0 if none moves."""
    table = state.table
    first, start = int(table[FIRST, k]), int(table[FIRST, other])
    moves = table[MOVES, k] + table[MOVES, other] > 0.0
    if is_coil(state, first) or is_coil(state, start):  # see `add_shape_corrections`
        return 0.0
    if not moves or table[LABEL, first] == table[LABEL, start]:
        return 0.0
    factor = coupling_factor(table[BODY, k], table[BODY, other], state.couplings)
    energy = 0.0
    for i in range(first, first + int(table[SIZE, k])):
        x, y, z, ax, ay, az = dipole(table, i)
        for j in range(start, start + int(table[SIZE, other])):
            u, v, w, bx, by, bz = dipole(table, j)
            rx, ry, rz = x - u, y - v, z - w
            square = rx * rx + ry * ry + rz * rz
            if square < COINCIDENCE_SQUARED and factor != 0.0:
                return math.nan
            along = (ax * rx + ay * ry + az * rz) * (bx * rx + by * ry + bz * rz) / square
            energy += (ax * bx + ay * by + az * bz - 3.0 * along) / (square * square**0.5)
    return factor * PERMEABILITY_OVER_4PI * energy
