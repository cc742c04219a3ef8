"""Meshes of geoms that are magnets: vertices and faces, and whether they enclose something convex.

MuJoCo moves the vertices of a mesh into a frame of its inertia, which is that of the geom in
mjModel and mjData; `mesh_quat` leads back to the frame that MJCF declares, in which the
polarization is given.
"""

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.error_numbers import CROWDED, NOT_CLOSED, NOT_CONVEX
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import rot_vec_quat
from magmotor.numerics.shapes.polyhedron import (
    farthest_squared,
    is_convex,
    mean_vertex,
    moments_of,
    turns_around,
)

MESH = 7
"""mjGEOM_MESH."""

MOST_FACES = 1000
"""Largest number of faces of a magnet, each of which has at least one charge."""

CLOSED, FLAT = 1e-3, 1e-6
"""Largest difference of the solid angle of all faces from 4 pi, in parts of that, and the volume in
parts of the cube of the radius that counts as none."""


@subroutine
def mesh_of(geom, m, offsets):
    """Return the vertices (n, 3) and the faces (n, 3) of the mesh of a geom."""
    mesh = memory.integers(m[offsets.geom_dataid // 8], memory.UNBOUNDED)[geom]
    vertex = memory.integers(m[offsets.mesh_vertadr // 8], memory.UNBOUNDED)[mesh]
    face = memory.integers(m[offsets.mesh_faceadr // 8], memory.UNBOUNDED)[mesh]
    vertices = memory.integers(m[offsets.mesh_vertnum // 8], memory.UNBOUNDED)[mesh]
    faces = memory.integers(m[offsets.mesh_facenum // 8], memory.UNBOUNDED)[mesh]
    return (
        memory.singles(m[offsets.mesh_vert // 8] + 12 * np.int64(vertex), vertices, 3),
        memory.rows_of_integers(m[offsets.mesh_face // 8] + 12 * np.int64(face), faces, 3),
    )


@subroutine
def in_frame_of_mesh(geom, x, y, z, m, offsets):
    """Return a vector of the frame that MJCF declares in that of the vertices."""
    mesh = memory.integers(m[offsets.geom_dataid // 8], memory.UNBOUNDED)[geom]
    quat = memory.numbers(m[offsets.mesh_quat // 8], memory.UNBOUNDED, 4)[mesh]
    return rot_vec_quat((quat[0], -quat[1], -quat[2], -quat[3]), (x, y, z))


@subroutine
def broken_rule(geom, thorough, m, offsets):
    """Return which rule the mesh of a magnet breaks, or -1; all are checked if `thorough`.

    At a point inside, the faces of a closed mesh have the solid angle 4 pi.
    """
    vertices, faces = mesh_of(geom, m, offsets)
    if len(faces) > MOST_FACES:
        return CROWDED
    if thorough:
        center = mean_vertex(vertices, faces)
        radius = farthest_squared(vertices, faces, center) ** 0.5
        if not is_convex(vertices, faces, center, radius):
            return NOT_CONVEX
        volume, _, _ = moments_of(vertices, faces)
        closed = abs(turns_around(vertices, faces, center) - 1.0) < CLOSED
        if not (closed and volume > FLAT * radius**3):
            return NOT_CLOSED
    return -1
