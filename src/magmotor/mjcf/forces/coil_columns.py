"""Coils by their geom in the table of dipoles, among which they do not count.

A magnet or iron may be in the center of a coil, where its dipole has no field. What coils and
others do to each other is added where shapes are: see `shape_wrenches.py`.
"""

from magmotor.mjcf.forces.shaped_magnets import COIL, MOMENT, POSITION, RADIUS
from magmotor.numerics.deferred import subroutine

ASIDE = 0.0123
"""How far a coil is moved along each axis, over its radius: nothing is where it is then."""


@subroutine
def is_coil(state, i):
    """Whether column i of the table is a coil by its geom."""
    k = i - state.magnets.shaped
    return 0 <= k < len(state.shapes) and state.shapes[k, COIL] > 0.0


@subroutine
def hide_coils(state):
    """Take the moments of coils from the table, and move them aside, so that none coincides."""
    for k in range(len(state.shapes)):
        if state.shapes[k, COIL] > 0.0:
            column, aside = state.magnets.shaped + k, ASIDE * state.shapes[k, RADIUS]
            for axis in range(3):
                state.table[axis, column] += (1.0 + axis) * aside
                state.table[3 + axis, column] = 0.0


@subroutine
def show_coils(state):
    """Put coils back into the table."""
    for k in range(len(state.shapes)):
        if state.shapes[k, COIL] > 0.0:
            column = state.magnets.shaped + k
            for axis in range(3):
                state.table[axis, column] = state.shapes[k, POSITION + axis]
                state.table[3 + axis, column] = state.shapes[k, MOMENT + axis]
