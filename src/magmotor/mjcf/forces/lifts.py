"""Magnets and dipoles near flat faces of iron, and how far they are lifted for its nodes.

A row is that of `shaped_magnets.py`, also of a dipole. Lifts, and the forces here, are along the
axes of the piece; see `faces.py`.
"""

import math

from magmotor.mjcf.forces.faces import (
    AXIS,
    REACH,
    SHARP,
    SIDE,
    component,
    distance_of_nodes,
    face_from,
    faces_of,
    height_above,
    height_of_lift,
    inside,
    reaches,
    step,
)
from magmotor.mjcf.forces.iron_pieces import EXTENT, FRAME, POSITION
from magmotor.mjcf.forces.shape_distances import (
    reach_towards,
    squared_distance,
    thickness_of,
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
    farthest = piece[EXTENT] + (2.0 + REACH) * distance_of_nodes(faces)
    for k in range(len(rows)):
        row = rows[k]
        row[LIFT] = row[LIFT + 1] = row[LIFT + 2] = 0.0
        reach = farthest + 3.0 * row[RADIUS]
        if len(faces) == 0 or squared_distance(row, x, y, z) > reach * reach:
            continue
        first, place = 0, center_on_piece(piece, row)
        while first < len(faces):
            face = face_from(faces, first)
            height = _lift_from(piece, row, place, face)[0]
            if height != 0.0:
                share = share_of(piece, face, row)[0]
                row[LIFT + int(face[0, AXIS])] += face[0, SIDE] * share * height
            first += len(face)
        any_lifted = any_lifted or is_lifted(row)
    return any_lifted


@subroutine
def is_lifted(row):
    """Whether a magnet is lifted."""
    return row[LIFT] != 0.0 or row[LIFT + 1] != 0.0 or row[LIFT + 2] != 0.0


@subroutine
def add_to_row(row, lifted, sign, wrench):
    """Add a wrench in an image to that on a magnet; on a lifted one, keep the force as well."""
    for k in range(6):
        row[WRENCH + k] += sign * wrench[k]
    for k in range(3):
        row[PUSH + k] += lifted * sign * wrench[k]


@subroutine
def _gap(piece, face, row):
    """Return the height of a magnet's lowest point above the plane of a face, and that point.

    The point is relative to the magnet's center, along the axes of the piece.
    """
    height = height_above(face, center_on_piece(piece, row))
    if int(row[KIND]) == POINT:
        return height, 0.0, 0.0, 0.0
    nx, ny, nz = normal_of(piece, face)
    extent, x, y, z = reach_towards(row, -nx, -ny, -nz)
    return (height - extent, *to_piece(piece, x, y, z))


@subroutine
def share_of(piece, face, row):
    """Return the share of a face in the lift of a magnet, and its derivatives by place and turn.

    It is 1 but near a convex edge, where the magnet's lowest points are a little behind the planes
    of both faces. Their shares have the sum 1.
    """
    if int(row[KIND]) == POINT:
        return _share_of_point(piece, face, row)
    half = 0.5 * thickness_of(row)
    scale = 0.5 / (SHARP * half)
    gap, x, y, z = _gap(piece, face, row)
    own, more = _front(scale * gap)
    faces, place, first, total = faces_of(piece), center_on_piece(piece, row), 0, 0.0
    fx = fy = fz = tx = ty = tz = 0.0
    while first < len(faces):
        other = face_from(faces, first)
        first += len(other)
        above = height_above(other, place)
        if not _competes(face, other, above):
            continue
        # The opposite face comes in as it begins to lift.
        front, rise = step(above / half) if other[0, AXIS] == face[0, AXIS] else (1.0, 0.0)
        height, u, v, w = _gap(piece, other, row)
        level, slope = _front(scale * height)
        ratio = front * level / own
        total += ratio
        a = _by_plane(other, u, v, w, ratio * slope * scale)
        b = _by_plane(face, x, y, z, ratio * more * scale)
        c = _by_plane(other, 0.0, 0.0, 0.0, rise * level / (own * half))
        fx, fy, fz = fx + a[0] - b[0] + c[0], fy + a[1] - b[1] + c[1], fz + a[2] - b[2] + c[2]
        tx, ty, tz = tx + a[3] - b[3], ty + a[4] - b[4], tz + a[5] - b[5]
    share = 1.0 / (1.0 + total)
    factor = -share * share
    return (
        share, factor * fx, factor * fy, factor * fz, factor * tx, factor * ty, factor * tz
    )  # fmt: skip


@subroutine
def _share_of_point(piece, face, row):
    """Return the same for a dipole: h^4 of its height above a face, over the sum for all faces.

    The energy in its image grows as 1/h^3, so that nothing diverges where it passes the plane of a
    face that it is beside.
    """
    faces, place, first, total = faces_of(piece), center_on_piece(piece, row), 0, 1.0
    height = height_above(face, place)
    if height <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x = y = z = 0.0
    while first < len(faces):
        other = face_from(faces, first)
        first += len(other)
        above = height_above(other, place)
        if above > 0.0 and _competes(face, other, above):
            ratio = above / height
            cube = ratio * ratio * ratio
            total += cube * ratio
            a = _by_plane(other, 0.0, 0.0, 0.0, 4.0 * cube / height)
            b = _by_plane(face, 0.0, 0.0, 0.0, 4.0 * cube * ratio / height)
            x, y, z = x + a[0] - b[0], y + a[1] - b[1], z + a[2] - b[2]
    share = 1.0 / total
    factor = -share * share
    return share, factor * x, factor * y, factor * z, 0.0, 0.0, 0.0


@subroutine
def _front(x):
    """Return what goes from 0 behind a face, as 1/x^2, to 1 in front, and its relative slope."""
    root = math.sqrt(1.0 + x * x)
    return 0.5 / (root * (root - x)), (root - x) / (root * root)


@subroutine
def _by_plane(face, x, y, z, slope):
    """Return the derivatives, by place and turn, of a slope times the height of a lowest point."""
    axis, slope = int(face[0, AXIS]), face[0, SIDE] * slope
    nx, ny, nz = (slope if axis == 0 else 0.0), (slope if axis == 1 else 0.0), 0.0
    nz = slope if axis == 2 else 0.0
    return nx, ny, nz, y * nz - z * ny, z * nx - x * nz, x * ny - y * nx


@subroutine
def _competes(face, other, height):
    """Whether a magnet, with its center at a height above another face, may be above that instead.

    The two meet in a convex edge, or they are on opposite sides of the piece.
    """
    if other[0, AXIS] == face[0, AXIS]:
        return height > 0.0 and face[0, SIDE] * other[0, SIDE] < 0.0
    return reaches(face, other) and reaches(other, face)


@subroutine
def _lift_from(piece, row, place, face):
    """Return how far a face alone lifts a magnet, and the derivatives by its place and turn."""
    apart, nothing = distance_of_nodes(face), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    height, radius = height_above(face, place), (row[RADIUS] if row[RADIUS] > 0.0 else apart)
    if height <= 0.0 or height - row[RADIUS] > REACH * apart:
        return nothing
    beside, by_one, by_two = inside(face, place, radius)
    if beside == 0.0:
        return nothing
    # It is 1 for what lies on the face, and falls where the center sinks below the plane.
    front, rise, half = 1.0, 0.0, 0.5 * thickness_of(row)
    if half > 0.0:
        front, rise = step(height / half)
        rise /= half
    gap, x, y, z = _gap(piece, face, row)
    width = wx = wy = wz = 0.0
    if int(row[KIND]) != POINT:
        nx, ny, nz = normal_of(piece, face)
        width, wx, wy, wz = width_across(row, nx, ny, nz)
        wx, wy, wz = to_piece(piece, wx, wy, wz)
    lifted, by_gap, by_width = height_of_lift(apart, gap, width)
    a = _by_plane(face, x, y, z, front * beside * by_gap)
    b = _by_plane(face, wx, wy, wz, front * beside * by_width)
    c = _by_plane(face, 0.0, 0.0, 0.0, rise * beside * lifted)
    axis, u, v = int(face[0, AXIS]), front * lifted * by_one, front * lifted * by_two
    return (
        front * beside * lifted, component(axis, 0, a[0] + c[0], u, v),
        component(axis, 1, a[1] + c[1], u, v), component(axis, 2, a[2] + c[2], u, v),
        a[3] + b[3], a[4] + b[4], a[5] + b[5],
    )  # fmt: skip


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
    tx, ty, tz = row[WRENCH + 3], row[WRENCH + 4], row[WRENCH + 5]
    while first < len(faces):
        face = face_from(faces, first)
        height, ux, uy, uz, vx, vy, vz = _lift_from(piece, row, place, face)
        if height != 0.0:
            share, sx, sy, sz, rx, ry, rz = share_of(piece, face, row)
            axis = int(face[0, AXIS])
            along = face[0, SIDE] * (push[0] if axis == 0 else (push[1] if axis == 1 else push[2]))
            share, height = along * share, along * height
            fx, fy, fz = (
                fx + share * ux + height * sx, fy + share * uy + height * sy,
                fz + share * uz + height * sz,
            )  # fmt: skip
            tx, ty, tz = (
                tx + share * vx + height * rx, ty + share * vy + height * ry,
                tz + share * vz + height * rz,
            )  # fmt: skip
        first += len(face)
    force, torque = to_world(piece, fx, fy, fz), to_world(piece, tx, ty, tz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - torque[0], wrench[4] - torque[1], wrench[5] - torque[2],
    )  # fmt: skip
