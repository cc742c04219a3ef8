"""Magnets near a flat face of iron: their images in the face, for what nodes do not resolve.

A magnet near a face is lifted for the nodes; see `faces.py`. Its energy at the true place differs
by that of its image in the plane of the face, which is exact for a wide one:

    U = U_nodes(lifted) + U_image - U_image(lifted).

The image acts on each charge q_i of the magnet with a weight w_i, which is 1 above the face and 0
beside it: U_image = -k/2 sum_i w_i q_i phi(x_i')/mu0, where phi is the potential of the magnet
itself, x_i' the reflected place, and k = chi/(chi + 2). In an inner corner of two faces, there is
the image of both images, too, with k^2 instead of -k. All forces are derivatives of U, including
those of the lift and of the weights.
"""

from magmotor.mjcf.forces.charges import PLACES, set_charges
from magmotor.mjcf.forces.faces import (
    AXIS,
    CENTER,
    EDGE,
    HEIGHT,
    SIDE,
    distance_of_nodes,
    face_from,
    faces_of,
    lift,
    window,
)
from magmotor.mjcf.forces.iron_pieces import FRAME, POSITION, SUSCEPTIBILITY
from magmotor.mjcf.forces.shape_distances import order_of_charges, reach_towards, thickness_of
from magmotor.mjcf.forces.shape_fields import (
    dipole_at_dipole,
    set_continued_fields,
    set_continued_potentials,
)
from magmotor.mjcf.forces.shaped_magnets import POSITION as POSITION_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import RADIUS, in_frame, in_world
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY


@subroutine
def to_piece(piece, x, y, z):
    """Return a vector of the world along the axes of a piece."""
    f = FRAME
    return (
        piece[f] * x + piece[f + 3] * y + piece[f + 6] * z,
        piece[f + 1] * x + piece[f + 4] * y + piece[f + 7] * z,
        piece[f + 2] * x + piece[f + 5] * y + piece[f + 8] * z,
    )


@subroutine
def to_world(piece, x, y, z):
    """Return a vector of a piece along the axes of the world."""
    f = FRAME
    return (
        piece[f] * x + piece[f + 1] * y + piece[f + 2] * z,
        piece[f + 3] * x + piece[f + 4] * y + piece[f + 5] * z,
        piece[f + 6] * x + piece[f + 7] * y + piece[f + 8] * z,
    )


@subroutine
def place_on_piece(piece, x, y, z):
    """Return a point of the world in the frame of a piece."""
    return to_piece(piece, x - piece[POSITION], y - piece[POSITION + 1], z - piece[POSITION + 2])


@subroutine
def _normal(piece, face):
    """Return the outward normal of a face in the world."""
    side, axis = face[0, SIDE], FRAME + int(face[0, AXIS])
    return side * piece[axis], side * piece[axis + 3], side * piece[axis + 6]


@subroutine
def center_on_piece(piece, shape):
    """Return the center of a magnet in the frame of a piece."""
    p = POSITION_OF_SHAPE
    return place_on_piece(piece, shape[p], shape[p + 1], shape[p + 2])


@subroutine
def lift_of_shape(piece, shape):
    """Return how far a magnet is lifted for the nodes of a piece, along the axes of the piece."""
    place, faces = center_on_piece(piece, shape), faces_of(piece)
    x, y, z, first = 0.0, 0.0, 0.0, 0
    while first < len(faces):
        face = face_from(faces, first)
        height, axis = _lift_from(piece, shape, place, face)[0], int(face[0, AXIS])
        x += height if axis == 0 else 0.0
        y += height if axis == 1 else 0.0
        z += height if axis == 2 else 0.0
        first += len(face)
    return x, y, z


@subroutine
def _lift_from(piece, shape, place, face):
    """Return the lift from a face along its axis, the derivatives, and the lowest point."""
    nx, ny, nz = _normal(piece, face)
    extent, x, y, z = reach_towards(shape, -nx, -ny, -nz)
    return (*lift(face, place, extent, shape[RADIUS], thickness_of(shape)), x, y, z)


@subroutine
def _reflection(one, two, lifted):
    """Return the signs of what reflects in one face, or in two if they differ, and the planes."""
    a, b = int(one[0, AXIS]), int(two[0, AXIS])
    top, other = one[0, SIDE] * one[0, HEIGHT], two[0, SIDE] * two[0, HEIGHT]
    signs = (
        -1.0 if a == 0 or b == 0 else 1.0, -1.0 if a == 1 or b == 1 else 1.0,
        -1.0 if a == 2 or b == 2 else 1.0,
    )  # fmt: skip
    planes = (
        (top if a == 0 else other) - lifted[0], (top if a == 1 else other) - lifted[1],
        (top if a == 2 else other) - lifted[2],
    )  # fmt: skip
    return signs, planes


@subroutine
def _reflected(reflection, x, y, z):
    """Return a reflected place, on a piece."""
    (sx, sy, sz), (u, v, w) = reflection
    return sx * x + (1.0 - sx) * u, sy * y + (1.0 - sy) * v, sz * z + (1.0 - sz) * w


@subroutine
def _set_images(piece, shape, one, two, lifted, room):
    """Write the charges of a magnet, and where its own field is that of its image; return how many.

    The rows 0 to 2 are reflected places in the frame of the magnet, 3 are charges with the factor
    of the energy, but not with weights, and `PLACES` are their places in the frame of the piece.
    """
    reflection = _reflection(one, two, lifted)
    strength = piece[SUSCEPTIBILITY] / (piece[SUSCEPTIBILITY] + 2.0)
    factor = -strength if one[0, AXIS] == two[0, AXIS] else strength * strength
    nx, ny, nz = _normal(piece, one)
    x, y, z = piece[POSITION], piece[POSITION + 1], piece[POSITION + 2]
    height = one[0, HEIGHT] - one[0, SIDE] * lifted[int(one[0, AXIS])]
    plane = 1.0, nx, ny, nz, nx * x + ny * y + nz * z + height
    count = set_charges(room, shape, order_of_charges(shape, shape, plane))
    for k in range(count):
        x, y, z = place_on_piece(piece, room[0, k], room[1, k], room[2, k])
        room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k] = x, y, z
        u, v, w = _reflected(reflection, x, y, z)
        dx, dy, dz = to_world(piece, u - x, v - y, w - z)
        x, y, z = in_frame(shape, room[0, k] + dx, room[1, k] + dy, room[2, k] + dz)
        room[0, k], room[1, k], room[2, k] = x, y, z
        room[3, k] *= 0.5 * factor / VACUUM_PERMEABILITY
    return count


@subroutine
def _weight_on(face, place):
    """Return the weight of a charge above a face, and its gradient."""
    axis, width = int(face[0, AXIS]), EDGE * distance_of_nodes(face)
    weight, by_one, by_two = 0.0, 0.0, 0.0
    for number in range(len(face)):
        u, du, dv = window(face[number], place, 0.5, width)
        weight, by_one, by_two = weight + u, by_one + du, by_two + dv
    return (
        weight, _component(axis, 0, 0.0, by_one, by_two), _component(axis, 1, 0.0, by_one, by_two),
        _component(axis, 2, 0.0, by_one, by_two),
    )  # fmt: skip


@subroutine
def _weight_at(one, two, place):
    """Return the weight of a charge above one face, or two if they differ, and its gradient."""
    u, ux, uy, uz = _weight_on(one, place)
    if one[0, AXIS] == two[0, AXIS]:
        return u, ux, uy, uz
    v, vx, vy, vz = _weight_on(two, place)
    return u * v, u * vx + v * ux, u * vy + v * uy, u * vz + v * uz


@subroutine
def _weight(one, two, lifted, room, k):
    """Return the same for a charge of a magnet that is lifted."""
    x, y, z = room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k]
    return _weight_at(one, two, (x + lifted[0], y + lifted[1], z + lifted[2]))


@subroutine
def _energy_of_image(piece, shape, one, two, lifted, room):
    """Return the energy of a magnet, lifted or not, in its image in a face, or in a corner."""
    count = _set_images(piece, shape, one, two, lifted, room)
    set_continued_potentials(room, count, shape)
    energy = 0.0
    for k in range(count):
        energy += _weight(one, two, lifted, room, k)[0] * room[3, k] * room[4, k]
    return energy


@subroutine
def _wrench_of_image(piece, shape, one, two, lifted, room):
    """Return the force and torque on a magnet in that image, along the piece's axes.

    The torque is about the magnet's center. Each charge moves with the magnet, and so does the
    magnet's field at its image, which moves as the reflection says.
    """
    count = _set_images(piece, shape, one, two, lifted, room)
    set_continued_potentials(room, count, shape)
    reflection, (u, v, w) = _reflection(one, two, lifted), center_on_piece(piece, shape)
    sx, sy, sz = reflection[0]
    fx = fy = fz = tx = ty = tz = 0.0
    for k in range(count):
        weight, gx, gy, gz = _weight(one, two, lifted, room, k)
        energy = -room[3, k] * room[4, k]
        room[3, k] *= weight
        x, y, z = room[PLACES, k] - u, room[PLACES + 1, k] - v, room[PLACES + 2, k] - w
        gx, gy, gz = energy * gx, energy * gy, energy * gz
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + y * gz - z * gy, ty + z * gx - x * gz, tz + x * gy - y * gx
    set_continued_fields(room, count, shape)
    for k in range(count):
        x, y, z = room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k]
        there = _reflected(reflection, x, y, z)
        x, y, z, a, b, c = x - u, y - v, z - w, there[0] - u, there[1] - v, there[2] - w
        world = in_world(shape, room[4, k], room[5, k], room[6, k])
        h = to_piece(piece, world[0], world[1], world[2])
        hx, hy, hz = room[3, k] * h[0], room[3, k] * h[1], room[3, k] * h[2]
        # The reflected force at the charge, and the opposite of the force at its image.
        rx, ry, rz = sx * hx, sy * hy, sz * hz
        fx, fy, fz = fx + rx - hx, fy + ry - hy, fz + rz - hz
        tx += y * rz - z * ry - b * hz + c * hy
        ty += z * rx - x * rz - c * hx + a * hz
        tz += x * ry - y * rx - a * hy + b * hx
    return fx, fy, fz, tx, ty, tz


@subroutine
def _component(axis, k, along, one, two):
    """Return component k of a vector given along an axis and the two next ones."""
    if k == axis:
        return along
    return one if k == (axis + 1) % 3 else two


@subroutine
def _lifts(piece, shape, place, face):
    """Whether a face lifts a magnet."""
    return _lift_from(piece, shape, place, face)[0] != 0.0


@subroutine
def _rises_above(face, other):
    """Whether a rectangle of a face is in front of the plane of another one."""
    axis = int(other[0, AXIS])
    after, found = (axis - int(face[0, AXIS]) - 1) % 3, False
    for k in range(len(face) if after < 2 else 0):
        found = found or other[0, SIDE] * face[k, CENTER + after] > other[0, HEIGHT]
    return found


@subroutine
def _has_image(piece, shape, place, one, two):
    """Whether a magnet has an image in a face, if both are the same, or in their inner corner."""
    same = one[0, AXIS] == two[0, AXIS] and one[0, SIDE] == two[0, SIDE]
    same = same and one[0, HEIGHT] == two[0, HEIGHT]
    if not (same or (_rises_above(one, two) and _rises_above(two, one))):
        return False
    return _lifts(piece, shape, place, one) and (same or _lifts(piece, shape, place, two))


@subroutine
def image_energy(piece, shape, room):
    """Return the energy by which images in faces differ from nodes, for a magnet near a piece."""
    lifted, faces = lift_of_shape(piece, shape), faces_of(piece)
    place, energy, first = center_on_piece(piece, shape), 0.0, 0
    while first < len(faces):
        one, second = face_from(faces, first), first
        while second < len(faces):
            two = face_from(faces, second)
            if _has_image(piece, shape, place, one, two):
                energy += _energy_of_image(piece, shape, one, two, (0.0, 0.0, 0.0), room)
                energy -= _energy_of_image(piece, shape, one, two, lifted, room)
            second += len(two)
        first += len(one)
    return energy


@subroutine
def lift_of_dipole(piece, target):
    """Return how far a dipole is lifted for the nodes of a piece, along the axes of the piece."""
    place, faces = place_on_piece(piece, target[0], target[1], target[2]), faces_of(piece)
    x, y, z, first = 0.0, 0.0, 0.0, 0
    while first < len(faces):
        face = face_from(faces, first)
        height, axis = _lift_of_dipole(place, face)[0], int(face[0, AXIS])
        x += height if axis == 0 else 0.0
        y += height if axis == 1 else 0.0
        z += height if axis == 2 else 0.0
        first += len(face)
    return x, y, z


@subroutine
def _lift_of_dipole(place, face):
    """Return the lift of a dipole from a face, and its derivatives."""
    return lift(face, place, 0.0, 0.0, 0.0)


@subroutine
def _dipole_has_image(place, one, two, same):
    """Whether a dipole has an image in a face, or in the inner corner of two different ones."""
    if not (same or (_rises_above(one, two) and _rises_above(two, one))):
        return False
    return _lift_of_dipole(place, one)[0] != 0.0 and _lift_of_dipole(place, two)[0] != 0.0


@subroutine
def _dipole_and_image(piece, target, one, two, lifted):
    """Return the force, torque and energy of a dipole in its image, and the weight of that.

    The force and the torque are those at a weight of 1, along the axes of the piece. The gradient
    of the weight follows.
    """
    x, y, z = place_on_piece(piece, target[0], target[1], target[2])
    mx, my, mz = to_piece(piece, target[3], target[4], target[5])
    x, y, z = x + lifted[0], y + lifted[1], z + lifted[2]
    reflection = _reflection(one, two, (0.0, 0.0, 0.0))
    (sx, sy, sz), (u, v, w) = reflection[0], _reflected(reflection, x, y, z)
    k = piece[SUSCEPTIBILITY] / (piece[SUSCEPTIBILITY] + 2.0)
    factor = -k if one[0, AXIS] == two[0, AXIS] else k * k
    f = dipole_at_dipole((x, y, z, mx, my, mz), (u, v, w, sx * mx, sy * my, sz * mz))
    weight = _weight_at(one, two, (x, y, z))
    return (
        factor * f[0], factor * f[1], factor * f[2], factor * f[3], factor * f[4], factor * f[5],
        0.5 * factor * f[6], weight[0], weight[1], weight[2], weight[3],
    )  # fmt: skip


@subroutine
def dipole_image_energy(piece, target):
    """Return the energy by which images in faces differ from nodes, for a dipole near a piece."""
    lifted, faces = lift_of_dipole(piece, target), faces_of(piece)
    place, energy, first = place_on_piece(piece, target[0], target[1], target[2]), 0.0, 0
    while first < len(faces):
        one, second = face_from(faces, first), first
        while second < len(faces):
            two = face_from(faces, second)
            if _dipole_has_image(place, one, two, first == second):
                a = _dipole_and_image(piece, target, one, two, (0.0, 0.0, 0.0))
                b = _dipole_and_image(piece, target, one, two, lifted)
                energy += a[6] * a[7] - b[6] * b[7]
            second += len(two)
        first += len(one)
    return energy


@subroutine
def _dipole_images(piece, target, shift):
    """Return the force and the torque on a dipole in all its images, shifted, along the axes."""
    faces, place = faces_of(piece), place_on_piece(piece, target[0], target[1], target[2])
    fx, fy, fz, tx, ty, tz, first = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    while first < len(faces):
        one, second = face_from(faces, first), first
        while second < len(faces):
            two = face_from(faces, second)
            if _dipole_has_image(place, one, two, first == second):
                a = _dipole_and_image(piece, target, one, two, shift)
                fx, fy, fz = (
                    fx + a[7] * a[0] - a[6] * a[8], fy + a[7] * a[1] - a[6] * a[9],
                    fz + a[7] * a[2] - a[6] * a[10],
                )  # fmt: skip
                tx, ty, tz = tx + a[7] * a[3], ty + a[7] * a[4], tz + a[7] * a[5]
            second += len(two)
        first += len(one)
    return fx, fy, fz, tx, ty, tz


@subroutine
def with_images_of_dipole(piece, target, wrench):
    """Return the wrench on a piece from a dipole, given that on its nodes from the lifted dipole.

    Torques are about the dipole, and the reaction on it is opposite.
    """
    lifted, faces = lift_of_dipole(piece, target), faces_of(piece)
    place, first = place_on_piece(piece, target[0], target[1], target[2]), 0
    a = _dipole_images(piece, target, (0.0, 0.0, 0.0))
    b = _dipole_images(piece, target, lifted)
    fx, fy, fz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    gx, gy, gz = to_piece(piece, -wrench[0], -wrench[1], -wrench[2])
    gx, gy, gz = gx - b[0], gy - b[1], gz - b[2]
    while first < len(faces):
        face = face_from(faces, first)
        height, by_height, by_one, by_two = _lift_of_dipole(place, face)
        if height != 0.0:
            axis = int(face[0, AXIS])
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            along, u, v = push * by_height, push * by_one, push * by_two
            fx += _component(axis, 0, along, u, v)
            fy += _component(axis, 1, along, u, v)
            fz += _component(axis, 2, along, u, v)
        first += len(face)
    force = to_world(piece, fx, fy, fz)
    torque = to_world(piece, a[3] - b[3], a[4] - b[4], a[5] - b[5])
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - torque[0], wrench[4] - torque[1], wrench[5] - torque[2],
    )  # fmt: skip


@subroutine
def with_images(piece, shape, wrench, room):
    """Return the wrench on a piece from a magnet, given that on its nodes from the lifted magnet.

    Torques are about the center of the magnet, and the reaction on it is opposite.
    """
    lifted, faces = lift_of_shape(piece, shape), faces_of(piece)
    place = center_on_piece(piece, shape)
    gx, gy, gz = to_piece(piece, -wrench[0], -wrench[1], -wrench[2])
    fx, fy, fz, tx, ty, tz, first = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    while first < len(faces):
        one, second = face_from(faces, first), first
        while second < len(faces):
            two = face_from(faces, second)
            if _has_image(piece, shape, place, one, two):
                a = _wrench_of_image(piece, shape, one, two, (0.0, 0.0, 0.0), room)
                b = _wrench_of_image(piece, shape, one, two, lifted, room)
                fx, fy, fz = fx + a[0] - b[0], fy + a[1] - b[1], fz + a[2] - b[2]
                tx, ty, tz = tx + a[3] - b[3], ty + a[4] - b[4], tz + a[5] - b[5]
                # What the lifted magnet would feel if it were moved alone.
                gx, gy, gz = gx - b[0], gy - b[1], gz - b[2]
            second += len(two)
        first += len(one)
    first = 0
    while first < len(faces):
        face = face_from(faces, first)
        height, by_height, by_one, by_two, dx, dy, dz = _lift_from(piece, shape, place, face)
        if height != 0.0:
            axis = int(face[0, AXIS])
            one, two = (axis + 1) % 3, (axis + 2) % 3
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            along, u, v = push * by_height, push * by_one, push * by_two
            arm = to_piece(piece, dx, dy, dz)
            fx += _component(axis, 0, along, u, v)
            fy += _component(axis, 1, along, u, v)
            fz += _component(axis, 2, along, u, v)
            # At the lowest point of the magnet.
            tu, tv = arm[two] * along, -arm[one] * along
            tx += _component(axis, 0, 0.0, tu, tv)
            ty += _component(axis, 1, 0.0, tu, tv)
            tz += _component(axis, 2, 0.0, tu, tv)
        first += len(face)
    force, torque = to_world(piece, fx, fy, fz), to_world(piece, tx, ty, tz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - torque[0], wrench[4] - torque[1], wrench[5] - torque[2],
    )  # fmt: skip
