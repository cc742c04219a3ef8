"""Sheets of iron that a magnet saturates: how much weaker the pull on them is.

The energy U of a piece in the field of magnets is between 0 and two others: L, that of its nodes
and of images in its faces, for iron that saturates only as a whole; and S, for a sheet that is
magnetized to saturation along the magnets' flux density B in its plane, and across it as an
infinite sheet would be,

    S = -int M_s |B_along| + B_across^2/(2 mu0) dV.

In between, finite elements agree with

    U = L f(S/L), where f(x) = 1 - (1 - x/4)^4 up to x = 4, and 1 beyond.

Thick iron is as without this, and the difference U - L adds to the energy. A sheet is what is
between a flat face and the opposite one, in the depth that the face knows; for the integral, see
`sheet_grids.py`.
"""

import math

from magmotor.mjcf.forces.faces import (
    AXIS,
    DEPTH,
    SIDE,
    component,
    face_from,
    faces_of,
    height_above,
    inside,
    step,
)
from magmotor.mjcf.forces.iron_answers import answer_magnets
from magmotor.mjcf.forces.iron_pieces import SATURATION
from magmotor.mjcf.forces.lifts import center_on_piece
from magmotor.mjcf.forces.shaped_magnets import (
    FADE,
    KIND,
    MOMENT,
    NEAR,
    POINT,
    PUSH,
    RADIUS,
    SHEET,
    THREADED,
    WELD,
    WRENCH,
)
from magmotor.mjcf.forces.sheet_grids import add_grid
from magmotor.mjcf.forces.threaded_iron import WIDE
from magmotor.numerics.deferred import subroutine

LARGEST = 4.0
"""S/L from which on iron is thick."""

THIN, FARTHEST = 0.125, 0.08
"""The cube of the thickness over m/M_s, where m is the sum of the moments on a rigid body, from
which on they saturate no sheet; and the squared gap over that volume over the thickness: S/L is 8
for a dipole at this distance."""


@subroutine
def blend(piece, own, rows, room, images, wanted):
    """Return by what the charges and images of a piece count, and its sheets; and U - L.

    `images` is the energy of those. The factors are the derivatives of U by L and S. Unless the
    energy is `wanted`, the wrenches of sheets without their factor are written to the magnets, and
    the charges of the piece in the field of magnets alone to its nodes.
    """
    full = _add_sheets(piece, rows, room, wanted) if piece[SATURATION] > 0.0 else 0.0
    if full == 0.0:
        return 1.0, 0.0, 0.0
    linear = images + answer_magnets(piece, own, room)
    if not full > LARGEST * linear:
        return 1.0, 0.0, 0.0
    ratio = full / linear
    rest = 1.0 - ratio / LARGEST
    slope = rest * rest * rest
    return 1.0 - rest * slope - ratio * slope, slope, -rest * slope * linear


@subroutine
def saturate(piece, own, rows, room, images):
    """Let saturation change the wrenches of images; return by what the charges of a piece count.

    These charges are those in the field of magnets alone.
    """
    kept, by_sheets, change = blend(piece, own, rows, room, images, False)
    for k in range(len(rows) if change != 0.0 else 0):
        for i in range(WRENCH, PUSH + 3):
            rows[k, i] *= kept
        for i in range(6):
            rows[k, WRENCH + i] += by_sheets * rows[k, SHEET + i]
    return kept


@subroutine
def _add_sheets(piece, rows, room, wanted):
    """Return the energy S of all sheets; write their wrenches unless it is `wanted`.

    Pieces in the bore of a coil are no sheets.
    """
    for k in range(len(rows)):
        if rows[k, THREADED] != WIDE:
            return 0.0
        for i in range(6):
            rows[k, SHEET + i] = 0.0
    faces, energy, first, largest = faces_of(piece), 0.0, 0, _volume(piece, rows, -1)
    while first < len(faces):
        face = face_from(faces, first)
        first += len(face)
        if face[0, SIDE] < 0.0 or not _is_thin(face, largest):  # the other side of a sheet, or none
            continue
        count = 0
        for k in range(len(rows)):
            rows[k, FADE], rows[k, NEAR] = 0.0, _nearness(piece, face, rows, k)[0]
            count += rows[k, NEAR] > 0.0
        for k in range(len(rows) if count > 0 else 0):
            if rows[k, NEAR] > 0.0:
                energy += add_grid(piece, face, rows, k, count > 1, room, wanted)
        for k in range(len(rows)):
            if rows[k, FADE] != 0.0:
                slopes = _nearness(piece, face, rows, k)
                for i in range(3):
                    rows[k, SHEET + i] -= rows[k, FADE] * slopes[1 + i]
    return energy


@subroutine
def _volume(piece, rows, own):
    """Return the volume of saturated iron with all moments, or with those on the body of one."""
    total = 0.0
    for k in range(len(rows)):
        if int(rows[k, KIND]) != POINT and (own < 0 or rows[k, WELD] == rows[own, WELD]):
            x, y, z = rows[k, MOMENT], rows[k, MOMENT + 1], rows[k, MOMENT + 2]
            total += math.sqrt(x * x + y * y + z * z)
    return total / piece[SATURATION]


@subroutine
def _is_thin(face, volume):
    """Whether a sheet is so thin that magnets may saturate it."""
    return face[0, DEPTH] * face[0, DEPTH] * face[0, DEPTH] < THIN * volume


@subroutine
def _nearness(piece, face, rows, own):
    """Return what is 1 for a magnet near a sheet and 0 for a far one, and its gradient."""
    row, thick, nothing = rows[own], face[0, DEPTH], (0.0, 0.0, 0.0, 0.0)
    volume = _volume(piece, rows, own)
    if int(row[KIND]) == POINT or not _is_thin(face, volume):
        return nothing
    place, reach = center_on_piece(piece, row), math.sqrt(FARTHEST * volume / thick)
    height = height_above(face, place) + 0.5 * thick
    gap = abs(height) - 0.5 * thick - row[RADIUS]
    near, slope = step(3.0 - 2.0 * gap / reach)
    if near == 0.0:
        return nothing
    beside, one, two = inside(face, place, row[RADIUS])
    axis, along = int(face[0, AXIS]), math.copysign(2.0 * slope * beside / reach, -height)
    one, two = near * one, near * two
    return (
        near * beside, component(axis, 0, along, one, two),
        component(axis, 1, along, one, two), component(axis, 2, along, one, two),
    )  # fmt: skip
