"""Magnets by their geom in one state: shape, polarization and pose, one row each.

Far away, a magnet is a dipole in the table of `dipole_table.py`. Near others, its shape counts: see
`shape_wrenches.py`.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER
from magmotor.mjcf.declarations.meshes import MESH, in_frame_of_mesh, mesh_of
from magmotor.mjcf.declarations.shapes import is_magnet, polarization_of
from magmotor.mjcf.declarations.table import shapes
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.shapes.polyhedron import farthest_squared, moments_of

GEOM, KIND, LENGTHS, POLARIZATION, POSITION, FRAME = 0, 1, 2, 5, 8, 11
"""Columns: the geom, its type and sizes, or of a mesh the center in the frame of its vertices; the
polarization in T in its frame, divided by the scale of moments; its center; and its frame, row by
row."""

RADIUS, SPREAD, MOMENT, BODY, WELD, MOVES, MESH_COLUMNS = 20, 21, 22, 25, 26, 27, 28
EXCESS, COIL, THREADED, LIFT, WRENCH, PUSH, SHEET, NEAR, FADE, COLUMNS = (
    32, 35, 36, 37, 40, 46, 49, 55, 56, 57
)  # fmt: skip
"""Further columns: the radius of the sphere around it; the largest difference of its second
moments; its moment along the axes of the world; its body, the rigid body of that, and the degrees
of freedom of that; the addresses and numbers of the vertices and faces of a mesh, as bits; the
roots of what its second moments exceed the smallest one by; 1 if a coil drives it; what a piece of
iron is to that coil, see `threaded_iron.py`; how far it is lifted near a face of the piece, the
force and torque in images there, and the force on it where it is lifted, for which see `lifts.py`;
the force and torque in sheets, how near it is to one, and the derivative of the energy by that, for
which see `sheets.py`; and how many columns there are."""

POINT = -1
"""Stands for the geom and the type of a dipole that has a row among magnets by their geom."""


@subroutine
def read_shapes(rows, scale, drives, table, m, d, offsets):
    """Write one row for each geom that has a polarization; return their number.

    `scale` is that of moments. A polarization is divided by it, since the forces are the squares of
    scaled moments, in the vacuum permeability of SI units. `drives`, unless it is empty, are those
    of coils.
    """
    kinds = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    sizes = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    position = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.geom_xmat // 8], memory.UNBOUNDED, 9)
    count = 0
    for found in shapes(table):
        geom = found.geom
        if not is_magnet(geom, m, offsets):
            continue
        row, kind, size = rows[count], kinds[geom], sizes[geom]
        row[GEOM], row[KIND] = geom, kind
        row[BODY], row[WELD], row[MOVES] = found.body, found.weld, found.freedoms
        row[COIL] = 1.0 if len(drives) > 0 and found.coil >= 0 else 0.0
        inverse = (drives[found.coil] if row[COIL] > 0.0 else 1.0) / scale
        x, y, z = polarization_of(geom, m, offsets)
        if kind == MESH:
            x, y, z = in_frame_of_mesh(geom, x, y, z, m, offsets)
            volume = _read_mesh(row, geom, m, offsets)
        else:
            volume = _read_sizes(row, kind, size)
        row[POLARIZATION] = inverse * x
        row[POLARIZATION + 1] = inverse * y
        row[POLARIZATION + 2] = inverse * z
        for k in range(9):
            row[FRAME + k] = frame[geom, k]
        magnetic = volume / VACUUM_PERMEABILITY
        for k in range(3):
            total, shift = 0.0, 0.0
            for i in range(3):
                total += frame[geom, 3 * k + i] * row[POLARIZATION + i]
                shift += frame[geom, 3 * k + i] * row[LENGTHS + i]
            row[POSITION + k] = position[geom, k] + (shift if kind == MESH else 0.0)
            row[MOMENT + k] = magnetic * total
        count += 1
    return count


@subroutine
def _read_sizes(row, kind, size):
    """Write the sizes of a geom that is no mesh, and its extent; return its volume."""
    a, b, c, volume = ellipsoid(kind, size[0], size[1], size[2])
    row[RADIUS], x, y, z = _extent(kind, a, b, c)
    _set_moments(row, x, y, z)
    if kind in (CYLINDER, CAPSULE):  # the radius and half the length; others have three
        b = size[1]
    row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2] = a, b, c
    return volume


@subroutine
def _read_mesh(row, geom, m, offsets):
    """Write where a mesh is, its center and extent; return its volume."""
    vertices, faces = mesh_of(geom, m, offsets)
    words = memory.words(row.ctypes.data + 8 * MESH_COLUMNS, 4)
    words[0], words[1] = vertices.ctypes.data, len(vertices)
    words[2], words[3] = faces.ctypes.data, len(faces)
    volume, center, moments = moments_of(vertices, faces)
    row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2] = center
    row[RADIUS] = farthest_squared(vertices, faces, center) ** 0.5
    _set_moments(row, moments[0], moments[1], moments[2])
    return volume


@subroutine
def _set_moments(row, x, y, z):
    """Write how second moments differ, which are means of squared coordinates over the volume.

    A dipole describes a shape the better the less they differ, since the fields outside are
    harmonic functions.
    """
    least = min(x, y, z)
    row[SPREAD] = max(x, y, z) - least
    row[EXCESS], row[EXCESS + 1] = (x - least) ** 0.5, (y - least) ** 0.5
    row[EXCESS + 2] = (z - least) ** 0.5


@subroutine
def polyhedron_of(row):
    """Return the vertices and faces of a mesh, its center among them, and its polarization."""
    words = memory.words(row.ctypes.data + 8 * MESH_COLUMNS, 4)
    return (
        memory.singles(words[0], words[1], 3),
        memory.rows_of_integers(words[2], words[3], 3),
        (row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]),
        (row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]),
    )


@subroutine
def _extent(kind, a, b, c):
    """Return the radius of the sphere around a shape, and the second moments."""
    x, y, z = a * a, b * b, c * c
    if kind == BOX:
        radius, x, y, z = (x + y + z) ** 0.5, x / 3.0, y / 3.0, z / 3.0
    elif kind == CYLINDER:
        radius, x, y, z = (x + z) ** 0.5, x / 4.0, y / 4.0, z / 3.0
    elif kind == CAPSULE:
        radius, half = c, c - a
        per, ends = 1.0 / (2.0 * half + 4.0 / 3.0 * a), 2.0 / 3.0 * a
        y = per * x * (0.5 * half + 0.4 * ends)
        z = per * 2.0 * (half**3 / 3.0 + ends * (half * half + 0.75 * half * a + 0.2 * x))
        x = y
    else:
        radius, x, y, z = max(a, b, c), x / 5.0, y / 5.0, z / 5.0
    return radius, x, y, z


@subroutine
def dipole_of(row):
    """Return the dipole of a magnet: its position and moment."""
    return (
        row[POSITION], row[POSITION + 1], row[POSITION + 2],
        row[MOMENT], row[MOMENT + 1], row[MOMENT + 2],
    )  # fmt: skip


@subroutine
def pose_of(row):
    """Return the center of a magnet, and its frame, row by row."""
    return (
        row[POSITION], row[POSITION + 1], row[POSITION + 2],
        row[FRAME], row[FRAME + 1], row[FRAME + 2],
        row[FRAME + 3], row[FRAME + 4], row[FRAME + 5],
        row[FRAME + 6], row[FRAME + 7], row[FRAME + 8],
    )  # fmt: skip


@subroutine
def in_pose(pose, x, y, z):
    """Return a point in the frame of a magnet."""
    return along_axes(pose, x - pose[0], y - pose[1], z - pose[2])


@subroutine
def along_axes(pose, x, y, z):
    """Return a vector of the world along the axes of a magnet."""
    return (
        pose[3] * x + pose[6] * y + pose[9] * z,
        pose[4] * x + pose[7] * y + pose[10] * z,
        pose[5] * x + pose[8] * y + pose[11] * z,
    )


@subroutine
def in_frame(row, x, y, z):
    """Return the same by the row of the magnet."""
    return in_pose(pose_of(row), x, y, z)


@subroutine
def in_world(row, x, y, z):
    """Return a vector of the frame of a magnet along the axes of the world."""
    return (
        row[FRAME] * x + row[FRAME + 1] * y + row[FRAME + 2] * z,
        row[FRAME + 3] * x + row[FRAME + 4] * y + row[FRAME + 5] * z,
        row[FRAME + 6] * x + row[FRAME + 7] * y + row[FRAME + 8] * z,
    )
