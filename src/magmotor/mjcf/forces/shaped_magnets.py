"""Magnets by their geom in one state: shape, polarization and pose, one row each.

Far away, a magnet is a dipole in the table of `dipole_table.py`. Near others, its shape counts: see
`shape_wrenches.py`.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.declarations.shapes import is_magnet, polarization_of
from magmotor.mjcf.declarations.table import shapes
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

GEOM, KIND, LENGTHS, POLARIZATION, POSITION, FRAME = 0, 1, 2, 5, 8, 11
"""Columns: the geom, its type and sizes; the polarization in T in its frame, divided by the scale
of moments; its center; and its frame, row by row."""

RADIUS, SPREAD, MOMENT, BODY, WELD, MOVES, COLUMNS = 20, 21, 22, 25, 26, 27, 28
"""Further columns: the radius of the sphere around it; the largest difference of its second
moments; its moment along the axes of the world; its body, the rigid body of that, and the degrees
of freedom of that; and how many columns there are."""


@subroutine
def read_shapes(rows, scale, table, m, d, offsets):
    """Write one row for each geom that has a polarization; return their number.

    `scale` is that of moments. A polarization is divided by it, since the forces are the squares of
    scaled moments, in the vacuum permeability of SI units.
    """
    kinds = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    sizes = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    position = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.geom_xmat // 8], memory.UNBOUNDED, 9)
    count, inverse = 0, 1.0 / scale
    for found in shapes(table):
        geom = found.geom
        if not is_magnet(geom, m, offsets):
            continue
        row, kind, size = rows[count], kinds[geom], sizes[geom]
        a, b, c, volume = ellipsoid(kind, size[0], size[1], size[2])
        row[GEOM], row[KIND] = geom, kind
        row[BODY], row[WELD], row[MOVES] = found.body, found.weld, found.freedoms
        row[RADIUS], row[SPREAD] = _extent(kind, a, b, c)
        # A cylinder has its radius and half its length, other shapes have three half lengths.
        row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2] = a, c if kind == CYLINDER else b, c
        for k, number in enumerate(polarization_of(geom, m, offsets)):
            row[POLARIZATION + k] = inverse * number
        for k in range(9):
            row[FRAME + k] = frame[geom, k]
        magnetic = volume / VACUUM_PERMEABILITY
        for k in range(3):
            row[POSITION + k] = position[geom, k]
            total = 0.0
            for i in range(3):
                total += frame[geom, 3 * k + i] * row[POLARIZATION + i]
            row[MOMENT + k] = magnetic * total
        count += 1
    return count


@subroutine
def _extent(kind, a, b, c):
    """Return the radius of the sphere around a shape, and the difference of second moments.

    The second moments are means of the squared coordinates over the volume. A dipole describes a
    shape the better the less these differ, since the fields outside are harmonic functions.
    """
    x, y, z = a * a, b * b, c * c
    if kind == BOX:
        radius, x, y, z = (x + y + z) ** 0.5, x / 3.0, y / 3.0, z / 3.0
    elif kind == CYLINDER:
        radius, x, y, z = (x + z) ** 0.5, x / 4.0, y / 4.0, z / 3.0
    else:
        radius, x, y, z = max(a, b, c), x / 5.0, y / 5.0, z / 5.0
    return radius, max(x, y, z) - min(x, y, z)


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
