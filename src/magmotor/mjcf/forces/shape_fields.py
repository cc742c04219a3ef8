"""The fields of magnets by their geom: the closed form for each shape, and a dipole far away."""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, SPHERE
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.forces.charges import ROWS
from magmotor.mjcf.forces.mirror import mirrored, reflected
from magmotor.mjcf.forces.shape_distances import is_near, squared_distance
from magmotor.mjcf.forces.shaped_magnets import (
    KIND,
    LENGTHS,
    POLARIZATION,
    RADIUS,
    dipole_of,
    in_frame,
    in_world,
    polyhedron_of,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.shapes.box import (
    box_contains,
    box_continued_field,
    box_continued_potential,
    box_field,
)
from magmotor.numerics.shapes.capsule import (
    capsule_contains,
    capsule_continued_potential,
    capsule_field,
    set_continued_capsule_fields,
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
    sphere_continued_field,
    sphere_continued_potential,
)
from magmotor.numerics.shapes.polyhedron import (
    continued_polyhedron_potential,
    set_continued_polyhedron_fields,
    set_polyhedron_fields,
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
    if int(row[KIND]) == SPHERE:
        for k in range(count):
            hx[k], hy[k], hz[k] = sphere_continued_field(x[k], y[k], z[k], a, jx, jy, jz)
    elif int(row[KIND]) in (BOX, CYLINDER):
        _set_continued_fields(room, count, row)
    elif int(row[KIND]) == CAPSULE:
        set_continued_capsule_fields(room, count, (a, b, jx, jy, jz))
    elif int(row[KIND]) == MESH:
        set_continued_polyhedron_fields(room, count, polyhedron_of(row))
    else:
        for k in range(count):
            hx[k], hy[k], hz[k] = ellipsoid_continued_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)


@subroutine
def _set_continued_fields(room, count, row):
    """Write these fields of a box or a cylinder; a polarization along z takes half the time."""
    prefer_wide_vectors()
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    if int(row[KIND]) == BOX and jx == 0.0 and jy == 0.0:
        for k in range(count):
            hx[k], hy[k], hz[k] = box_continued_field(x[k], y[k], z[k], a, b, c, 0.0, 0.0, jz)
    elif int(row[KIND]) == BOX:
        for k in range(count):
            hx[k], hy[k], hz[k] = box_continued_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    elif jx == 0.0 and jy == 0.0:
        for k in range(count):
            hx[k], hy[k], hz[k] = cylinder_continued_field(x[k], y[k], z[k], a, b, 0.0, 0.0, jz)
    else:
        for k in range(count):
            hx[k], hy[k], hz[k] = cylinder_continued_field(x[k], y[k], z[k], a, b, jx, jy, jz)


@subroutine
def set_continued_potentials(room, count, row):
    """Write the potential in T m, of which that field is the negative gradient, to row 4."""
    prefer_wide_vectors()
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    x, y, z, phi = room[0], room[1], room[2], room[4]
    if int(row[KIND]) == SPHERE:
        for k in range(count):
            phi[k] = sphere_continued_potential(x[k], y[k], z[k], a, jx, jy, jz)
    elif int(row[KIND]) == BOX:
        for k in range(count):
            phi[k] = box_continued_potential(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    elif int(row[KIND]) == CYLINDER:
        for k in range(count):
            phi[k] = cylinder_continued_potential(x[k], y[k], z[k], a, b, jx, jy, jz)
    elif int(row[KIND]) == CAPSULE:
        for k in range(count):
            phi[k] = capsule_continued_potential(x[k], y[k], z[k], a, b, jx, jy, jz)
    elif int(row[KIND]) == MESH:
        polyhedron = polyhedron_of(row)
        for k in range(count):
            phi[k] = continued_polyhedron_potential((x[k], y[k], z[k]), polyhedron)
    else:
        for k in range(count):
            phi[k] = ellipsoid_continued_potential(x[k], y[k], z[k], a, b, c, jx, jy, jz)


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
    elif int(row[KIND]) == CAPSULE:
        hx, hy, hz = capsule_field(x, y, z, a, b, jx, jy, jz)
        inside = capsule_contains(x, y, z, a, b)
    elif int(row[KIND]) == MESH:
        one = memory.numbers(memory.row_on_stack(), ROWS, 1)
        one[0, 0], one[1, 0], one[2, 0] = x, y, z
        set_polyhedron_fields(one, 1, polyhedron_of(row))
        hx, hy, hz, inside = one[4, 0], one[5, 0], one[6, 0], one[7, 0] < 0.0
    else:
        hx, hy, hz = ellipsoid_field(x, y, z, a, b, c, jx, jy, jz)
        inside = ellipsoid_contains(x, y, z, a, b, c)
    return (hx + jx, hy + jy, hz + jz) if inside else (hx, hy, hz)


@subroutine
def shape_flux(row, x, y, z):
    """Return the flux density of a magnet at a point of the world, also inside."""
    inside = squared_distance(row, x, y, z) < row[RADIUS] * row[RADIUS]
    if inside or is_near(row, x, y, z, 0.0, 0.0):
        u, v, w = in_frame(row, x, y, z)
        bx, by, bz = flux_density(row, u, v, w)
        return in_world(row, bx, by, bz)
    return flux_of_dipole(dipole_of(row), x, y, z)


@subroutine
def flux_of_dipole(source, x, y, z):
    """Return the flux density of a dipole, its position and moment, at a point."""
    x, y, z = x - source[0], y - source[1], z - source[2]
    bx, by, bz = source[3], source[4], source[5]
    square = x * x + y * y + z * z
    scale = VACUUM_PERMEABILITY / (4.0 * math.pi * square * math.sqrt(square))
    near = 3.0 * (bx * x + by * y + bz * z) / square
    return scale * (near * x - bx), scale * (near * y - by), scale * (near * z - bz)


@subroutine
def set_dipole_potentials(room, count, source):
    """Write the potential of a dipole in T m to row 4, at points of the world in rows 0 to 2."""
    u, v, w, mx, my, mz = source
    x, y, z, phi, scale = room[0], room[1], room[2], room[4], VACUUM_PERMEABILITY / (4.0 * math.pi)
    for k in range(count):
        dx, dy, dz = x[k] - u, y[k] - v, z[k] - w
        square = dx * dx + dy * dy + dz * dz
        phi[k] = scale * (mx * dx + my * dy + mz * dz) / (square * math.sqrt(square))


@subroutine
def set_dipole_fields(room, count, source):
    """Write the field of a dipole in T to rows 4 to 6, at points of the world in rows 0 to 2."""
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    for k in range(count):
        hx[k], hy[k], hz[k] = flux_of_dipole(source, x[k], y[k], z[k])


@subroutine
def dipole_at_dipole(target, source):
    """Return the force and torque on a dipole near another one, and its energy."""
    x, y, z = target[0] - source[0], target[1] - source[1], target[2] - source[2]
    ax, ay, az = target[3], target[4], target[5]
    bx, by, bz = source[3], source[4], source[5]
    square = x * x + y * y + z * z
    scale = VACUUM_PERMEABILITY / (4.0 * math.pi * square * math.sqrt(square))
    ar, br, ab = ax * x + ay * y + az * z, bx * x + by * y + bz * z, ax * bx + ay * by + az * bz
    fx, fy, fz = flux_of_dipole(source, target[0], target[1], target[2])
    push = 3.0 * scale / square
    both = ab - 5.0 * ar * br / square
    return (
        push * (ar * bx + br * ax + both * x),
        push * (ar * by + br * ay + both * y),
        push * (ar * bz + br * az + both * z),
        ay * fz - az * fy,
        az * fx - ax * fz,
        ax * fy - ay * fx,
        -(ax * fx + ay * fy + az * fz),
    )


@subroutine
def flux_of_shapes(state, x, y, z):
    """Return the flux density of all magnets by their geom, and of their images, at a point."""
    bx = by = bz = 0.0
    mirror = state.mirror
    for k in range(len(state.shapes)):
        ux, uy, uz = shape_flux(state.shapes[k], x, y, z)
        bx, by, bz = bx + ux, by + uy, bz + uz
        if mirror[0] != 0.0:
            there = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
            flux = shape_flux(state.shapes[k], there[0], there[1], there[2])
            ux, uy, uz = reflected(mirror, flux[0], flux[1], flux[2])
            bx, by, bz = bx - mirror[0] * ux, by - mirror[0] * uy, bz - mirror[0] * uz
    return bx, by, bz
