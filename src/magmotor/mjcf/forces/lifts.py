"""Magnets and dipoles near flat faces of iron, and how far they are lifted for its nodes.

A row is that of `shaped_magnets.py`, also of a dipole. Lifts, and the forces here, are along the
axes of the piece; see `faces.py`.
"""

import math

from magmotor.mjcf.forces.faces import (
    AXIS,
    REACH,
    SIDE,
    component,
    distance_of_nodes,
    face_from,
    faces_of,
    from_face,
    height_above,
    height_of_lift,
    slope_from_face,
)
from magmotor.mjcf.forces.iron_pieces import EXTENT, FRAME, POSITION
from magmotor.mjcf.forces.shape_distances import (
    reach_towards,
    squared_distance,
    width_across,
)
from magmotor.mjcf.forces.shaped_magnets import KIND, LIFT, POINT, PUSH, RADIUS, WRENCH
from magmotor.mjcf.forces.shaped_magnets import POSITION as POSITION_OF_SHAPE
from magmotor.numerics.deferred import subroutine


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
def center_on_piece(piece, row):
    """Return the center of a magnet in the frame of a piece."""
    p = POSITION_OF_SHAPE
    return place_on_piece(piece, row[p], row[p + 1], row[p + 2])


@subroutine
def normal_of(piece, face):
    """Return the outward normal of a face in the world."""
    side, axis = face[0, SIDE], FRAME + int(face[0, AXIS])
    return side * piece[axis], side * piece[axis + 3], side * piece[axis + 6]


@subroutine
def set_lifts(piece, rows):
    """Write how far magnets are lifted for the nodes of a piece; return whether any is."""
    any_lifted, x, y, z = False, piece[POSITION], piece[POSITION + 1], piece[POSITION + 2]
    faces = faces_of(piece)
    farthest = piece[EXTENT] + REACH * distance_of_nodes(faces)
    for k in range(len(rows)):
        row = rows[k]
        row[LIFT] = row[LIFT + 1] = row[LIFT + 2] = 0.0
        reach = farthest + row[RADIUS]
        if len(faces) == 0 or squared_distance(row, x, y, z) > reach * reach:
            continue
        first, place = 0, center_on_piece(piece, row)
        while first < len(faces):
            face = face_from(faces, first)
            _, (u, v, w), share, (height, _, _), _, _ = _lift_from(piece, row, place, face)
            row[LIFT] += share * height * u
            row[LIFT + 1] += share * height * v
            row[LIFT + 2] += share * height * w
            first += len(face)
        any_lifted = any_lifted or is_lifted(row)
    return any_lifted


@subroutine
def is_lifted(row):
    """Whether a magnet is lifted."""
    return row[LIFT] != 0.0 or row[LIFT + 1] != 0.0 or row[LIFT + 2] != 0.0


@subroutine
def _lift_from(piece, row, place, face):
    """Return how a magnet is lifted away from the nearest point of a face.

    These are the distance of its center from there, the direction, the share of the face, that is
    the squared cosine to the normal, and the height with its derivatives; and, in the world, the
    magnet's lowest point, and the gradient of its width by the direction. Two faces at a convex
    edge, which is the nearest point of both, have the sum of shares 1.
    """
    nothing, axis = (0.0, 0.0, 0.0), int(face[0, AXIS])
    apart, height, least = distance_of_nodes(face), height_above(face, place), row[RADIUS]
    one, two = from_face(face, place)
    distance = math.sqrt(one * one + two * two + height * height)
    if height <= 0.0 or distance - least > REACH * apart:
        return distance, nothing, 0.0, nothing, nothing, nothing
    cosine, one, two = height / distance, one / distance, two / distance
    along = face[0, SIDE] * cosine
    direction = (
        component(axis, 0, along, one, two), component(axis, 1, along, one, two),
        component(axis, 2, along, one, two),
    )  # fmt: skip
    if int(row[KIND]) == POINT:
        lifted = height_of_lift(apart, distance, 0.0)
        return distance, direction, cosine * cosine, lifted, nothing, nothing
    x, y, z = to_world(piece, direction[0], direction[1], direction[2])
    extent, px, py, pz = reach_towards(row, -x, -y, -z)
    width, wx, wy, wz = width_across(row, x, y, z)
    lifted = height_of_lift(apart, distance - extent, width)
    return distance, direction, cosine * cosine, lifted, (px, py, pz), (wx, wy, wz)


@subroutine
def wrench_of_lifted(piece, row, wrench):
    """Return the wrench on a piece from a magnet, given that on its nodes from the lifted one.

    Those of images are in the row, and are those on the magnet, which feels the opposite of what is
    returned; torques are about its center. The derivatives of the lift add to these.
    """
    faces, place, first = faces_of(piece), center_on_piece(piece, row), 0
    gx, gy, gz = to_piece(piece, wrench[0], wrench[1], wrench[2])
    push = row[PUSH] - gx, row[PUSH + 1] - gy, row[PUSH + 2] - gz
    fx, fy, fz = row[WRENCH], row[WRENCH + 1], row[WRENCH + 2]
    tx, ty, tz = to_world(piece, row[WRENCH + 3], row[WRENCH + 4], row[WRENCH + 5])
    while first < len(faces):
        face = face_from(faces, first)
        more = _wrench_by_lift(piece, row, place, face, push)
        fx, fy, fz = fx + more[0], fy + more[1], fz + more[2]
        tx, ty, tz = tx + more[3], ty + more[4], tz + more[5]
        first += len(face)
    force = to_world(piece, fx, fy, fz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - tx, wrench[4] - ty, wrench[5] - tz,
    )  # fmt: skip


@subroutine
def _wrench_by_lift(piece, row, place, face, push):
    """Return the derivatives of a push times the lift from a face, as a wrench on the magnet.

    The force is along the axes of the piece, the torque in the world. The lift is
    share * height(gap, width) * u, where u is the direction from the nearest point; the gap is the
    distance less the reach towards that point.
    """
    distance, (ux, uy, uz), share, lifted, lowest, by_width = _lift_from(piece, row, place, face)
    height, by_gap, slope = lifted
    if height == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    axis, side = int(face[0, AXIS]), face[0, SIDE]
    cosine = side * (ux if axis == 0 else (uy if axis == 1 else uz))
    along = push[0] * ux + push[1] * uy + push[2] * uz
    by_gap, slope = share * along * by_gap, share * along * slope
    # By turns of the direction: of the share, of the reach and the width, and of the lift itself.
    x, y, z = (
        by_gap * lowest[0] + slope * by_width[0], by_gap * lowest[1] + slope * by_width[1],
        by_gap * lowest[2] + slope * by_width[2],
    )  # fmt: skip
    ax, ay, az = to_piece(piece, x, y, z)
    lean, scale = 2.0 * cosine * height * along * side, share * height
    ax += scale * push[0] + (lean if axis == 0 else 0.0)
    ay += scale * push[1] + (lean if axis == 1 else 0.0)
    az += scale * push[2] + (lean if axis == 2 else 0.0)
    inner, inverse = ax * ux + ay * uy + az * uz, 1.0 / distance
    fx = by_gap * ux + inverse * (ax - inner * ux)
    fy = by_gap * uy + inverse * (ay - inner * uy)
    fz = by_gap * uz + inverse * (az - inner * uz)
    one, two = from_face(face, place)
    u = fy if axis == 0 else (fz if axis == 1 else fx)
    v = fz if axis == 0 else (fx if axis == 1 else fy)
    normal = fx if axis == 0 else (fy if axis == 1 else fz)
    u, v = slope_from_face(face, place, one, two, u, v)
    nx, ny, nz = to_world(piece, ux, uy, uz)
    return (
        component(axis, 0, normal, u, v), component(axis, 1, normal, u, v),
        component(axis, 2, normal, u, v), y * nz - z * ny, z * nx - x * nz, x * ny - y * nx,
    )  # fmt: skip
