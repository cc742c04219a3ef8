"""Flat faces of a piece of iron, and how far a magnet near one is lifted for the nodes.

The nodes of a piece resolve the field of a magnet that is about as far from them as they are from
each other. A nearer magnet is lifted for them, along the normal of the face that it is above. All
coordinates here are in the frame of the piece. A face consists of rectangles, or is a disk; see
`numerics/iron/nodes.py`.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.iron_pieces import RESPONSE
from magmotor.numerics.deferred import subroutine

AXIS, SIDE, HEIGHT, CENTER, HALF, APART, DEPTH, COLUMNS = 0, 1, 2, 3, 5, 7, 8, 9
"""Columns of a rectangle: the axis of its normal, and the sign of that; its height along the
normal; its center, and half of its edges, along the two next axes; the mean distance of its nodes;
the least distance from an opposite face; and how many columns there are. A disk has a radius and 0
instead of the edges."""

POINT, WIDE, WIDTH = 1.4, 0.35, 1.5
"""Heights that nodes resolve, over their distance: of a dipole, and of a wide magnet; half of its
width is about `WIDTH` of it or more. The field of a small magnet varies more."""

SOFT = 0.25
"""Half of the interval of heights in which the lift begins, over the height that nodes resolve."""

REACH = 1.0 + POINT * (1.0 + SOFT)
"""Distance from a face beyond which no magnet is lifted, apart from its own size, over that of
nodes."""

SUNK = 0.25
"""How far a magnet may sink into a face that it is above, over its thickness."""

EDGE = 0.5
"""Width in which images end at an edge, over the distance of nodes."""


@subroutine
def step(x):
    """Return a smooth step from 0 to 1 between x = 0 and 1, and its derivative."""
    if x <= 0.0:
        return 0.0, 0.0
    if x >= 1.0:
        return 1.0, 0.0
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


@subroutine
def faces_of(piece):
    """Return the rectangles of a piece, those of a face in a row."""
    address = int(piece[RESPONSE])
    words = memory.words(address, responses.START)
    return memory.numbers(address + 8 * words[responses.FACE], words[responses.FACES], COLUMNS)


@subroutine
def face_from(faces, first):
    """Return the rectangles in the plane of a first one."""
    end = first + 1
    while end < len(faces):
        same = True
        for k in range(CENTER):
            same = same and faces[end, k] == faces[first, k]
        if not same:
            break
        end += 1
    return faces[first:end]


@subroutine
def distance_of_nodes(face):
    """Return the largest mean distance of the nodes on the rectangles of a face."""
    apart = 0.0
    for k in range(len(face)):
        apart = max(apart, face[k, APART])
    return apart


@subroutine
def _along(x, half, start, width):
    """Return what is 1 over an interval around 0 and 0 beside it, and its derivative."""
    up, slope = step((x + half) / width + start)
    down, other = step((x - half) / width + 1.0 - start)
    return up - down, (slope - other) / width


@subroutine
def window(rectangle, place, start, width):
    """Return what is 1 over a rectangle and 0 beside it, and its derivatives along the next axes.

    It ends `start` widths outside of the edges. For half a width, the sum over rectangles beside
    each other is that of the whole.
    """
    axis = int(rectangle[AXIS])
    b = place[(axis + 1) % 3] - rectangle[CENTER]
    c = place[(axis + 2) % 3] - rectangle[CENTER + 1]
    if rectangle[HALF + 1] > 0.0:
        u, du = _along(b, rectangle[HALF], start, width)
        v, dv = _along(c, rectangle[HALF + 1], start, width)
        return u * v, du * v, u * dv
    distance = math.sqrt(b * b + c * c)
    u, du = step((rectangle[HALF] - distance) / width + start)
    slope = -du / (width * distance) if distance > 0.0 else 0.0
    return u, slope * b, slope * c


@subroutine
def _above(face, place, width):
    """Return what is 1 over any rectangle of a face and 0 a width beside all, and derivatives."""
    left, by_one, by_two = 1.0, 0.0, 0.0
    for k in range(len(face)):
        u, du, dv = window(face[k], place, 1.0, width)
        by_one, by_two = by_one * (1.0 - u) + left * du, by_two * (1.0 - u) + left * dv
        left *= 1.0 - u
    return 1.0 - left, by_one, by_two


@subroutine
def lift(face, place, size, extent, width):
    """Return how far a magnet is lifted along an axis, and the derivatives of that.

    The magnet has its center at `place`, a radius and, at its thinnest, a thickness, both of which
    are 0 for a dipole. It reaches `extent` towards the face, and has half a `width` along it. The
    derivatives are by its height, by the places of its center along the two next axes, and by
    its width. A magnet that reaches below the plane of a face, by more than contacts let it sink
    in, is beside the face.
    """
    radius, thickness = size
    distance = distance_of_nodes(face)
    resolved, by_width = _resolved_height(distance, width)
    gap = face[0, SIDE] * place[int(face[0, AXIS])] - face[0, HEIGHT] - extent
    half = SOFT * resolved
    short = resolved + half - gap
    sunk = SUNK * thickness if thickness > 0.0 else SUNK * min(distance, face[0, DEPTH])
    above, by_gap = step(1.0 + gap / sunk)
    if short <= 0.0 or above == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    inside, by_one, by_two = _above(face, place, radius if radius > 0.0 else distance)
    height, slope, by_resolved = short - half, 1.0, 1.0
    if short < 2.0 * half:
        ratio = short / (2.0 * half)
        height, slope, by_resolved = ratio * ratio * half, ratio, ratio + SOFT * ratio * (1 - ratio)
    by_height = inside * (by_gap * height / sunk - above * slope)
    scale = face[0, SIDE] * above
    height *= scale
    by_width *= scale * inside * by_resolved
    return inside * height, by_height, by_one * height, by_two * height, by_width


@subroutine
def _resolved_height(distance, width):
    """Return the height that nodes at a distance resolve for a magnet of a width, and its slope."""
    ratio = width / (WIDTH * distance)
    square = ratio * ratio
    root = math.sqrt(math.sqrt(1.0 + square * square))
    height = POINT * distance - (POINT - WIDE) * distance * ratio / root
    return height, (WIDE - POINT) / (WIDTH * root * (1.0 + square * square))


@subroutine
def weight_on(face, place):
    """Return the weight of a charge above a face, and its gradient.

    It is 1 above the face, also slightly below its plane, and 0 beside it and deeper.
    """
    width = EDGE * distance_of_nodes(face)
    weight, by_one, by_two = 0.0, 0.0, 0.0
    for number in range(len(face)):
        u, du, dv = window(face[number], place, 0.5, width)
        weight, by_one, by_two = weight + u, by_one + du, by_two + dv
    above, slope = in_front(face, place)
    axis = int(face[0, AXIS])
    along, by_one, by_two = weight * slope, above * by_one, above * by_two
    return (
        above * weight, component(axis, 0, along, by_one, by_two),
        component(axis, 1, along, by_one, by_two), component(axis, 2, along, by_one, by_two),
    )  # fmt: skip


@subroutine
def may_be_above(face, place, radius):
    """Whether anything within a radius of a place may have a weight above a face."""
    axis, margin = int(face[0, AXIS]), radius + EDGE * distance_of_nodes(face)
    if face[0, SIDE] * place[axis] - face[0, HEIGHT] < -margin:
        return False
    found = False
    for k in range(len(face)):
        half, other = face[k, HALF], face[k, HALF + 1]
        other = other if other > 0.0 else half
        b = abs(place[(axis + 1) % 3] - face[k, CENTER])
        c = abs(place[(axis + 2) % 3] - face[k, CENTER + 1])
        found = found or (b < half + margin and c < other + margin)
    return found


@subroutine
def in_front(face, place):
    """Return what is 1 in front of the plane of a face and 0 behind it, and its derivative.

    It is 0 on the other side of a thin sheet.
    """
    width, side = 0.5 * EDGE * min(distance_of_nodes(face), face[0, DEPTH]), face[0, SIDE]
    height = side * place[int(face[0, AXIS])] - face[0, HEIGHT]
    above, slope = step(2.0 + height / width)
    return above, side * slope / width


@subroutine
def component(axis, k, along, one, two):
    """Return component k of a vector given along an axis and the two next ones."""
    if k == axis:
        return along
    return one if k == (axis + 1) % 3 else two


@subroutine
def rises_above(face, other):
    """Whether a rectangle of a face is in front of the plane of another one."""
    axis = int(other[0, AXIS])
    after, found = (axis - int(face[0, AXIS]) - 1) % 3, False
    for k in range(len(face) if after < 2 else 0):
        found = found or other[0, SIDE] * face[k, CENTER + after] > other[0, HEIGHT]
    return found
