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
from magmotor.mjcf.forces.faces import EDGE, lift, window
from magmotor.mjcf.forces.iron_pieces import (
    DISTANCES,
    FRAME,
    LENGTHS,
    POSITION,
    SUSCEPTIBILITY,
)
from magmotor.mjcf.forces.mirror import mirrored, reflected
from magmotor.mjcf.forces.shape_distances import order_of_charges, support, thickness_of
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
def _normal(piece, axis, place):
    """Return the outward normal, in the world, of the face that a place is above."""
    side = math.copysign(1.0, place[axis])
    return (
        side * piece[FRAME + axis], side * piece[FRAME + 3 + axis], side * piece[FRAME + 6 + axis]
    )  # fmt: skip


@subroutine
def center_on_piece(piece, shape):
    """Return the center of a magnet in the frame of a piece."""
    p = POSITION_OF_SHAPE
    return place_on_piece(piece, shape[p], shape[p + 1], shape[p + 2])


@subroutine
def lift_of_shape(piece, shape):
    """Return how far a magnet is lifted for the nodes of a piece, along the axes of the piece."""
    place = center_on_piece(piece, shape)
    one = _lift_along(piece, shape, place, 0)[0]
    two = _lift_along(piece, shape, place, 1)[0]
    return one, two, _lift_along(piece, shape, place, 2)[0]


@subroutine
def _lift_along(piece, shape, place, axis):
    """Return the lift along an axis, and its derivatives."""
    nx, ny, nz = _normal(piece, axis, place)
    dx, dy, dz = support(shape, -nx, -ny, -nz)
    extent = -(nx * dx + ny * dy + nz * dz)
    return lift(piece, axis, place, extent, shape[RADIUS], thickness_of(shape))


@subroutine
def _set_images(piece, shape, place, axis, lifted, room):
    """Write the charges of a magnet, and where its own field is that of its image; return how many.

    The rows 0 to 2 are reflected places in the frame of the magnet, 3 are charges with the factor
    of the energy, but not with weights, and `PLACES` are their places in the frame of the piece.
    """
    chi = piece[SUSCEPTIBILITY]
    strength = chi / (chi + 2.0)
    nx, ny, nz = _normal(piece, axis, place)
    side = math.copysign(1.0, place[axis])
    top = side * piece[LENGTHS + axis]
    x, y, z = piece[POSITION], piece[POSITION + 1], piece[POSITION + 2]
    height = nx * x + ny * y + nz * z + piece[LENGTHS + axis] - side * lifted[axis]
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
def _weight(piece, axis, lifted, room, k):
    """Return the weight of a charge, and its derivatives along the two next axes."""
    place = (
        room[PLACES, k] + lifted[0], room[PLACES + 1, k] + lifted[1],
        room[PLACES + 2, k] + lifted[2],
    )  # fmt: skip
    return window(piece, axis, place, 0.5, EDGE * piece[DISTANCES + axis])


@subroutine
def _energy_of_image(piece, shape, place, axis, lifted, room):
    """Return the energy of a magnet, lifted or not, in its image in a face."""
    count = _set_images(piece, shape, place, axis, lifted, room)
    set_continued_potentials(room, count, shape)
    energy = 0.0
    for k in range(count):
        energy += _weight(piece, axis, lifted, room, k)[0] * room[3, k] * room[4, k]
    return energy


@subroutine
def _wrench_of_image(piece, shape, place, axis, lifted, room):
    """Return the force and torque on a magnet in its image, along the piece's axes.

    The torque is about the magnet's center. Each charge moves with the magnet, and so does the
    magnet's field at its image, which moves oppositely along the normal.
    """
    count = _set_images(piece, shape, place, axis, lifted, room)
    set_continued_potentials(room, count, shape)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    top = math.copysign(piece[LENGTHS + axis], place[axis])
    fn = fu = fv = tn = tu = tv = 0.0
    for k in range(count):
        weight, by_one, by_two = _weight(piece, axis, lifted, room, k)
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
    lifted = lift_of_shape(piece, shape)
    place, energy = center_on_piece(piece, shape), 0.0
    for axis in range(3):
        if lifted[axis] != 0.0:
            energy += _energy_of_image(piece, shape, place, axis, (0.0, 0.0, 0.0), room)
            energy -= _energy_of_image(piece, shape, place, axis, lifted, room)
    return energy


@subroutine
def lift_of_dipole(piece, target):
    """Return how far a dipole is lifted for the nodes of a piece, along the axes of the piece."""
    place = place_on_piece(piece, target[0], target[1], target[2])
    one = _lift_of_dipole(piece, place, 0)[0]
    two = _lift_of_dipole(piece, place, 1)[0]
    return one, two, _lift_of_dipole(piece, place, 2)[0]


@subroutine
def _lift_of_dipole(piece, place, axis):
    """Return the lift of a dipole along an axis, and its derivatives."""
    return lift(piece, axis, place, 0.0, 0.0, 0.0)


@subroutine
def _dipole_and_image(piece, target, axis, lifted):
    """Return the force, torque and energy of a dipole in its image, and the weight of that.

    The force and the torque are those at a weight of 1, along the axes of the piece. The weight has
    two derivatives, by the places along the two next axes.
    """
    x, y, z = place_on_piece(piece, target[0], target[1], target[2])
    mx, my, mz = to_piece(piece, target[3], target[4], target[5])
    x, y, z = x + lifted[0], y + lifted[1], z + lifted[2]
    place = x, y, z
    side = math.copysign(1.0, place[axis])
    nx, ny = (side if axis == 0 else 0.0), (side if axis == 1 else 0.0)
    nz = side if axis == 2 else 0.0
    chi = piece[SUSCEPTIBILITY]
    mirror = chi / (chi + 2.0), nx, ny, nz, piece[LENGTHS + axis]
    source = x, y, z, mx, my, mz
    found = dipole_at_dipole(mirrored(mirror, source), source)
    force = reflected(mirror, found[0], found[1], found[2])
    torque = reflected(mirror, found[3], found[4], found[5])
    k = mirror[0]
    weight = window(piece, axis, place, 0.5, EDGE * piece[DISTANCES + axis])
    return (
        -k * force[0], -k * force[1], -k * force[2], k * torque[0], k * torque[1], k * torque[2],
        -0.5 * k * found[6], weight[0], weight[1], weight[2],
    )  # fmt: skip


@subroutine
def dipole_image_energy(piece, target):
    """Return the energy by which images in faces differ from nodes, for a dipole near a piece."""
    lifted, energy = lift_of_dipole(piece, target), 0.0
    for axis in range(3):
        if lifted[axis] != 0.0:
            a = _dipole_and_image(piece, target, axis, (0.0, 0.0, 0.0))
            b = _dipole_and_image(piece, target, axis, lifted)
            energy += a[6] * a[7] - b[6] * b[7]
    return energy


@subroutine
def with_images_of_dipole(piece, target, wrench):
    """Return the wrench on a piece from a dipole, given that on its nodes from the lifted dipole.

    Torques are about the dipole, and the reaction on it is opposite.
    """
    lifted = lift_of_dipole(piece, target)
    place = place_on_piece(piece, target[0], target[1], target[2])
    gx, gy, gz = to_piece(piece, -wrench[0], -wrench[1], -wrench[2])
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        for sign in range(2 if lifted[axis] != 0.0 else 0):
            shift = lifted if sign == 1 else (0.0, 0.0, 0.0)
            a = _dipole_and_image(piece, target, axis, shift)
            factor = 1.0 - 2.0 * sign
            weight, u, v = factor * a[7], -factor * a[6] * a[8], -factor * a[6] * a[9]
            x = weight * a[0] + _component(axis, 0, 0.0, u, v)
            y = weight * a[1] + _component(axis, 1, 0.0, u, v)
            z = weight * a[2] + _component(axis, 2, 0.0, u, v)
            fx, fy, fz = fx + x, fy + y, fz + z
            tx, ty, tz = tx + weight * a[3], ty + weight * a[4], tz + weight * a[5]
            if sign == 1:
                gx, gy, gz = gx + x, gy + y, gz + z
    for axis in range(3):
        if lifted[axis] != 0.0:
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            _, by_height, by_one, by_two = _lift_of_dipole(piece, place, axis)
            along, u, v = push * by_height, push * by_one, push * by_two
            fx += _component(axis, 0, along, u, v)
            fy += _component(axis, 1, along, u, v)
            fz += _component(axis, 2, along, u, v)
    force, torque = to_world(piece, fx, fy, fz), to_world(piece, tx, ty, tz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - torque[0], wrench[4] - torque[1], wrench[5] - torque[2],
    )  # fmt: skip


@subroutine
def with_images(piece, shape, wrench, room):
    """Return the wrench on a piece from a magnet, given that on its nodes from the lifted magnet.

    Torques are about the center of the magnet, and the reaction on it is opposite.
    """
    lifted = lift_of_shape(piece, shape)
    place = center_on_piece(piece, shape)
    gx, gy, gz = to_piece(piece, -wrench[0], -wrench[1], -wrench[2])
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        if lifted[axis] != 0.0:
            a = _wrench_of_image(piece, shape, place, axis, (0.0, 0.0, 0.0), room)
            b = _wrench_of_image(piece, shape, place, axis, lifted, room)
            fx, fy, fz = fx + a[0] - b[0], fy + a[1] - b[1], fz + a[2] - b[2]
            tx, ty, tz = tx + a[3] - b[3], ty + a[4] - b[4], tz + a[5] - b[5]
            # What the lifted magnet would feel if it were moved alone.
            gx, gy, gz = gx - b[0], gy - b[1], gz - b[2]
    for axis in range(3):
        if lifted[axis] != 0.0:
            one, two = (axis + 1) % 3, (axis + 2) % 3
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            _, by_height, by_one, by_two = _lift_along(piece, shape, place, axis)
            along, u, v = push * by_height, push * by_one, push * by_two
            nx, ny, nz = _normal(piece, axis, place)
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
    force, torque = to_world(piece, fx, fy, fz), to_world(piece, tx, ty, tz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - torque[0], wrench[4] - torque[1], wrench[5] - torque[2],
    )  # fmt: skip
