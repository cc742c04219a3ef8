"""Magnets near a flat face of iron: their images in the face, for what nodes do not resolve.

Magnets near a face are lifted for the nodes; see `faces.py`. Their energy at the true places
differs by that in one another's images in the plane of the face, which are exact for a wide one:

    U = U_nodes(lifted) + U_images - U_images(lifted).

A charge q_i of magnet a in the image of magnet b contributes -k w_i q_i phi_b(x_i')/mu0, and half
of that in its own image. Here, phi_b is the potential of magnet b itself, x_i' the reflected place,
k = chi/(chi + 2), and the weight w_i is 1 above the face, falls beside it as the exact solution for
a wedge says, and is 0 behind it. In an inner corner of two faces, there is the image of both
images, too, with k^2 instead of -k. All is times s = 2 s_a s_b/(s_a + s_b), where s_a and s_b are
the shares of the face in the lifts. What this lacks at a convex edge is in `edges.py`, but for two
dipoles, for which s^(3/2) makes up for some of it. All forces are derivatives of U, including those
of the weights, and, in `lifts.py`, those of the lifts.

A dipole is two opposite charges near each other, and so is a magnet that is far from the image.
"""

import math

from magmotor.mjcf.forces.charges import PLACES, set_charges, set_dipole
from magmotor.mjcf.forces.edges import LEVEL, add_edges
from magmotor.mjcf.forces.faces import (
    AXIS,
    CENTER,
    FREE,
    HALF,
    HEIGHT,
    SEAM,
    SIDE,
    distance_of_nodes,
    face_from,
    faces_of,
    height_above,
    rises_above,
    weight_on,
)
from magmotor.mjcf.forces.iron_pieces import POSITION, SUSCEPTIBILITY
from magmotor.mjcf.forces.lifts import (
    add_to_row,
    center_on_piece,
    is_lifted,
    normal_of,
    place_on_piece,
    share_of,
    to_piece,
    to_world,
)
from magmotor.mjcf.forces.shape_distances import is_near, order_of_charges, reach_of
from magmotor.mjcf.forces.shape_fields import (
    set_continued_fields,
    set_continued_potentials,
    set_dipole_fields,
    set_dipole_potentials,
)
from magmotor.mjcf.forces.shaped_magnets import (
    KIND,
    LIFT,
    POINT,
    PUSH,
    RADIUS,
    SPREAD,
    THREADED,
    WRENCH,
    dipole_of,
    in_frame,
    in_world,
)
from magmotor.mjcf.forces.threaded_iron import WIDE
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

APART = 0.1
"""The charges of a dipole are for a size of this times the distance of nodes; see `set_dipole`."""


@subroutine
def clear_wrenches(rows):
    """Set the wrenches of images on magnets to zero."""
    for k in range(len(rows)):
        for i in range(WRENCH, PUSH + 3):
            rows[k, i] = 0.0


@subroutine
def add_images(piece, rows, first_probe, room, wanted):
    """Add the wrenches of images on magnets near a piece to their rows, and return the energy.

    The lifts are known; see `lifts.set_lifts`. There are no wrenches if the energy is `wanted`. If
    `first_probe` is not 0, only the energy of later rows in the images of earlier ones counts.
    """
    faces, energy, first = faces_of(piece), 0.0, 0
    while first < len(faces):
        one, second = face_from(faces, first), first
        while second < len(faces):
            two = face_from(faces, second)
            if first == second or (rises_above(one, two) and rises_above(two, one)):
                energy += _add_images_in(piece, one, two, rows, first_probe, room, wanted)
            second += len(two)
        first += len(one)
    return energy


@subroutine
def _add_images_in(piece, one, two, rows, first_probe, room, wanted):
    """Do so for the images in a face, if both are the same, or in the inner corner of two."""
    energy = 0.0
    for i in range(first_probe, len(rows)):
        for j in range(first_probe if first_probe > 0 else i + 1):
            if rows[i, THREADED] != WIDE or rows[j, THREADED] != WIDE:
                continue
            if not (is_lifted(rows[i]) or is_lifted(rows[j])):
                continue
            # The field of the larger one varies less.
            swap = rows[j, RADIUS] < rows[i, RADIUS]
            row, other = (rows[j], rows[i]) if swap else (rows[i], rows[j])
            if _may_be_in_front(piece, one, row) and _may_be_in_front(piece, two, row):
                energy += _add_pair(piece, (one, two), row, other, i == j, room, wanted)
    return energy


@subroutine
def _may_be_in_front(piece, face, row):
    """Whether charges of a magnet, lifted or not, may be in front of a face."""
    size = row[RADIUS] + abs(row[LIFT]) + abs(row[LIFT + 1]) + abs(row[LIFT + 2])
    highest = height_above(face, center_on_piece(piece, row)) + size
    return highest > -SEAM * distance_of_nodes(face)


@subroutine
def _add_pair(piece, faces, row, other, same, room, wanted):
    """Add the wrenches of two magnets in each other's images, or return the energy."""
    own = dipole_of(row)
    if own[3] == 0.0 and own[4] == 0.0 and own[5] == 0.0:
        return 0.0
    x, y, z = center_on_piece(piece, row)
    u, v, w = _reflected(_reflection(faces), x, y, z)
    dx, dy, dz = to_world(piece, u - x, v - y, w - z)
    x, y, z = own[0] + dx, own[1] + dy, own[2] + dz
    shaped = int(other[KIND]) != POINT
    shaped = shaped and (same or is_near(other, x, y, z, reach_of(row), row[SPREAD]))
    share = _shares(piece, faces, row)
    part = share if same else _shares(piece, faces, other)
    if share[0] * part[0] == 0.0:
        return 0.0
    both = share[0] + part[0]
    factor, power, energy = 2.0 * share[0] * part[0] / both, 1.0 / both, 0.0
    points = int(row[KIND]) == POINT and int(other[KIND]) == POINT
    if points:
        factor, power = factor * math.sqrt(factor), 1.5 / both
    for lifted in range(2):
        sign = (1.0 - 2.0 * lifted) * factor
        count = _set_charges(piece, faces, row, other, same, lifted, shaped, room)
        if shaped:
            set_continued_potentials(room, count, other)
        else:
            set_dipole_potentials(room, count, dipole_of(other))
        energy += sign * _add_weights(piece, faces, row, lifted, sign, room, count, wanted)
        if not wanted:
            _set_fields(piece, other, shaped, room, count)
            _add_forces(piece, faces, row, other, lifted, sign, room, count)
    if not points and faces[0][0, AXIS] == faces[1][0, AXIS]:
        pair = row, other, same, shaped
        energy += add_edges(piece, faces[0], pair, factor, room, wanted)
    if not wanted:
        add_to_row(row, 0, -power * energy * part[0] / share[0], share[1:])
        add_to_row(other, 0, -power * energy * share[0] / part[0], part[1:])
    return energy


@subroutine
def _shares(piece, faces, row):
    """Return the share of a face in the lift of a magnet, or the product for two, and slopes."""
    one, two = faces
    p = share_of(piece, one, row)
    if one[0, AXIS] == two[0, AXIS]:
        return p
    q = share_of(piece, two, row)
    a, b = p[0], q[0]
    return (
        a * b, a * q[1] + b * p[1], a * q[2] + b * p[2], a * q[3] + b * p[3],
        a * q[4] + b * p[4], a * q[5] + b * p[5], a * q[6] + b * p[6],
    )  # fmt: skip


@subroutine
def _reflection(faces):
    """Return the signs of what reflects in one face, or in two if they differ, and the planes."""
    one, two = faces
    a, b = int(one[0, AXIS]), int(two[0, AXIS])
    top, other = one[0, SIDE] * one[0, HEIGHT], two[0, SIDE] * two[0, HEIGHT]
    signs = (
        -1.0 if a == 0 or b == 0 else 1.0, -1.0 if a == 1 or b == 1 else 1.0,
        -1.0 if a == 2 or b == 2 else 1.0,
    )  # fmt: skip
    return signs, (top if a == 0 else other, top if a == 1 else other, top if a == 2 else other)


@subroutine
def _reflected(reflection, x, y, z):
    """Return a reflected place, on a piece."""
    (sx, sy, sz), (u, v, w) = reflection
    return sx * x + (1.0 - sx) * u, sy * y + (1.0 - sy) * v, sz * z + (1.0 - sz) * w


@subroutine
def _set_charges(piece, faces, row, other, same, lifted, shaped, room):
    """Write the charges of a magnet, and where the other's field is that of its image there.

    The rows 0 to 2 are reflected places in the frame of the other magnet, or in the world's for a
    dipole; 3 are charges with the factor of the energy, but not with weights; and `PLACES` are
    their places in the frame of the piece. Returns how many there are.
    """
    one, two = faces
    strength = piece[SUSCEPTIBILITY] / (piece[SUSCEPTIBILITY] + 2.0)
    factor = -strength if one[0, AXIS] == two[0, AXIS] else strength * strength
    factor *= (0.5 if same else 1.0) / VACUUM_PERMEABILITY
    a, b, c = lifted * row[LIFT], lifted * row[LIFT + 1], lifted * row[LIFT + 2]
    if shaped and int(row[KIND]) != POINT:
        nx, ny, nz = normal_of(piece, one)
        x, y, z, axis = piece[POSITION], piece[POSITION + 1], piece[POSITION + 2], int(one[0, AXIS])
        height = 0.5 * lifted * one[0, SIDE] * (row[LIFT + axis] + other[LIFT + axis])
        height = one[0, HEIGHT] - height + nx * x + ny * y + nz * z
        level = order_of_charges(row, other, (1.0, nx, ny, nz, height))
        place = center_on_piece(piece, row)
        if _is_near_edge(one, place, row[RADIUS]) or _is_near_edge(two, place, row[RADIUS]):
            level = LEVEL
        count = set_charges(room, row, level)
    else:
        count = set_dipole(room, dipole_of(row), APART * distance_of_nodes(one))
    reflection = _reflection(faces)
    for k in range(count):
        x, y, z = place_on_piece(piece, room[0, k], room[1, k], room[2, k])
        room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k] = x + a, y + b, z + c
        u, v, w = _seen_from(other, lifted, _reflected(reflection, x + a, y + b, z + c))
        dx, dy, dz = to_world(piece, u - x, v - y, w - z)
        x, y, z = room[0, k] + dx, room[1, k] + dy, room[2, k] + dz
        if shaped:
            x, y, z = in_frame(other, x, y, z)
        room[0, k], room[1, k], room[2, k], room[3, k] = x, y, z, factor * room[3, k]
    return count


@subroutine
def _is_near_edge(face, place, radius):
    """Whether weights of a magnet's charges vary at a free edge of a face, or beyond it."""
    axis, near = int(face[0, AXIS]), False
    size = radius + abs(height_above(face, place))
    for k in range(len(face)):
        for number in range(4 if face[k, HALF + 1] > 0.0 else 0):
            along, sign = number // 2, 2.0 * (number % 2) - 1.0
            beyond = sign * (place[(axis + 1 + along) % 3] - face[k, CENTER + along])
            free = face[k, FREE + number] != 0.0
            near = near or (free and beyond - face[k, HALF + along] > -size)
        if face[k, HALF + 1] == 0.0 and face[k, FREE] != 0.0:
            b = place[(axis + 1) % 3] - face[k, CENTER]
            c = place[(axis + 2) % 3] - face[k, CENTER + 1]
            near = near or math.sqrt(b * b + c * c) - face[k, HALF] > -size
    return near


@subroutine
def _seen_from(row, lifted, place):
    """Return where a place is relative to a magnet that is lifted, if this one were not."""
    x, y, z = place
    return x - lifted * row[LIFT], y - lifted * row[LIFT + 1], z - lifted * row[LIFT + 2]


@subroutine
def _weight_at(faces, place, radius):
    """Return the weight of a charge above one face, or two if they differ, and its gradient."""
    one, two = faces
    u, ux, uy, uz = weight_on(one, place, radius)
    if one[0, AXIS] == two[0, AXIS]:
        return u, ux, uy, uz
    v, vx, vy, vz = weight_on(two, place, radius)
    return u * v, u * vx + v * ux, u * vy + v * uy, u * vz + v * uz


@subroutine
def _add_weights(piece, faces, row, lifted, sign, room, count, wanted):
    """Multiply charges by weights; return the energy, or add the forces due to the weights."""
    x, y, z = center_on_piece(piece, row)
    x, y, z = x + lifted * row[LIFT], y + lifted * row[LIFT + 1], z + lifted * row[LIFT + 2]
    energy = fx = fy = fz = tx = ty = tz = 0.0
    for k in range(count):
        a, b, c = room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k]
        weight, gx, gy, gz = _weight_at(faces, (a, b, c), row[RADIUS])
        part = room[3, k] * room[4, k]
        energy += weight * part
        room[3, k] *= weight
        a, b, c = a - x, b - y, c - z
        gx, gy, gz = -part * gx, -part * gy, -part * gz
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + b * gz - c * gy, ty + c * gx - a * gz, tz + a * gy - b * gx
    if not wanted:
        add_to_row(row, lifted, sign, (fx, fy, fz, tx, ty, tz))
    return energy


@subroutine
def _set_fields(piece, other, shaped, room, count):
    """Write the fields of a magnet, or of its dipole, along the axes of the piece."""
    if shaped:
        set_continued_fields(room, count, other)
    else:
        set_dipole_fields(room, count, dipole_of(other))
    for k in range(count):
        h = room[4, k], room[5, k], room[6, k]
        if shaped:
            h = in_world(other, h[0], h[1], h[2])
        room[4, k], room[5, k], room[6, k] = to_piece(piece, h[0], h[1], h[2])


@subroutine
def _add_forces(piece, faces, row, other, lifted, sign, room, count):
    """Add the wrenches of fields on charges, and those on the other magnet, whose image they feel.

    The force at a charge is reflected, and the opposite of it acts where the charge is reflected.
    """
    reflection = _reflection(faces)
    sx, sy, sz = reflection[0]
    x, y, z = center_on_piece(piece, row)
    x, y, z = x + lifted * row[LIFT], y + lifted * row[LIFT + 1], z + lifted * row[LIFT + 2]
    u, v, w = center_on_piece(piece, other)
    fx = fy = fz = tx = ty = tz = gx = gy = gz = 0.0
    sum_x = sum_y = sum_z = 0.0
    for k in range(count):
        a, b, c = room[PLACES, k], room[PLACES + 1, k], room[PLACES + 2, k]
        p, q, r = _seen_from(other, lifted, _reflected(reflection, a, b, c))
        a, b, c, p, q, r = a - x, b - y, c - z, p - u, q - v, r - w
        charge = room[3, k]
        hx, hy, hz = charge * room[4, k], charge * room[5, k], charge * room[6, k]
        sum_x, sum_y, sum_z = sum_x - hx, sum_y - hy, sum_z - hz
        gx, gy, gz = gx - (q * hz - r * hy), gy - (r * hx - p * hz), gz - (p * hy - q * hx)
        hx, hy, hz = sx * hx, sy * hy, sz * hz
        fx, fy, fz = fx + hx, fy + hy, fz + hz
        tx, ty, tz = tx + b * hz - c * hy, ty + c * hx - a * hz, tz + a * hy - b * hx
    add_to_row(row, lifted, sign, (fx, fy, fz, tx, ty, tz))
    add_to_row(other, lifted, sign, (sum_x, sum_y, sum_z, gx, gy, gz))
