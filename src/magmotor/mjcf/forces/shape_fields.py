"""The field of a magnet by its geom, in its own frame: the closed form for each shape."""

from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.forces.shaped_magnets import KIND, LENGTHS, POLARIZATION
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.shapes.box import (
    box_contains,
    box_continued_field,
    box_continued_potential,
    box_field,
)
from magmotor.numerics.shapes.cylinder import (
    cylinder_contains,
    cylinder_continued_field,
    cylinder_continued_potential,
    cylinder_field,
)
from magmotor.numerics.shapes.ellipsoid import (
    ellipsoid_contains,
    ellipsoid_continued_field,
    ellipsoid_continued_potential,
    ellipsoid_field,
)


@subroutine
def set_continued_fields(room, count, row):
    """Write mu0 H in T to rows 4 to 6, at points in rows 0 to 2 outside, or slightly inside.

    Soft contacts let magnets sink into each other a little. The force must not jump where charges
    pass a face of the other magnet, so that the field outside is continued there.
    """
    prefer_wide_vectors()
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    if int(row[KIND]) == BOX:
        for k in range(count):
            hx[k], hy[k], hz[k] = box_continued_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    elif int(row[KIND]) == CYLINDER:
        for k in range(count):
            hx[k], hy[k], hz[k] = cylinder_continued_field(x[k], y[k], z[k], a, b, jx, jy, jz)
    else:
        for k in range(count):
            hx[k], hy[k], hz[k] = ellipsoid_continued_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)


@subroutine
def continued_potential(row, x, y, z):
    """Return the potential in T m of which that field is the negative gradient."""
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    if int(row[KIND]) == BOX:
        return box_continued_potential(x, y, z, a, b, c, jx, jy, jz)
    if int(row[KIND]) == CYLINDER:
        return cylinder_continued_potential(x, y, z, a, b, jx, jy, jz)
    return ellipsoid_continued_potential(x, y, z, a, b, c, jx, jy, jz)


@subroutine
def flux_density(row, x, y, z):
    """Return B in T of a magnet at a point outside or inside."""
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    if int(row[KIND]) == BOX:
        hx, hy, hz = box_field(x, y, z, a, b, c, jx, jy, jz)
        inside = box_contains(x, y, z, a, b, c)
    elif int(row[KIND]) == CYLINDER:
        hx, hy, hz = cylinder_field(x, y, z, a, b, jx, jy, jz)
        inside = cylinder_contains(x, y, z, a, b)
    else:
        hx, hy, hz = ellipsoid_field(x, y, z, a, b, c, jx, jy, jz)
        inside = ellipsoid_contains(x, y, z, a, b, c)
    return (hx + jx, hy + jy, hz + jz) if inside else (hx, hy, hz)
