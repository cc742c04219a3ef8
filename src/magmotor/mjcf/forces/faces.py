"""Flat faces of a piece of iron, and how far a magnet near one is lifted for the nodes.

The nodes of a piece resolve the field of a magnet that is about as far from them as they are from
each other. A nearer magnet is lifted for them, along the normal of the face that it is above. All
coordinates here are in the frame of the piece, and a face is given by the axis of its normal.
"""

import math

from magmotor.mjcf.declarations.iron import BOX
from magmotor.mjcf.forces.iron_pieces import DISTANCES, KIND, LENGTHS
from magmotor.numerics.deferred import subroutine

SOFT = 0.25
"""Half of the interval of heights in which the lift begins, over the height that nodes resolve."""

SUNK = 0.25
"""How far a magnet may sink into a face that it is above, over its thickness."""

EDGE = 0.5
"""Width in which the image ends at an edge, over the distance of nodes."""

POINT, WIDE, WIDTH = 1.4, 0.35, 1.5
"""Heights that nodes resolve, over their distance: of a dipole, and of a magnet whose radius is
`WIDTH` of it, since the field of a small magnet varies more."""


@subroutine
def step(x):
    """Return a smooth step from 0 to 1 between x = 0 and 1, and its derivative."""
    if x <= 0.0:
        return 0.0, 0.0
    if x >= 1.0:
        return 1.0, 0.0
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


@subroutine
def window(piece, axis, place, start, width):
    """Return what is 1 over a face and 0 beside it, and its derivatives along the two next axes.

    It ends `start` widths outside of the edges.
    """
    one, two = (axis + 1) % 3, (axis + 2) % 3
    b, c = place[one], place[two]
    if int(piece[KIND]) == BOX:
        u, du = step((piece[LENGTHS + one] - abs(b)) / width + start)
        v, dv = step((piece[LENGTHS + two] - abs(c)) / width + start)
        db, dc = -math.copysign(du / width, b), -math.copysign(dv / width, c)
        return u * v, db * v, u * dc
    distance = math.sqrt(b * b + c * c)
    u, du = step((piece[LENGTHS + one] - distance) / width + start)
    slope = -du / (width * distance) if distance > 0.0 else 0.0
    return u, slope * b, slope * c


@subroutine
def lift(piece, axis, place, extent, radius, thickness):
    """Return how far a magnet is lifted along an axis, and the derivatives of that.

    The magnet has its center at `place`, reaches `extent` towards the face, and has a `radius` and,
    at its thinnest, a `thickness`; they are 0 for a dipole. The derivatives are by its height, and
    by the places of its center along the two next axes. A magnet that reaches below the plane of a
    face, by more than contacts let it sink in, is beside the face.
    """
    distance = piece[DISTANCES + axis]
    if distance == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    resolved = POINT * distance - (POINT - WIDE) * min(distance, radius / WIDTH)
    side = math.copysign(1.0, place[axis])
    gap = side * place[axis] - piece[LENGTHS + axis] - extent
    half = SOFT * resolved
    short = resolved + half - gap
    sunk = SUNK * (thickness if thickness > 0.0 else distance)
    above, by_gap = step(1.0 + gap / sunk)
    if short <= 0.0 or above == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    inside, by_one, by_two = window(piece, axis, place, 1.0, radius if radius > 0.0 else distance)
    height, slope = short - half, 1.0
    if short < 2.0 * half:
        height, slope = short * short / (4.0 * half), short / (2.0 * half)
    by_height = inside * (by_gap * height / sunk - above * slope)
    height *= side * above
    return inside * height, by_height, by_one * height, by_two * height
