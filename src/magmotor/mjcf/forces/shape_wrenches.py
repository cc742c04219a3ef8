"""Corrections to dipoles where magnets of true shape are near: forces, energy and fields.

A magnet by its geom is a dipole of the table. Where it is near another magnet, a dipole, or an
image in a plane of iron, the wrench of the dipoles is replaced: the charges of one of the two, by
quadrature, are in the exact field of the other. The forces on the two are opposite, and they are
the derivatives of the energy of the same charges in the potential of the other, by construction.
"""

from magmotor.mjcf.forces.bores import (
    END,
    is_in_bore,
    magnet_fits,
    set_fields_of_coil,
    set_potentials_of_coil,
    thread_charges,
)
from magmotor.mjcf.forces.charges import set_charges, set_dipole
from magmotor.mjcf.forces.dipole_table import BODY as BODY_OF_DIPOLES
from magmotor.mjcf.forces.dipole_table import FIRST, LABEL, SIZE, dipole, padded
from magmotor.mjcf.forces.dipole_table import MOVES as DIPOLES_MOVE
from magmotor.mjcf.forces.facing_faces import NOTHING, facing_faces
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirrored, mirrored_pose, reflected
from magmotor.mjcf.forces.shape_distances import (
    farthest_squared,
    is_near,
    nearest_squared,
    order_of_charges,
    reach_of,
)
from magmotor.mjcf.forces.shape_fields import (
    dipole_at_dipole,
    set_continued_fields,
    set_continued_potentials,
)
from magmotor.mjcf.forces.shaped_magnets import (
    BODY,
    COIL,
    MOVES,
    RADIUS,
    SPREAD,
    WELD,
    dipole_of,
    in_pose,
    in_world,
    pose_of,
)
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.simd import broadcast, load, total


@subroutine
def charges_at_shape(room, count, center, row, threaded, wanted):
    """Return the force and torque on charges in the field of a magnet, or their energy.

    The force and the torque about `center`, in the world's axes, are those of the field that
    continues the one outside, or of a coil if the charges are `threaded` (see `bores.py`); the
    energy is `wanted` only if asked for. The charges, in the world's frame, are taken to that of
    the magnet.
    """
    pose, (xs, ys, zs) = pose_of(row), (room[0], room[1], room[2])
    for k in range(count):
        xs[k], ys[k], zs[k] = in_pose(pose, xs[k], ys[k], zs[k])
    if wanted:
        if threaded:
            set_potentials_of_coil(room, count, row)
        else:
            set_continued_potentials(room, count, row)
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, energy_of_charges(room, count)
    count = pad_charges(room, count)
    if threaded:
        set_fields_of_coil(room, count, row)
    else:
        set_continued_fields(room, count, row)
    center = in_pose(pose, center[0], center[1], center[2])
    wrench = wrench_of_charges(room, count, center)
    force = in_world(row, wrench[0], wrench[1], wrench[2])
    torque = in_world(row, wrench[3], wrench[4], wrench[5])
    return (*force, *torque, 0.0)


@subroutine
def energy_of_charges(room, count):
    """Return the energy in J of the charges in row 3 in the potentials in row 4."""
    total = 0.0
    for k in range(count):
        total += room[3, k] * room[4, k]
    return total / VACUUM_PERMEABILITY


@subroutine
def pad_charges(room, count):
    """Add charges of zero up to a multiple of eight, as `wrench_of_charges` needs; return it."""
    end = padded(count)
    for k in range(count, end):
        room[0, k], room[1, k], room[2, k], room[3, k] = room[0, 0], room[1, 0], room[2, 0], 0.0
    return end


@subroutine
def wrench_of_charges(room, count, center):
    """Return the force and the torque about a center on charges in the fields in rows 4 to 6.

    Their number is a multiple of eight; see `pad_charges`.
    """
    cx, cy, cz = broadcast(center[0]), broadcast(center[1]), broadcast(center[2])
    fx = fy = fz = tx = ty = tz = broadcast(0.0)
    for k in range(0, count, COUNT):
        charge = load(room, 3, k)
        hx, hy, hz = charge * load(room, 4, k), charge * load(room, 5, k), charge * load(room, 6, k)
        fx, fy, fz = fx + hx, fy + hy, fz + hz
        x, y, z = load(room, 0, k) - cx, load(room, 1, k) - cy, load(room, 2, k) - cz
        tx, ty, tz = tx + (y * hz - z * hy), ty + (z * hx - x * hz), tz + (x * hy - y * hx)
    per = 1.0 / VACUUM_PERMEABILITY
    force = per * total(fx), per * total(fy), per * total(fz)
    return (*force, per * total(tx), per * total(ty), per * total(tz))


@subroutine
def _correction(room, count, target, row, mirror, more, apart, threaded, wanted):
    """Return what charges instead of a dipole, and a shape instead of a dipole, change.

    `target` is the dipole that the charges replace, unless they are `apart`; torques are about its
    position. With a mirror, the charges are in the field of the image of the magnet. What they miss
    is added as `more`: it is that of their image, then.
    """
    source = dipole_of(row)
    if mirror[0] == 0.0:
        true = charges_at_shape(room, count, target, row, threaded, wanted)
        point = NOTHING if apart else dipole_at_dipole(target, source)
        return _difference(true, point, more)
    # The charges of an image are opposite, and reflected; so is the field, instead of the magnet.
    for k in range(count):
        place = mirrored(mirror, (room[0, k], room[1, k], room[2, k], 0.0, 0.0, 0.0))
        room[0, k], room[1, k], room[2, k] = place[0], place[1], place[2]
    there = mirrored(mirror, target)
    # A dipole's moment is reflected as a vector, which the force on it takes into account.
    true = charges_at_shape(room, count, there, row, False, wanted)
    point = dipole_at_dipole(there, source)
    change = _difference(true, point, more)
    strength = mirror[0]
    force = reflected(mirror, change[0], change[1], change[2])
    torque = reflected(mirror, change[3], change[4], change[5])
    return (
        -strength * force[0], -strength * force[1], -strength * force[2],
        strength * torque[0], strength * torque[1], strength * torque[2],
        -strength * change[6],
    )  # fmt: skip


@subroutine
def _difference(one, other, more):
    """Return what one wrench, with more of it, and an energy differ from others."""
    return (
        one[0] - other[0] + more[0], one[1] - other[1] + more[1], one[2] - other[2] + more[2],
        one[3] - other[3] + more[3], one[4] - other[4] + more[4], one[5] - other[5] + more[5],
        one[6] - other[6] + more[6],
    )  # fmt: skip


@subroutine
def add_wrench_about(body, factor, wrench, at, center, applied):
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
def add_both(body, moves, other, other_moves, target, change, mirror, factor, center, applied):
    """Add what a correction is to the wrenches of both bodies: of the charges, and of the shape.

    With a mirror, the shape is an image. The reaction on it, reflected, acts on the magnet.
    """
    if moves:
        add_wrench_about(body, factor, change, target, center, applied)
    if other_moves:
        reaction = (-change[0], -change[1], -change[2], -change[3], -change[4], -change[5])
        if mirror[0] == 0.0:
            add_wrench_about(other, factor, reaction, target, center, applied)
        else:
            force = reflected(mirror, reaction[0], reaction[1], reaction[2])
            torque = reflected(mirror, reaction[3], reaction[4], reaction[5])
            both = (*force, -torque[0], -torque[1], -torque[2])
            add_wrench_about(other, factor, both, mirrored(mirror, target), center, applied)


@subroutine
def add_shape_corrections(state, center, applied, wanted):
    """Replace dipoles by shapes where these are near, in wrenches, or in the energy if `wanted`.

    Coils may have magnets in their center, where dipoles have no field. So theirs do not count
    among others, and what they do is added here, near or not. Returns the energy in J.
    """
    shapes, mirror, nothing = state.shapes, state.mirror, NO_MIRROR
    room = state.room
    energy = 0.0
    table, magnets = state.table, state.magnets
    farthest, coils = farthest_squared(shapes), False
    for j in range(len(shapes)):
        coils = coils or shapes[j, COIL] > 0.0
    for j in range(len(shapes)):
        other = shapes[j]
        skipped = mirror[0] == 0.0 and nearest_squared(table, magnets.shaped, j) >= farthest
        skipped = skipped and not coils
        for i in range(0 if skipped else j + 1):
            row = shapes[i]
            moves = row[MOVES] + other[MOVES] > 0.0
            if moves and row[WELD] != other[WELD]:
                energy += _pair(row, other, room, nothing, 1.0, center, applied, wanted)
            if mirror[0] != 0.0 and moves:
                factor = 0.5 if i == j else 1.0
                energy += _pair(row, other, room, mirror, factor, center, applied, wanted)
        for k in range(magnets.sources - len(shapes)):
            first, moves = int(table[FIRST, k]), table[DIPOLES_MOVE, k] + other[MOVES] > 0.0
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
def _pair(one, two, room, mirror, factor, center, applied, wanted):
    """Correct for a pair of magnets, or for one and the image of the other."""
    # The smaller one is represented by charges, since the field of the larger one varies less.
    row, other = (one, two) if one[RADIUS] <= two[RADIUS] else (two, one)
    apart, threaded = mirror[0] == 0.0 and one[COIL] + two[COIL] > 0.0, 0
    fits = apart and magnet_fits(row, other)
    if apart and not fits and magnet_fits(other, row):
        row, other, fits = other, row, True
    if fits:
        threaded = thread_charges(room, row, other)
    target, place = dipole_of(row), dipole_of(other)
    if mirror[0] != 0.0:
        place = mirrored(mirror, place)
    if threaded > 0:
        change = _correction(room, threaded, target, other, mirror, NOTHING, True, True, wanted)
    elif is_near(row, place[0], place[1], place[2], reach_of(other), other[SPREAD]):
        level, pose = order_of_charges(row, other, mirror), pose_of(row)
        if mirror[0] != 0.0:
            pose = mirrored_pose(mirror, pose)
        more = NOTHING
        if not fits:
            level, more = facing_faces(room, pose, row, other, level, wanted)
        count = set_charges(room, row, level)
        change = _correction(room, count, target, other, mirror, more, apart, False, wanted)
    elif apart:
        change = dipole_at_dipole(target, place)
    else:
        return 0.0
    if not wanted:
        add_both(
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
    apart = mirror[0] == 0.0 and row[COIL] > 0.0
    if is_near(row, place[0], place[1], place[2], 0.0, 0.0):
        threaded = apart and is_in_bore(row, place[0], place[1], place[2])
        count = set_dipole(room, target, row[RADIUS])
        for k in range(count):
            room[END, k] = 0.0
        change = _correction(room, count, target, row, mirror, NOTHING, apart, threaded, wanted)
    elif apart:
        change = dipole_at_dipole(target, dipole_of(row))
    else:
        return 0.0
    if not wanted:
        add_both(
            body, moves, int(row[BODY]), row[MOVES] > 0.0,
            target, change, mirror, 1.0, center, applied,
        )  # fmt: skip
    return change[6]
