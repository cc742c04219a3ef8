"""Corrections to dipoles where magnets of true shape are near: forces, energy and fields.

A magnet by its geom is a dipole of the table. Where it is near another magnet, a dipole, or an
image in a plane of iron, the wrench of the dipoles is replaced: the charges of one of the two, by
quadrature, are in the exact field of the other. The forces on the two are opposite, and they are
the derivatives of the energy of the same charges in the potential of the other, by construction.
"""

import math

from magmotor.mjcf.declarations.iron import BOX, CYLINDER, SPHERE
from magmotor.mjcf.forces.charges import set_charges, set_dipole
from magmotor.mjcf.forces.dipole_table import BODY as BODY_OF_DIPOLES
from magmotor.mjcf.forces.dipole_table import FIRST, LABEL, SIZE, dipole
from magmotor.mjcf.forces.dipole_table import MOVES as DIPOLES_MOVE
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirrored
from magmotor.mjcf.forces.shape_fields import (
    continued_potential,
    flux_density,
    set_continued_fields,
)
from magmotor.mjcf.forces.shaped_magnets import (
    BODY,
    FRAME,
    KIND,
    LENGTHS,
    MOMENT,
    MOVES,
    POSITION,
    RADIUS,
    SPREAD,
    WELD,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

FAR, FAR_SPREAD = 2.0, 1000.0
"""Two magnets are dipoles for each other from this many radii of both on, if the squared distance is
also this many times the differences of their second moments. The force of the dipoles is then wrong
by at most 1.2 % of what it is in the worst direction."""

CLOSE = (4.0, 1.3, 0.45, 0.05)
"""Gaps between two magnets, over the radius of the one that has charges, below which these need the
next order."""


@subroutine
def _is_near(row, x, y, z, radius, spread):
    """Whether a magnet counts by its shape for something at a point, of a radius and a spread."""
    square = _squared_distance(row, x, y, z)
    reach = FAR * (_reach(row) + radius)
    return square < max(reach * reach, FAR_SPREAD * (row[SPREAD] + spread))


@subroutine
def _reach(row):
    """Return the radius of a magnet, or 0 for a sphere, which is a dipole for everything outside."""
    return 0.0 if int(row[KIND]) == SPHERE else row[RADIUS]


@subroutine
def _squared_distance(row, x, y, z):
    dx, dy, dz = x - row[POSITION], y - row[POSITION + 1], z - row[POSITION + 2]
    return dx * dx + dy * dy + dz * dz


@subroutine
def _level(row, other, mirror):
    """Return the order of the charges of `row` in the field of another magnet, or of its image.

    The gap between the two is at least that along the line between their centers.
    """
    place = _center(other)
    x, y, z = row[POSITION], row[POSITION + 1], row[POSITION + 2]
    if mirror[0] != 0.0:
        there = mirrored(mirror, _center(row))
        nx, ny, nz = there[0] - place[0], there[1] - place[1], there[2] - place[2]
        place = mirrored(mirror, place)
    else:
        nx, ny, nz = x - place[0], y - place[1], z - place[2]
    distance = math.sqrt(nx * nx + ny * ny + nz * nz)
    gap = distance - _extent(row, x - place[0], y - place[1], z - place[2], distance)
    gap -= _extent(other, nx, ny, nz, distance)
    level = 0
    for k in range(len(CLOSE)):
        level += gap < CLOSE[k] * row[RADIUS]
    return level


@subroutine
def _extent(row, x, y, z, distance):
    """Return how far a magnet reaches from its center in a direction, a vector of given length."""
    x, y, z = _in_frame(row, x + row[POSITION], y + row[POSITION + 1], z + row[POSITION + 2])
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    if int(row[KIND]) == BOX:
        return (abs(x) * a + abs(y) * b + abs(z) * c) / distance
    if int(row[KIND]) == CYLINDER:
        return (math.sqrt(x * x + y * y) * a + abs(z) * b) / distance
    return math.sqrt(x * x * a * a + y * y * b * b + z * z * c * c) / distance


@subroutine
def _center(row):
    """Return the dipole of a magnet: its position and moment."""
    return (
        row[POSITION], row[POSITION + 1], row[POSITION + 2],
        row[MOMENT], row[MOMENT + 1], row[MOMENT + 2],
    )  # fmt: skip


@subroutine
def _in_frame(row, x, y, z):
    """Return a point in the frame of a magnet."""
    dx, dy, dz = x - row[POSITION], y - row[POSITION + 1], z - row[POSITION + 2]
    return (
        row[FRAME] * dx + row[FRAME + 3] * dy + row[FRAME + 6] * dz,
        row[FRAME + 1] * dx + row[FRAME + 4] * dy + row[FRAME + 7] * dz,
        row[FRAME + 2] * dx + row[FRAME + 5] * dy + row[FRAME + 8] * dz,
    )


@subroutine
def _in_world(row, x, y, z):
    """Return a vector of the frame of a magnet along the axes of the world."""
    return (
        row[FRAME] * x + row[FRAME + 1] * y + row[FRAME + 2] * z,
        row[FRAME + 3] * x + row[FRAME + 4] * y + row[FRAME + 5] * z,
        row[FRAME + 6] * x + row[FRAME + 7] * y + row[FRAME + 8] * z,
    )


@subroutine
def _reflected(mirror, x, y, z):
    """Return a vector that the plane of a mirror reflects."""
    along = 2.0 * (mirror[1] * x + mirror[2] * y + mirror[3] * z)
    return x - along * mirror[1], y - along * mirror[2], z - along * mirror[3]


@subroutine
def dipole_at_dipole(target, source):
    """Return the force and torque on a dipole near another one, and its energy."""
    x, y, z = target[0] - source[0], target[1] - source[1], target[2] - source[2]
    ax, ay, az = target[3], target[4], target[5]
    bx, by, bz = source[3], source[4], source[5]
    square = x * x + y * y + z * z
    scale = VACUUM_PERMEABILITY / (4.0 * math.pi * square * math.sqrt(square))
    ar, br, ab = ax * x + ay * y + az * z, bx * x + by * y + bz * z, ax * bx + ay * by + az * bz
    near = 3.0 * br / square
    fx, fy, fz = scale * (near * x - bx), scale * (near * y - by), scale * (near * z - bz)
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
def _charges_at_shape(room, count, center, row, wanted):
    """Return the force and torque on charges in the field of a magnet, or their energy.

    The force and the torque about `center`, in the world's axes, are those of the field that
    continues the one outside; the energy is `wanted` only if asked for.
    """
    fx = fy = fz = tx = ty = tz = energy = 0.0
    cx, cy, cz = _in_frame(row, center[0], center[1], center[2])
    for k in range(count):
        x, y, z = _in_frame(row, room[0, k], room[1, k], room[2, k])
        room[0, k], room[1, k], room[2, k] = x, y, z
        if wanted:
            energy += room[3, k] * continued_potential(row, x, y, z)
    if not wanted:
        set_continued_fields(room, count, row)
        for k in range(count):
            charge = room[3, k]
            hx, hy, hz = charge * room[4, k], charge * room[5, k], charge * room[6, k]
            fx, fy, fz = fx + hx, fy + hy, fz + hz
            x, y, z = room[0, k] - cx, room[1, k] - cy, room[2, k] - cz
            tx, ty, tz = tx + y * hz - z * hy, ty + z * hx - x * hz, tz + x * hy - y * hx
    per = 1.0 / VACUUM_PERMEABILITY
    fx, fy, fz, tx, ty, tz = per * fx, per * fy, per * fz, per * tx, per * ty, per * tz
    energy *= per
    force, torque = _in_world(row, fx, fy, fz), _in_world(row, tx, ty, tz)
    return (*force, *torque, energy)


@subroutine
def _correction(room, count, target, row, mirror, wanted):
    """Return what charges instead of a dipole, and a shape instead of a dipole, change.

    `target` is the dipole that the charges replace; torques are about its position. With a mirror,
    the charges are in the field of the image of the magnet.
    """
    source = _center(row)
    if mirror[0] == 0.0:
        true = _charges_at_shape(room, count, target, row, wanted)
        point = dipole_at_dipole(target, source)
        return _difference(true, point)
    # The charges of an image are opposite, and reflected; so is the field, instead of the magnet.
    for k in range(count):
        place = mirrored(mirror, (room[0, k], room[1, k], room[2, k], 0.0, 0.0, 0.0))
        room[0, k], room[1, k], room[2, k] = place[0], place[1], place[2]
    there = mirrored(mirror, target)
    # A dipole's moment is reflected as a vector, which the force on it takes into account.
    true = _charges_at_shape(room, count, there, row, wanted)
    point = dipole_at_dipole(there, source)
    change = _difference(true, point)
    strength = mirror[0]
    force = _reflected(mirror, change[0], change[1], change[2])
    torque = _reflected(mirror, change[3], change[4], change[5])
    return (
        -strength * force[0], -strength * force[1], -strength * force[2],
        strength * torque[0], strength * torque[1], strength * torque[2],
        -strength * change[6],
    )  # fmt: skip


@subroutine
def _difference(one, other):
    return (
        one[0] - other[0], one[1] - other[1], one[2] - other[2],
        one[3] - other[3], one[4] - other[4], one[5] - other[5],
        one[6] - other[6],
    )  # fmt: skip


@subroutine
def _add(body, factor, wrench, at, center, applied):
    """Add a force, and a torque about a point, to the wrench of a body."""
    x, y, z = at[0] - center[body, 0], at[1] - center[body, 1], at[2] - center[body, 2]
    fx, fy, fz = factor * wrench[0], factor * wrench[1], factor * wrench[2]
    applied[body, 0] += fx
    applied[body, 1] += fy
    applied[body, 2] += fz
    applied[body, 3] += factor * wrench[3] + y * fz - z * fy
    applied[body, 4] += factor * wrench[4] + z * fx - x * fz
    applied[body, 5] += factor * wrench[5] + x * fy - y * fx


@subroutine
def _add_both(body, moves, other, other_moves, target, change, mirror, factor, center, applied):
    """Add what a correction is to the wrenches of both bodies: of the charges, and of the shape.

    With a mirror, the shape is an image. The reaction on it, reflected, acts on the magnet.
    """
    if moves:
        _add(body, factor, change, target, center, applied)
    if other_moves:
        reaction = (-change[0], -change[1], -change[2], -change[3], -change[4], -change[5])
        if mirror[0] == 0.0:
            _add(other, factor, reaction, target, center, applied)
        else:
            force = _reflected(mirror, reaction[0], reaction[1], reaction[2])
            torque = _reflected(mirror, reaction[3], reaction[4], reaction[5])
            both = (*force, -torque[0], -torque[1], -torque[2])
            _add(other, factor, both, mirrored(mirror, target), center, applied)


@subroutine
def add_shape_corrections(state, room, center, applied, wanted):
    """Replace dipoles by shapes where these are near, in wrenches, or in the energy if `wanted`.

    Returns the energy in J that is added. `room` is for charges (see `charges.py`).
    """
    shapes, mirror, nothing = state.shapes, state.mirror, NO_MIRROR
    energy = 0.0
    table, magnets = state.table, state.magnets
    farthest = _farthest(shapes)
    for j in range(len(shapes)):
        other = shapes[j]
        skipped = mirror[0] == 0.0 and _nearest(table, magnets.shaped, j) >= farthest
        for i in range(0 if skipped else j + 1):
            row = shapes[i]
            moves = row[MOVES] + other[MOVES] > 0.0
            if moves and row[WELD] != other[WELD]:
                energy += _pair(row, other, room, nothing, 1.0, center, applied, wanted)
            if mirror[0] != 0.0 and moves:
                factor = 0.5 if i == j else 1.0
                energy += _pair(row, other, room, mirror, factor, center, applied, wanted)
        for k in range(magnets.number - len(shapes)):
            first, moves = int(table[FIRST, k]), table[DIPOLES_MOVE, k] + other[MOVES] > 0.0
            # The energy of iron is that in the true field already.
            moves = moves and not (wanted and magnets.iron <= first < magnets.shaped)
            for i in range(first, first + int(table[SIZE, k]) if moves else first):
                target = dipole(table, i)
                body, on_it = int(table[BODY_OF_DIPOLES, k]), table[DIPOLES_MOVE, k] > 0.0
                if table[LABEL, i] != other[WELD]:
                    energy += _dipole_and_shape(
                        target, body, on_it, other, room, nothing, center, applied, wanted
                    )
                if mirror[0] != 0.0:
                    energy += _dipole_and_shape(
                        target, body, on_it, other, room, mirror, center, applied, wanted
                    )
    return energy


@subroutine
def _farthest(shapes):
    """Return the squared distance from which on no two magnets are near."""
    reach = spread = 0.0
    for k in range(len(shapes)):
        reach, spread = max(reach, _reach(shapes[k])), max(spread, shapes[k, SPREAD])
    return max((2.0 * FAR * reach) ** 2, 2.0 * FAR_SPREAD * spread)


@subroutine
def _nearest(table, first, number):
    """Return the squared distance of a magnet to the nearest of those before it.

    The loop over the table of dipoles is fast.
    """
    x, y, z = table[0], table[1], table[2]
    target, nearest = first + number, math.inf
    for k in range(first, target):
        dx, dy, dz = x[k] - x[target], y[k] - y[target], z[k] - z[target]
        nearest = min(nearest, dx * dx + dy * dy + dz * dz)
    return nearest


@subroutine
def _pair(one, two, room, mirror, factor, center, applied, wanted):
    """Correct for a pair of magnets, or for one and the image of the other."""
    # The smaller one is represented by charges, since the field of the larger one varies less.
    row, other = (one, two) if one[RADIUS] <= two[RADIUS] else (two, one)
    target, place = _center(row), _center(other)
    if mirror[0] != 0.0:
        place = mirrored(mirror, place)
    if not _is_near(row, place[0], place[1], place[2], _reach(other), other[SPREAD]):
        return 0.0
    count = set_charges(room, row, _level(row, other, mirror))
    change = _correction(room, count, target, other, mirror, wanted)
    if not wanted:
        _add_both(
            int(row[BODY]), row[MOVES] > 0.0, int(other[BODY]), other[MOVES] > 0.0,
            target, change, mirror, factor, center, applied,
        )  # fmt: skip
    return factor * change[6]


@subroutine
def _dipole_and_shape(target, body, moves, row, room, mirror, center, applied, wanted):
    """Correct for a dipole and a magnet, or for the dipole and the image of the magnet."""
    if target[3] == 0.0 and target[4] == 0.0 and target[5] == 0.0:
        return 0.0
    place = mirrored(mirror, target) if mirror[0] != 0.0 else target
    if not _is_near(row, place[0], place[1], place[2], 0.0, 0.0):
        return 0.0
    count = set_dipole(room, target, row[RADIUS])
    change = _correction(room, count, target, row, mirror, wanted)
    if not wanted:
        _add_both(
            body, moves, int(row[BODY]), row[MOVES] > 0.0,
            target, change, mirror, 1.0, center, applied,
        )  # fmt: skip
    return change[6]


@subroutine
def shape_flux(row, x, y, z):
    """Return the flux density of a magnet at a point of the world, also inside."""
    inside = _squared_distance(row, x, y, z) < row[RADIUS] * row[RADIUS]
    if inside or _is_near(row, x, y, z, 0.0, 0.0):
        u, v, w = _in_frame(row, x, y, z)
        bx, by, bz = flux_density(row, u, v, w)
        return _in_world(row, bx, by, bz)
    bx, by, bz = x - row[POSITION], y - row[POSITION + 1], z - row[POSITION + 2]
    square = bx * bx + by * by + bz * bz
    scale = VACUUM_PERMEABILITY / (4.0 * math.pi * square * math.sqrt(square))
    near = 3.0 * (row[MOMENT] * bx + row[MOMENT + 1] * by + row[MOMENT + 2] * bz) / square
    return (
        scale * (near * bx - row[MOMENT]),
        scale * (near * by - row[MOMENT + 1]),
        scale * (near * bz - row[MOMENT + 2]),
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
            ux, uy, uz = _reflected(mirror, flux[0], flux[1], flux[2])
            bx, by, bz = bx - mirror[0] * ux, by - mirror[0] * uy, bz - mirror[0] * uz
    return bx, by, bz
