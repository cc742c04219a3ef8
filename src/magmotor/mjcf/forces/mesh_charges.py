"""The charges of a mesh: J.n on each triangle, by products of two Gauss rules.

The coordinates in a triangle are the part of the way from one vertex to the opposite edge, and the
place along that edge. That edge is the shortest, so that slender triangles need few points.
"""

import math

from magmotor.mjcf.declarations.meshes import MOST_FACES
from magmotor.mjcf.forces.shaped_magnets import POSITION, RADIUS, in_world, polyhedron_of
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.shapes.polyhedron import face_of
from magmotor.numerics.shapes.triangle import plane_of

COARSER = 0.8
"""Factor by which the density of points falls until there are few enough."""


@subroutine
def set_mesh_charges(room, row, level, orders, points, weights):
    """Write the charges of a mesh, as `charges.set_charges` does; return how many.

    `orders[level]` points are along a length of twice the radius; `points` and `weights` are those
    of all orders.
    """
    vertices, faces, center, (jx, jy, jz) = polyhedron_of(row)
    density, count = _density(row, 0.5 * orders[level] / row[RADIUS], orders), 0
    for face in range(len(faces)):
        a, b, c = _from_vertex_to_shortest(face_of(vertices, faces, face, center))
        normal, double = plane_of(a, b, c)
        total = 0.5 * double * (jx * normal[0] + jy * normal[1] + jz * normal[2])
        if total == 0.0:
            continue
        along, across = _orders(a, b, c, density, orders)
        first, other = _start(along, orders), _start(across, orders)
        for i in range(along):
            # The area is proportional to this coordinate. One point is in the middle of the area.
            part = 0.5 + 0.5 * points[first + i] if along > 1 else 2.0 / 3.0
            weight = 2.0 * part * weights[first + i] if along > 1 else 1.0
            for j in range(across):
                place = 0.5 + 0.5 * points[other + j] if across > 1 else 0.5
                u, v = part * (1.0 - place), part * place
                x = a[0] + u * (b[0] - a[0]) + v * (c[0] - a[0])
                y = a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1])
                z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
                x, y, z = in_world(row, x, y, z)
                room[0, count], room[1, count] = row[POSITION] + x, row[POSITION + 1] + y
                room[2, count] = row[POSITION + 2] + z
                room[3, count] = total * weight * (weights[other + j] if across > 1 else 1.0)
                count += 1
    return count


@subroutine
def _density(row, density, orders):
    """Return the largest density in 1/m, at most the given one, for which there is room."""
    vertices, faces, center, _ = polyhedron_of(row)
    count = MOST_FACES + 1
    while count > MOST_FACES:
        count = 0
        for face in range(len(faces)):
            a, b, c = _from_vertex_to_shortest(face_of(vertices, faces, face, center))
            along, across = _orders(a, b, c, density, orders)
            count += along * across
        density = COARSER * density if count > MOST_FACES else density
    return density


@subroutine
def _from_vertex_to_shortest(face):
    """Return the vertices of a face in the same sense, the last two those of the shortest edge."""
    a, b, c = face
    if _distance(a, b) <= min(_distance(b, c), _distance(c, a)):
        return c, a, b
    return (b, c, a) if _distance(c, a) < _distance(b, c) else (a, b, c)


@subroutine
def _orders(a, b, c, density, orders):
    """Return the orders along the longer edges of a triangle, and along the shortest."""
    longer = max(_distance(a, b), _distance(a, c))
    return _order(density * longer, orders), _order(density * _distance(b, c), orders)


@subroutine
def _order(wanted, orders):
    """Return the least order that is wanted, or else the largest; 1 is none of a rule."""
    order = 1
    for k in range(len(orders)):
        order = orders[k] if order < wanted else order
    return order


@subroutine
def _start(order, orders):
    """Return where the points of an order begin."""
    start = 0
    for k in range(len(orders)):
        start += orders[k] if orders[k] < order else 0
    return start


@subroutine
def _distance(a, b):
    """Return the distance of two points."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)
