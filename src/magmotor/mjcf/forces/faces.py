"""Flat faces of a piece of iron: how high a magnet is lifted above one, and weights of images.

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

AXIS, SIDE, HEIGHT, CENTER, HALF, FREE, APART, DEPTH, COLUMNS = 0, 1, 2, 3, 5, 7, 11, 12, 13
"""Columns of a rectangle: the axis of its normal, and the sign of that; its height along the
normal; along the two next axes, its center, half of its edges, and whether the piece ends at the
lower and the upper one; the mean distance of its nodes, or less if it is narrow; the least
distance from an opposite face; and how many columns there are. A disk has a radius and 0 instead of
the edges."""

POINT, WIDE, WIDTH = 1.4, 0.35, 1.5
"""Heights that nodes resolve, over their distance: of a dipole, and of a wide magnet; half of its
width is about `WIDTH` of it or more. The field of a small magnet varies more."""

SOFT = 0.25
"""Half of the interval of heights in which the lift begins, over the height that nodes resolve."""

SHARP = 0.2
"""Height of a lowest point above a face, over the thickness of a magnet, where it is well in
front."""

REACH = POINT * (1.0 + SOFT)
"""Gap to a face beyond which no magnet is lifted, over the distance of nodes."""

SEAM = 0.5
"""Width in which images go from one rectangle to the next, over the distance of nodes."""

BLUNT, ROUND = 0.1, 0.1
"""How far the edges of a piece are rounded, over the distance of nodes, and over the radius of a
magnet, whose charges are points."""

CLOSED = 1e-6
"""How far the ends of two faces may be apart where they meet, over the distance of nodes."""

NOT_FREE = 0.0, 0.0
"""A height, and how far edges are rounded, with which no edge counts as free."""

WEDGE = 0.563
"""Number in the weight at an edge, by which charges near a wedge of 90 degrees have the energy of
the exact solution to 4 %."""


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
    """Return the largest distance of the nodes on the rectangles of a face."""
    apart = 0.0
    for k in range(len(face)):
        apart = max(apart, face[k, APART])
    return apart


@subroutine
def height_above(face, place):
    """Return the height of a place above the plane of a face."""
    return face[0, SIDE] * place[int(face[0, AXIS])] - face[0, HEIGHT]


@subroutine
def inside(face, place, radius):
    """Return what is 1 above a face and falls to 0 from one to two radii beside it, and its slopes.

    These are the derivatives by the places along the two next axes. The distance from the nearest
    rectangle counts.
    """
    axis, least = int(face[0, AXIS]), math.inf
    one = two = 0.0
    for k in range(len(face)):
        b = place[(axis + 1) % 3] - face[k, CENTER]
        c = place[(axis + 2) % 3] - face[k, CENTER + 1]
        if face[k, HALF + 1] > 0.0:
            b -= max(-face[k, HALF], min(face[k, HALF], b))
            c -= max(-face[k, HALF + 1], min(face[k, HALF + 1], c))
            square = b * b + c * c
        else:
            disk = max(0.0, math.sqrt(b * b + c * c) - face[k, HALF])
            square = disk * disk
        if square < least:
            least, one, two = square, b, c
    if least == 0.0:
        return 1.0, 0.0, 0.0
    beside, slope = step(2.0 - math.sqrt(least) / radius)
    slope = -slope / (radius * math.sqrt(one * one + two * two))
    return beside, slope * one, slope * two


@subroutine
def height_of_lift(distance, gap, width):
    """Return how far a magnet is lifted at a gap, and the derivatives by the gap and the width.

    The magnet has half a `width` along the face, whose nodes have a mean distance; for a dipole,
    it is 0.
    """
    ratio = width / (WIDTH * distance)
    square = ratio * ratio
    root = math.sqrt(math.sqrt(1.0 + square * square))
    resolved = POINT * distance - (POINT - WIDE) * distance * ratio / root
    by_width = (WIDE - POINT) / (WIDTH * root * (1.0 + square * square))
    half = SOFT * resolved
    short = resolved + half - gap
    if short <= 0.0:
        return 0.0, 0.0, 0.0
    if short >= 2.0 * half:
        return short - half, -1.0, by_width
    ratio = short / (2.0 * half)
    return ratio * ratio * half, -ratio, by_width * ratio * (1.0 + SOFT * (1.0 - ratio))


@subroutine
def weight_on(face, place, radius):
    """Return the weight of a charge of a magnet above a face, and its gradient.

    It is 1 above the middle of the face, also slightly below its plane, and falls beside it and
    deeper.
    """
    distance, height = distance_of_nodes(face), max(height_above(face, place), 0.0)
    blunt = BLUNT * distance + ROUND * radius
    weight = by_one = by_two = by_height = 0.0
    for k in range(len(face)):
        u, du, dv, dh = _window(face[k], place, SEAM * distance, (height, blunt))
        weight, by_one, by_two, by_height = weight + u, by_one + du, by_two + dv, by_height + dh
    above, slope = in_front(face, place)
    axis = int(face[0, AXIS])
    along = weight * slope + above * by_height * face[0, SIDE]
    by_one, by_two = above * by_one, above * by_two
    return (
        above * weight, component(axis, 0, along, by_one, by_two),
        component(axis, 1, along, by_one, by_two), component(axis, 2, along, by_one, by_two),
    )  # fmt: skip


@subroutine
def cover(face, one, two, width):
    """Return what is 1 on a face and falls to 0 beside it within a width, and its slopes.

    The place is given along the two next axes.
    """
    axis, total, by_one, by_two = int(face[0, AXIS]), 0.0, 0.0, 0.0
    place = (
        component(axis, 0, 0.0, one, two), component(axis, 1, 0.0, one, two),
        component(axis, 2, 0.0, one, two),
    )  # fmt: skip
    for k in range(len(face)):
        u, du, dv, _ = _window(face[k], place, width, NOT_FREE)
        total, by_one, by_two = total + u, by_one + du, by_two + dv
    return total, by_one, by_two


@subroutine
def _window(rectangle, place, width, height):
    """Return a weight over a rectangle, its derivatives along the next axes, and by the height.

    The height is above the face, and how far edges are rounded, or `NOT_FREE`.
    """
    axis = int(rectangle[AXIS])
    b, c = place[(axis + 1) % 3], place[(axis + 2) % 3]
    if rectangle[HALF + 1] > 0.0:
        one, by_one, one_by_height = window(rectangle, 0, b, width, height)
        two, by_two, two_by_height = window(rectangle, 1, c, width, height)
        by_height = one_by_height * two + one * two_by_height
        return one * two, by_one * two, one * by_two, by_height
    b, c = b - rectangle[CENTER], c - rectangle[CENTER + 1]
    distance = math.sqrt(b * b + c * c)
    u, du, by_height = _inside(distance - rectangle[HALF], rectangle[FREE], width, height)
    slope = du / distance if distance > 0.0 else 0.0
    return u, slope * b, slope * c, by_height


@subroutine
def window(rectangle, along, place, width, height):
    """Return the weight of a place along one of the two next axes only, and its derivatives.

    They are those along the axis, and by the height.
    """
    free, place = FREE + 2 * along, place - rectangle[CENTER + along]
    half = rectangle[HALF + along]
    p, dp, hp = _inside(-half - place, rectangle[free], width, height)
    q, dq, hq = _inside(place - half, rectangle[free + 1], width, height)
    return p * q, p * dq - dp * q, hp * q + p * hq


@subroutine
def rounded(beyond, above, distance, radius):
    """Return the weight of a charge at one free edge, and its derivatives; see `weight_on`."""
    height = max(above, 0.0), BLUNT * distance + ROUND * radius
    return _inside(beyond, 1.0, 1.0, height)


@subroutine
def _inside(beyond, free, width, height):
    """Return a weight that falls beyond an edge, and the derivatives by that and by the height.

    At a free edge, it depends on the angle; at others, or if no edge counts as free, the weights on
    both sides have the sum 1. The height comes with how far the edge is rounded, which matters less
    beyond it, where there is no iron below.
    """
    above, blunt = height
    if free == 0.0 or blunt == 0.0:
        inside, slope = step(0.5 - beyond / width)
        return inside, -slope / width, 0.0
    ratio = max(beyond, 0.0) / blunt
    less = 1.0 / (1.0 + ratio * ratio)
    across = above * above + blunt * blunt * less * less
    square = beyond * beyond + across
    root = math.sqrt(square)
    x = 0.5 + 0.5 * beyond / root
    cube = x * x * x
    more = 1.0 - WEDGE * x * cube
    slope = -3.0 * x * x * more - 4.0 * WEDGE * cube * (1.0 - cube)
    slope *= 0.5 / (square * root)
    by_beyond = across + 2.0 * beyond * blunt * ratio * less * less * less
    return (1.0 - cube) * more, slope * by_beyond, -slope * beyond * above


@subroutine
def in_front(face, place):
    """Return what is 1 in front of the plane of a face and 0 behind it, and its derivative.

    It is 0 on the other side of a thin sheet.
    """
    width = 0.5 * SEAM * min(distance_of_nodes(face), face[0, DEPTH])
    above, slope = step(2.0 + height_above(face, place) / width)
    return above, face[0, SIDE] * slope / width


@subroutine
def component(axis, k, along, one, two):
    """Return component k of a vector given along an axis and the two next ones."""
    if k == axis:
        return along
    return one if k == (axis + 1) % 3 else two


@subroutine
def reaches(face, other):
    """Whether a rectangle of a face ends at the plane of another one, behind it."""
    axis = int(other[0, AXIS])
    after, found = (axis - int(face[0, AXIS]) - 1) % 3, False
    for k in range(len(face) if after < 2 else 0):
        end = other[0, SIDE] * face[k, CENTER + after] + face[k, HALF + after]
        found = found or abs(end - other[0, HEIGHT]) < CLOSED * face[k, APART]
    return found


@subroutine
def rises_above(face, other):
    """Whether a rectangle of a face is in front of the plane of another one."""
    axis = int(other[0, AXIS])
    after, found = (axis - int(face[0, AXIS]) - 1) % 3, False
    for k in range(len(face) if after < 2 else 0):
        found = found or other[0, SIDE] * face[k, CENTER + after] > other[0, HEIGHT]
    return found
