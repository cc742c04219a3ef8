"""Magnets near a flat face of iron: their images in the face, for what nodes do not resolve.

A magnet near a face is lifted for the nodes; see `faces.py`. Its energy at the true place differs
by that of its image in the plane of the face, which is exact for a wide one:

    U = U_nodes(lifted) + U_image - U_image(lifted).

The image acts on each charge q_i of the magnet with a weight w_i, which is 1 above the face and 0
beside it: U_image = -k/2 sum_i w_i q_i phi(x_i')/mu0, where phi is the potential of the magnet
itself, x_i' the reflected place, and k = chi/(chi + 2). All forces are derivatives of U, including
those of the lift and of the weights.
"""

import math

from magmotor.mjcf.forces.charges import PLACES, set_charges
from magmotor.mjcf.forces.faces import (
    AXIS,
    EDGE,
    HEIGHT,
    SIDE,
    face_from,
    faces_of,
    lift,
    resolved_height,
    window,
)
from magmotor.mjcf.forces.iron_pieces import FRAME, POSITION, SUSCEPTIBILITY
from magmotor.mjcf.forces.shape_distances import order_of_charges, support
from magmotor.mjcf.forces.shape_fields import set_continued_fields, set_continued_potentials
from magmotor.mjcf.forces.shaped_magnets import LENGTHS as LENGTHS_OF_SHAPE
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
    """Return the lift from a face along its axis, and the derivatives."""
    nx, ny, nz = _normal(piece, face)
    dx, dy, dz = support(shape, -nx, -ny, -nz)
    extent = -(nx * dx + ny * dy + nz * dz)
    p = LENGTHS_OF_SHAPE
    thickness = 2.0 * min(shape[p], shape[p + 1], shape[p + 2])
    return lift(face, place, extent, shape[RADIUS], thickness)


@subroutine
def _set_images(piece, shape, face, lifted, room):
    """Write the charges of a magnet, and where its own field is that of its image; return how many.

    The rows 0 to 2 are reflected places in the frame of the magnet, 3 are charges with the factor
    of the energy, but not with weights, and `PLACES` are their places in the frame of the piece.
    """
    chi = piece[SUSCEPTIBILITY]
    strength = chi / (chi + 2.0)
    nx, ny, nz = _normal(piece, face)
    side, axis = face[0, SIDE], int(face[0, AXIS])
    top = side * face[0, HEIGHT]
    x, y, z = piece[POSITION], piece[POSITION + 1], piece[POSITION + 2]
    height = nx * x + ny * y + nz * z + face[0, HEIGHT] - side * lifted[axis]
    count = set_charges(room, shape, order_of_charges(shape, shape, (1.0, nx, ny, nz, height)))
    for k in range(count):
        x, y, z = place_on_piece(piece, room[0, k], room[1, k], room[2, k])
        room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k] = x, y, z
        shift = 2.0 * (top - room[PLACES + axis, k] - lifted[axis])
        dx, dy, dz = side * shift * nx, side * shift * ny, side * shift * nz
        x, y, z = in_frame(shape, room[0, k] + dx, room[1, k] + dy, room[2, k] + dz)
        room[0, k], room[1, k], room[2, k] = x, y, z
        room[3, k] *= -0.5 * strength / VACUUM_PERMEABILITY
    return count


@subroutine
def _weight(face, width, lifted, room, k):
    """Return the weight of a charge, and its derivatives along the two next axes."""
    place = (
        room[PLACES, k] + lifted[0], room[PLACES + 1, k] + lifted[1],
        room[PLACES + 2, k] + lifted[2],
    )  # fmt: skip
    weight, by_one, by_two = 0.0, 0.0, 0.0
    for number in range(len(face)):
        u, du, dv = window(face[number], place, 0.5, width)
        weight, by_one, by_two = weight + u, by_one + du, by_two + dv
    return weight, by_one, by_two


@subroutine
def _energy_of_image(piece, shape, face, lifted, room):
    """Return the energy of a magnet, lifted or not, in its image in a face."""
    count = _set_images(piece, shape, face, lifted, room)
    set_continued_potentials(room, count, shape)
    energy, width = 0.0, EDGE * resolved_height(face)
    for k in range(count):
        energy += _weight(face, width, lifted, room, k)[0] * room[3, k] * room[4, k]
    return energy


@subroutine
def _wrench_of_image(piece, shape, place, face, lifted, room):
    """Return the force and torque on a magnet in its image, along the piece's axes.

    The torque is about the magnet's center. Each charge moves with the magnet, and so does the
    magnet's field at its image, which moves oppositely along the normal.
    """
    count = _set_images(piece, shape, face, lifted, room)
    set_continued_potentials(room, count, shape)
    axis, width = int(face[0, AXIS]), EDGE * resolved_height(face)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    top = face[0, SIDE] * face[0, HEIGHT]
    fn = fu = fv = tn = tu = tv = 0.0
    for k in range(count):
        weight, by_one, by_two = _weight(face, width, lifted, room, k)
        energy = room[3, k] * room[4, k]
        room[3, k] *= weight
        # In the order normal, one, two, which is right-handed.
        n, u, v = _from_center(room, k, place, axis)
        gu, gv = -energy * by_one, -energy * by_two
        fu, fv = fu + gu, fv + gv
        tn, tu, tv = tn + u * gv - v * gu, tu - n * gv, tv + n * gu
    set_continued_fields(room, count, shape)
    for k in range(count):
        n, u, v = _from_center(room, k, place, axis)
        there = 2.0 * (top - lifted[axis] - place[axis]) - n
        world = in_world(shape, room[4, k], room[5, k], room[6, k])
        h = to_piece(piece, world[0], world[1], world[2])
        hn, hu, hv = room[3, k] * h[axis], room[3, k] * h[one], room[3, k] * h[two]
        # The force (-hn, hu, hv) at the charge, and (-hn, -hu, -hv) at its image.
        fn -= 2.0 * hn
        tu += -v * hn - n * hv - v * hn + there * hv
        tv += n * hu + u * hn - there * hu + u * hn
    return (
        _component(axis, 0, fn, fu, fv), _component(axis, 1, fn, fu, fv),
        _component(axis, 2, fn, fu, fv), _component(axis, 0, tn, tu, tv),
        _component(axis, 1, tn, tu, tv), _component(axis, 2, tn, tu, tv),
    )  # fmt: skip


@subroutine
def _from_center(room, k, place, axis):
    """Return the place of a charge from the magnet's center: along the axis, and the two next."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    return (
        room[PLACES + axis, k] - place[axis], room[PLACES + one, k] - place[one],
        room[PLACES + two, k] - place[two],
    )  # fmt: skip


@subroutine
def _component(axis, k, along, one, two):
    """Return component k of a vector given along an axis and the two next ones."""
    if k == axis:
        return along
    return one if k == (axis + 1) % 3 else two


@subroutine
def image_energy(piece, shape, room):
    """Return the energy by which images in faces differ from nodes, for a magnet near a piece."""
    lifted, faces = lift_of_shape(piece, shape), faces_of(piece)
    place, energy, first = center_on_piece(piece, shape), 0.0, 0
    while first < len(faces):
        face = face_from(faces, first)
        if _lift_from(piece, shape, place, face)[0] != 0.0:
            energy += _energy_of_image(piece, shape, face, (0.0, 0.0, 0.0), room)
            energy -= _energy_of_image(piece, shape, face, lifted, room)
        first += len(face)
    return energy


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
        face = face_from(faces, first)
        if _lift_from(piece, shape, place, face)[0] != 0.0:
            a = _wrench_of_image(piece, shape, place, face, (0.0, 0.0, 0.0), room)
            b = _wrench_of_image(piece, shape, place, face, lifted, room)
            fx, fy, fz = fx + a[0] - b[0], fy + a[1] - b[1], fz + a[2] - b[2]
            tx, ty, tz = tx + a[3] - b[3], ty + a[4] - b[4], tz + a[5] - b[5]
            # What the lifted magnet would feel if it were moved alone.
            gx, gy, gz = gx - b[0], gy - b[1], gz - b[2]
        first += len(face)
    first = 0
    while first < len(faces):
        face = face_from(faces, first)
        height, by_height, by_one, by_two = _lift_from(piece, shape, place, face)
        if height != 0.0:
            axis = int(face[0, AXIS])
            one, two = (axis + 1) % 3, (axis + 2) % 3
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            along, u, v = push * by_height, push * by_one, push * by_two
            nx, ny, nz = _normal(piece, face)
            dx, dy, dz = support(shape, -nx, -ny, -nz)
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
