"""Magnets and dipoles near flat faces of a piece of iron, and how far they are lifted for its nodes.

A row is that of `shaped_magnets.py`, also of a dipole. Lifts, and the forces here, are along the
axes of the piece; see `faces.py`.
"""

from magmotor.mjcf.forces.faces import (
    AXIS,
    REACH,
    SIDE,
    component,
    distance_of_nodes,
    face_from,
    faces_of,
    lift,
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
    farthest = piece[EXTENT] + REACH * distance_of_nodes(faces)
    for k in range(len(rows)):
        row = rows[k]
        row[LIFT] = row[LIFT + 1] = row[LIFT + 2] = 0.0
        reach = farthest + 2.0 * row[RADIUS]
        if len(faces) == 0 or squared_distance(row, x, y, z) > reach * reach:
            continue
        first, place = 0, center_on_piece(piece, row)
        while first < len(faces):
            face = face_from(faces, first)
            row[LIFT + int(face[0, AXIS])] += _lift_from(piece, row, place, face)[0][0]
            first += len(face)
        any_lifted = any_lifted or is_lifted(row)
    return any_lifted


@subroutine
def is_lifted(row):
    """Whether a magnet is lifted."""
    return row[LIFT] != 0.0 or row[LIFT + 1] != 0.0 or row[LIFT + 2] != 0.0


@subroutine
def _lift_from(piece, row, place, face):
    """Return the lift from a face with derivatives, its normal, the lowest point, and by width."""
    if int(row[KIND]) == POINT:
        nothing = 0.0, 0.0, 0.0
        return lift(face, place, (0.0, 0.0), 0.0, 0.0), nothing, nothing, nothing
    nx, ny, nz = normal_of(piece, face)
    extent, x, y, z = reach_towards(row, -nx, -ny, -nz)
    width, u, v, w = width_across(row, nx, ny, nz)
    lifted = lift(face, place, (row[RADIUS], thickness_of(row)), extent, width)
    return lifted, (nx, ny, nz), (x, y, z), (u, v, w)


@subroutine
def wrench_of_lifted(piece, row, wrench):
    """Return the wrench on a piece from a magnet, given that on its nodes from the lifted one.

    Those of images are in the row, and are those on the magnet, which feels the opposite of what is
    returned; torques are about its center. What a lift depends on adds to these: the height of the
    center, and that of the lowest point; the place above the face; and the width.
    """
    faces, place, first = faces_of(piece), center_on_piece(piece, row), 0
    gx, gy, gz = to_piece(piece, wrench[0], wrench[1], wrench[2])
    gx, gy, gz = row[PUSH] - gx, row[PUSH + 1] - gy, row[PUSH + 2] - gz
    fx, fy, fz = row[WRENCH], row[WRENCH + 1], row[WRENCH + 2]
    tx, ty, tz = to_world(piece, row[WRENCH + 3], row[WRENCH + 4], row[WRENCH + 5])
    while first < len(faces):
        face = face_from(faces, first)
        lifted, normal, lowest, by_normal = _lift_from(piece, row, place, face)
        if lifted[0] != 0.0:
            axis = int(face[0, AXIS])
            push = gx if axis == 0 else (gy if axis == 1 else gz)
            along, u, v = push * lifted[1], push * lifted[2], push * lifted[3]
            fx += component(axis, 0, along, u, v)
            fy += component(axis, 1, along, u, v)
            fz += component(axis, 2, along, u, v)
            # A turn moves the lowest point, and changes the width along the face.
            up, wide, (nx, ny, nz) = face[0, SIDE] * along, push * lifted[4], normal
            ax, ay, az = (
                up * lowest[0] + wide * by_normal[0], up * lowest[1] + wide * by_normal[1],
                up * lowest[2] + wide * by_normal[2],
            )  # fmt: skip
            tx, ty, tz = tx + ay * nz - az * ny, ty + az * nx - ax * nz, tz + ax * ny - ay * nx
        first += len(face)
    force = to_world(piece, fx, fy, fz)
    return (
        wrench[0] - force[0], wrench[1] - force[1], wrench[2] - force[2],
        wrench[3] - tx, wrench[4] - ty, wrench[5] - tz,
    )  # fmt: skip
