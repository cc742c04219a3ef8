"""Field and potential of a uniformly polarized polyhedron: charged triangles, and their moments.

Vertices are rows x, y, z, and faces are rows of three vertices, which turn counterclockwise as seen
from outside. A center is subtracted from the vertices. With the polarization in T, these are the
tuple `polyhedron`, whose frame begins at the center. The polyhedron is convex: it is where all
heights above the planes of faces are negative. A sliver, a face whose plane is known by rounding
errors only, has no plane.
"""

import math

from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.shapes.triangle import (
    plane_of,
    solid_angle,
    triangle_integrals,
    triangle_potential,
)

PER_SOLID_ANGLE = 0.25 / math.pi
SLIVER = 1e-5
"""Ratio of a face's least height and longest edge below which it has no plane."""

DENT, ROUNDING = 1e-3, 3e-7
"""How far a vertex may be above the plane of a face, in parts of the radius: dents, and rounding
errors of vertices in single precision."""


@subroutine(forceinline=True)
def face_of(vertices, faces, face, center):
    """Return the three vertices of a face."""
    i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
    x, y, z = center
    return (
        (vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z),
        (vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z),
        (vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z),
    )


@subroutine(forceinline=True)
def _height(point, a, normal):
    """Return the height of a point above a plane."""
    x, y, z = point[0] - a[0], point[1] - a[1], point[2] - a[2]
    return normal[0] * x + normal[1] * y + normal[2] * z


@subroutine(forceinline=True)
def _longest_squared(a, b, c):
    """Return the square of the longest edge."""
    longest = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
        longest = max(longest, x * x + y * y + z * z)
    return longest


@subroutine
def set_polyhedron_fields(room, count, polyhedron):
    """Write mu0 H in T to rows 4 to 6 at points in rows 0 to 2.

    Row 7 has the heights above the nearest plane, which are negative inside, and row 8 its face.
    """
    prefer_wide_vectors()
    vertices, faces, center, (jx, jy, jz) = polyhedron
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    heights, nearest = room[7], room[8]
    for i in range(count):
        hx[i] = hy[i] = hz[i] = 0.0
        heights[i], nearest[i] = -math.inf, 0.0
    for face in range(len(faces)):
        a, b, c = face_of(vertices, faces, face, center)
        normal, double = plane_of(a, b, c)
        charge = PER_SOLID_ANGLE * (jx * normal[0] + jy * normal[1] + jz * normal[2])
        longest = _longest_squared(a, b, c)
        raised = -math.inf if double < SLIVER * longest else 0.0
        if charge != 0.0:
            for i in range(count):
                (u, v, w), _ = triangle_integrals((x[i], y[i], z[i]), a, b, c)
                hx[i] += charge * u
                hy[i] += charge * v
                hz[i] += charge * w
        number = float(face)
        for i in range(count):
            height = _height((x[i], y[i], z[i]), a, normal) + raised
            above = height > heights[i]
            heights[i] = height if above else heights[i]
            nearest[i] = number if above else nearest[i]


@subroutine
def set_continued_polyhedron_fields(room, count, polyhedron):
    """Write these fields, but continue the field outside to the inside, from the nearest face."""
    set_polyhedron_fields(room, count, polyhedron)
    vertices, faces, center, (jx, jy, jz) = polyhedron
    for i in range(count):
        if room[7, i] < 0.0:
            a, b, c = face_of(vertices, faces, int(room[8, i]), center)
            (nx, ny, nz), _ = plane_of(a, b, c)
            normal = jx * nx + jy * ny + jz * nz
            room[4, i] += normal * nx
            room[5, i] += normal * ny
            room[6, i] += normal * nz


@subroutine
def continued_polyhedron_potential(point, polyhedron):
    """Return the potential in T m of which that field is the negative gradient."""
    vertices, faces, center, (jx, jy, jz) = polyhedron
    phi, highest, charge_there = 0.0, -math.inf, 0.0
    for face in range(len(faces)):
        a, b, c = face_of(vertices, faces, face, center)
        normal, double = plane_of(a, b, c)
        charge = jx * normal[0] + jy * normal[1] + jz * normal[2]
        if charge != 0.0:
            phi += triangle_potential(point, a, b, c, charge)
        height = _height(point, a, normal)
        if height > highest and double >= SLIVER * _longest_squared(a, b, c):
            highest, charge_there = height, charge
    return phi - charge_there * min(highest, 0.0)


@subroutine
def moments_of(vertices, faces):
    """Return the volume in m^3, the center, and the second moments in m^2 along the axes, about it.

    Each face and the origin are the corners of a tetrahedron, whose volume has a sign.
    """
    volume = x = y = z = xx = yy = zz = 0.0
    for face in range(len(faces)):
        a, b, c = face_of(vertices, faces, face, (0.0, 0.0, 0.0))
        part = (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        ) / 6.0
        u, v, w = a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]
        volume, x, y, z = volume + part, x + part * u, y + part * v, z + part * w
        xx += part * (u * u + a[0] * a[0] + b[0] * b[0] + c[0] * c[0])
        yy += part * (v * v + a[1] * a[1] + b[1] * b[1] + c[1] * c[1])
        zz += part * (w * w + a[2] * a[2] + b[2] * b[2] + c[2] * c[2])
    per = 0.25 / volume
    x, y, z = per * x, per * y, per * z
    per = 0.05 / volume
    return volume, (x, y, z), (per * xx - x * x, per * yy - y * y, per * zz - z * z)


@subroutine
def mean_vertex(vertices, faces):
    """Return the mean of the vertices of all faces, a point inside a closed convex surface."""
    x = y = z = 0.0
    for face in range(len(faces)):
        for u, v, w in face_of(vertices, faces, face, (0.0, 0.0, 0.0)):
            x, y, z = x + u, y + v, z + w
    per = 1.0 / (3.0 * max(len(faces), 1))
    return per * x, per * y, per * z


@subroutine
def farthest_squared(vertices, faces, center):
    """Return the squared distance of the farthest vertex from the center."""
    farthest = 0.0
    for face in range(len(faces)):
        for u, v, w in face_of(vertices, faces, face, center):
            farthest = max(farthest, u * u + v * v + w * w)
    return farthest


@subroutine
def reach_along(vertices, faces, center, x, y, z):
    """Return how far the vertices reach from the center along a vector, times its length."""
    reach = 0.0
    for face in range(len(faces)):
        for u, v, w in face_of(vertices, faces, face, center):
            reach = max(reach, x * u + y * v + z * w)
    return reach


@subroutine
def is_convex(vertices, faces, center, radius):
    """Whether no vertex is above the plane of a face, apart from small dents and rounding."""
    for face in range(len(faces)):
        a, b, c = face_of(vertices, faces, face, center)
        normal, double = plane_of(a, b, c)
        longest = math.sqrt(_longest_squared(a, b, c))
        allowed = radius * (DENT * double + ROUNDING * radius * longest)
        for other in range(len(faces)):
            for point in face_of(vertices, faces, other, center):
                if double * _height(point, a, normal) > allowed:
                    return False
    return True


@subroutine
def turns_around(vertices, faces, center):
    """Return the solid angle of all faces at the center, over 4 pi: 1 if they are closed."""
    total = 0.0
    for face in range(len(faces)):
        a, b, c = face_of(vertices, faces, face, center)
        normal, double = plane_of(a, b, c)
        height = _height((0.0, 0.0, 0.0), a, normal)
        total -= PER_SOLID_ANGLE * solid_angle(a, b, c, height, double)
    return total
