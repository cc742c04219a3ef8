"""How near magnets are: whether their shapes count, and how many charges are needed."""

import math

from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, SPHERE
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.forces.mirror import mirrored
from magmotor.mjcf.forces.shaped_magnets import (
    KIND,
    LENGTHS,
    POSITION,
    RADIUS,
    SPREAD,
    dipole_of,
    in_frame,
    polyhedron_of,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.shapes.polyhedron import reach_along

FAR, FAR_SPREAD = 2.0, 1000.0
"""Two magnets are dipoles for each other from this many radii of both on, if the squared distance
is also this many times the differences of their second moments. The force of the dipoles is then
wrong by at most 1.2 % of itself, or of a third of the greatest one at this distance."""

CLOSE = (4.0, 1.3, 0.45, 0.05)
"""Gaps between two magnets, over the radius of the one that has charges, below which these need the
next order."""


@subroutine
def is_near(row, x, y, z, radius, spread):
    """Whether a magnet counts by its shape for something at a point, of a radius and a spread."""
    square = squared_distance(row, x, y, z)
    reach = FAR * (reach_of(row) + radius)
    return square < max(reach * reach, FAR_SPREAD * (row[SPREAD] + spread))


@subroutine
def reach_of(row):
    """Return the radius of a magnet, or 0 for a sphere, which is a dipole for what is outside."""
    return 0.0 if int(row[KIND]) == SPHERE else row[RADIUS]


@subroutine
def squared_distance(row, x, y, z):
    """Return the squared distance of a point from the center of a magnet."""
    dx, dy, dz = x - row[POSITION], y - row[POSITION + 1], z - row[POSITION + 2]
    return dx * dx + dy * dy + dz * dz


@subroutine
def order_of_charges(row, other, mirror):
    """Return the order of the charges of `row` in the field of another magnet, or of its image.

    The gap between the two is at least that along the line between their centers.
    """
    place = dipole_of(other)
    x, y, z = row[POSITION], row[POSITION + 1], row[POSITION + 2]
    if mirror[0] != 0.0:
        there = mirrored(mirror, dipole_of(row))
        nx, ny, nz = there[0] - place[0], there[1] - place[1], there[2] - place[2]
        place = mirrored(mirror, place)
    else:
        nx, ny, nz = x - place[0], y - place[1], z - place[2]
    distance = math.sqrt(nx * nx + ny * ny + nz * nz)
    gap = distance - _extent(row, place[0] - x, place[1] - y, place[2] - z, distance)
    gap -= _extent(other, nx, ny, nz, distance)
    level = 0
    for k in range(len(CLOSE)):
        level += gap < CLOSE[k] * row[RADIUS]
    return level


@subroutine
def _extent(row, x, y, z, distance):
    """Return how far a magnet reaches from its center in a direction, a vector of given length."""
    x, y, z = in_frame(row, x + row[POSITION], y + row[POSITION + 1], z + row[POSITION + 2])
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    if int(row[KIND]) == BOX:
        return (abs(x) * a + abs(y) * b + abs(z) * c) / distance
    if int(row[KIND]) == CYLINDER:
        return (math.sqrt(x * x + y * y) * a + abs(z) * b) / distance
    if int(row[KIND]) == CAPSULE:
        return a + abs(z) * b / distance
    if int(row[KIND]) == MESH:
        vertices, faces, center, _ = polyhedron_of(row)
        return reach_along(vertices, faces, center, x, y, z) / distance
    return math.sqrt(x * x * a * a + y * y * b * b + z * z * c * c) / distance


@subroutine
def farthest_squared(shapes):
    """Return the squared distance from which on no two magnets are near."""
    reach = spread = 0.0
    for k in range(len(shapes)):
        reach, spread = max(reach, reach_of(shapes[k])), max(spread, shapes[k, SPREAD])
    return max((2.0 * FAR * reach) ** 2, 2.0 * FAR_SPREAD * spread)


@subroutine
def nearest_squared(table, first, number):
    """Return the squared distance of a magnet to the nearest of those before it.

    The loop over the table of dipoles is fast.
    """
    x, y, z = table[0], table[1], table[2]
    target, nearest = first + number, math.inf
    for k in range(first, target):
        dx, dy, dz = x[k] - x[target], y[k] - y[target], z[k] - z[target]
        nearest = min(nearest, dx * dx + dy * dy + dz * dz)
    return nearest
