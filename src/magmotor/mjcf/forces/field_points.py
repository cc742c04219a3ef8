"""Where an applied field acts on a magnet: at a dipole, or at points of a magnet by its geom.

A field from a table varies within a magnet. Its mean over the volume is that of eight points at
plus and minus the root of each excess of a second moment over the smallest one: right to third
order in the size, since the field is harmonic. A sphere has them all at its center, where a uniform
field, or one with a gradient, is right for all shapes.
"""

from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.fields import GRADIENT
from magmotor.mjcf.forces.applied_fields import NAME
from magmotor.mjcf.forces.dipole_table import dipole
from magmotor.mjcf.forces.shaped_magnets import EXCESS, in_world
from magmotor.numerics.deferred import subroutine

CORNERS = 8


@subroutine
def count_points(state, i, row, m, offsets):
    """Return at how many points the field in a row acts on the magnet in column i of the table."""
    shaped = state.magnets.shaped <= i < state.magnets.shaped + len(state.shapes)
    return CORNERS if shaped and len(numbers_of(int(row[NAME]), m, offsets)) > GRADIENT else 1


@subroutine
def dipole_at(state, i, point, count):
    """Return one of some points of a magnet, and its share of the moment."""
    x, y, z, mx, my, mz = dipole(state.table, i)
    if count == 1:
        return x, y, z, mx, my, mz
    shape = state.shapes[i - state.magnets.shaped]
    u, v, w = shape[EXCESS], shape[EXCESS + 1], shape[EXCESS + 2]
    u, v, w = u if point & 1 else -u, v if point & 2 else -v, w if point & 4 else -w
    u, v, w = in_world(shape, u, v, w)
    return x + u, y + v, z + w, mx / CORNERS, my / CORNERS, mz / CORNERS
