"""How near magnets are: whether their shapes count, and how many charges are needed."""

import math

from magmotor.dipoles import inner
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, SPHERE
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.forces.mirror import mirrored
from magmotor.mjcf.forces.shaped_magnets import (
    KIND,
    LENGTHS,
    POINT,
    POSITION,
    RADIUS,
    SPREAD,
    dipole_of,
    in_frame,
    in_world,
    polyhedron_of,
)
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.shapes.polyhedron import reach_along
from magmotor.numerics.simd import broadcast, lane_numbers, load, minimum, where_less

FAR, FAR_SPREAD = 2.0, 1000.0
"""Two magnets are dipoles for each other from this many radii of both on, if the squared distance
is also this many times the differences of their second moments. The force of the dipoles is then
wrong by at most 1.2 % of itself, or of a third of the greatest one at this distance."""

CLOSE = (4.0, 1.3, 0.45, 0.05)
"""Gaps between two magnets, over the radius of the one that has charges, below which these need the
next order."""

EVEN = 0.05
"""Tilt in rad within which a magnet that lies on a face touches it evenly."""

DOUBLINGS = 7
"""The power of the norm of a mesh is 2 to this."""

NOT_ZERO = 1e-300
"""Added to the distance of two centers, which may be in one place."""


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
    distance = math.sqrt(nx * nx + ny * ny + nz * nz) + NOT_ZERO
    gap = distance - _extent(row, place[0] - x, place[1] - y, place[2] - z, distance)
    gap -= _extent(other, nx, ny, nz, distance)
    return level_of_gap(gap, row[RADIUS])


@subroutine
def level_of_gap(gap, radius):
    """Return the order of the charges of a magnet with a radius at a gap."""
    level = 0
    for k in range(len(CLOSE)):
        level += gap < CLOSE[k] * radius
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
def reach_towards(row, x, y, z):
    """Return how far a magnet reaches from its center along a unit vector, and the gradient.

    The gradient is the farthest point. Where a magnet lies flat, many points are as far, of which
    it is the middle: within a tilt of `EVEN`, it goes from there to a corner or to an edge.
    """
    x, y, z = in_frame(row, x + row[POSITION], y + row[POSITION + 1], z + row[POSITION + 2])
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    kind = int(row[KIND])
    if kind == MESH:
        return _reach_of_mesh(row, x, y, z)
    if kind == BOX:
        (u, du), (v, dv), (w, dw) = _evenly(x), _evenly(y), _evenly(z)
        return (a * u + b * v + c * w, *in_world(row, a * du, b * dv, c * dw))
    if kind == CYLINDER:
        radial = math.sqrt(x * x + y * y)
        (u, du), (w, dw) = _evenly(radial), _evenly(z)
        across = a * du / radial if radial > 0.0 else 0.0
        return (a * u + b * w, *in_world(row, across * x, across * y, b * dw))
    if kind == CAPSULE:
        w, dw = _evenly(z)
        return (a + b * w, *in_world(row, a * x, a * y, a * z + b * dw))
    reach = math.sqrt(x * x * a * a + y * y * b * b + z * z * c * c)
    return (reach, *in_world(row, a * a * x / reach, b * b * y / reach, c * c * z / reach))


@subroutine
def _evenly(x):
    """Return nearly |x|, which is exact and smooth at 0 and exact at 1, and its derivative."""
    square = x * x + EVEN * EVEN
    scale = math.sqrt((1.0 + EVEN * EVEN) / square)
    return scale * x * x, scale * x * (1.0 + EVEN * EVEN / square)


@subroutine
def _reach_of_mesh(row, x, y, z):
    """Return a norm of the vertices' heights, to the power 128, and its gradient."""
    vertices, _, center, _ = polyhedron_of(row)
    radius, total, u, v, w = row[RADIUS], 0.0, 0.0, 0.0, 0.0
    for k in range(len(vertices)):
        p, q, r = vertices[k, 0] - center[0], vertices[k, 1] - center[1], vertices[k, 2] - center[2]
        power, slope = 0.5 + 0.5 * (p * x + q * y + r * z) / radius, 1.0
        for _ in range(DOUBLINGS):
            slope, power = slope * power, power * power
        total, u, v, w = total + power, u + slope * p, v + slope * q, w + slope * r
    root = total
    for _ in range(DOUBLINGS):
        root = math.sqrt(root)
    scale = root / total
    return ((2.0 * root - 1.0) * radius, *in_world(row, scale * u, scale * v, scale * w))


@subroutine
def thickness_of(row):
    """Return the least width of a magnet, or an estimate of a mesh's; 0 for a dipole."""
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    kind = int(row[KIND])
    if kind == POINT:
        return 0.0
    if kind == MESH:
        return row[RADIUS]
    if kind in (CAPSULE, CYLINDER):
        return 2.0 * (min(a, b) if kind == CYLINDER else a)
    return 2.0 * min(a, b, c)


@subroutine
def width_across(row, x, y, z):
    """Return half the width of a magnet across a unit vector, and the gradient of that.

    It is between the half widths along the two other directions, and smooth.
    """
    if int(row[KIND]) == MESH:
        return row[RADIUS], 0.0, 0.0, 0.0
    x, y, z = in_frame(row, x + row[POSITION], y + row[POSITION + 1], z + row[POSITION + 2])
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    if int(row[KIND]) in (CYLINDER, CAPSULE):
        b, c = a, b + (a if int(row[KIND]) == CAPSULE else 0.0)
    a, b, c = 1.0 / (a * a), 1.0 / (b * b), 1.0 / (c * c)
    total = (1.0 - x * x) * a + (1.0 - y * y) * b + (1.0 - z * z) * c
    width = math.sqrt(2.0 / total)
    scale = width / total
    return (width, *in_world(row, scale * a * x, scale * b * y, scale * c * z))


@subroutine
def farthest_squared(shapes):
    """Return the squared distance from which on no two magnets are near."""
    reach = spread = 0.0
    for k in range(len(shapes)):
        reach, spread = max(reach, reach_of(shapes[k])), max(spread, shapes[k, SPREAD])
    return max((2.0 * FAR * reach) ** 2, 2.0 * FAR_SPREAD * spread)


@subroutine
def nearest_squared(table, first, number):
    """Return the squared distance of a magnet to the nearest of those before it, or infinity.

    In the table of dipoles, magnets by their geom begin at column `first`. Eight columns are read
    at a time, so that up to seven other dipoles before these count, too.
    """
    target = first + number
    place = broadcast(table[0, target]), broadcast(table[1, target]), broadcast(table[2, target])
    last, far = target // COUNT * COUNT, broadcast(math.inf)
    others = _eight_squares(table, last, place)
    nearest = where_less(lane_numbers(), broadcast(float(target - last)), others, far)
    for j in range(first // COUNT * COUNT, last, COUNT):
        square = _eight_squares(table, j, place)
        nearest = where_less(square, nearest, square, nearest)
    return minimum(nearest)


@subroutine(forceinline=True)
def _eight_squares(table, j, place):
    """Return the squared distances of a point from the dipoles in columns j to j + 7."""
    x, y, z = (
        place[0] - load(table, 0, j),
        place[1] - load(table, 1, j),
        place[2] - load(table, 2, j),
    )
    return inner(x, y, z, x, y, z)
