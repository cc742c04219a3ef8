"""What images in a flat face lack near its convex edges, for magnets near them.

Of two charges, the images have -w/R', with the weight w of one; see `face_images.py`. What a wedge
of 90 degrees adds is smooth where the two are not near each other at the edge, so that few charges
of a magnet serve, all with all: their energy at the true places less that at the lifted ones,

    sum q_i q_j (G + w_i/R'),

with the function G of `numerics/iron/wedge.py`. Charges at the edge are moved away from it by less
than their distance from each other, and those deep in the wedge, on the other side of a thin piece,
do not count. The energy is times a number for each magnet, which is 1 near the edge and fades where
it does not matter, also around corners, where edges end.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces.charges import set_charges, set_dipole
from magmotor.mjcf.forces.dipole_table import padded
from magmotor.mjcf.forces.faces import (
    AXIS,
    CENTER,
    FREE,
    HALF,
    HEIGHT,
    SEAM,
    SIDE,
    component,
    distance_of_nodes,
    rounded,
    step,
    window,
)
from magmotor.mjcf.forces.iron_pieces import SUSCEPTIBILITY
from magmotor.mjcf.forces.lifts import add_to_row, center_on_piece, place_on_piece
from magmotor.mjcf.forces.shaped_magnets import KIND, LIFT, POINT, RADIUS, dipole_of
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.elementary import arctangent, cosine, sine
from magmotor.numerics.iron.wedge import induced
from magmotor.numerics.simd import (
    broadcast,
    lane_numbers,
    load,
    store,
    total,
    where_equal,
    where_less,
)

LEVEL, FEW, MOST = 3, 72, 248
"""Order of the charges of a magnet, how many of that order there are at most, instead of one less;
and the largest number of all."""

AWAY, SOFT = 0.04, 0.1
"""How far charges at the edge are moved along both faces, and how far images are from each other at
least, over the radius of the magnet."""

NEAR, FADING = 0.8, 0.8
"""Distance from an edge, beyond the radius of a magnet, up to which it counts, and in which this
ends, over the distance of nodes."""

TINY = 1e-7
"""Nearer than this, over the distance of nodes, the field of a charge does not diverge."""

SUNK = 1.25
"""Charges that have sunk into the iron a little count fully, up to 8 degrees from a face."""

ROUND, COSINE, SINE, WEIGHT, FADE = 4, 5, 6, 7, 8
"""Rows of charges after their places and charges: the distance from the edge, the cosine and sine
of a third of the angle, the weight, and the charge times the slope of `_outside`."""


@subroutine
def add_edges(piece, face, pair, factor, room, wanted):
    """Add the wrenches of two magnets near the edges of a face, or return the energy.

    These are times `factor`. A pair is two magnets, and whether they are the same, and have shapes:
    else, they are dipoles. There are no wrenches if the energy is `wanted`.
    """
    total, (row, other, _, _) = 0.0, pair
    for k in range(len(face)):
        for number in range(4 if face[k, HALF + 1] > 0.0 else 0):
            if face[k, FREE + number] == 0.0:
                continue
            edge = _edge(face, k, number)
            one, two = _nearness(piece, edge, row), _nearness(piece, edge, other)
            if one[0] * two[0] == 0.0:
                continue
            both, energy = one[0] * two[0] * factor, 0.0
            for lifted in range(2):
                sign = (1.0 - 2.0 * lifted) * both
                energy += sign * _add_pair(piece, edge, pair, lifted, sign, room, wanted)
            total += energy
            if not wanted:
                for each, near in ((row, one), (other, two)):
                    part = -energy / near[0]
                    push = part * near[1], part * near[2], part * near[3]
                    add_to_row(each, 0, 1.0, (*push, 0.0, 0.0, 0.0))
    return total


@subroutine
def _edge(face, k, number):
    """Return an edge of a rectangle of a face.

    It is the axis and the sign of the normal and the height; the same of the direction beyond the
    edge; the axis along the edge, the rectangle, and the distance of nodes.
    """
    axis, beyond, along = int(face[k, AXIS]), number // 2, 1 - number // 2
    sign = 2.0 * (number % 2) - 1.0
    end = sign * face[k, CENTER + beyond] + face[k, HALF + beyond]
    return (
        (axis, face[k, SIDE], face[k, HEIGHT]), ((axis + 1 + beyond) % 3, sign, end),
        (axis + 1 + along) % 3, (face[k], along), distance_of_nodes(face),
    )  # fmt: skip


@subroutine
def _from_edge(edge, place):
    """Return how far a place is beyond an edge, and above the face."""
    (axis, side, height), (beside, sign, end), _, _, _ = edge
    return sign * place[beside] - end, side * place[axis] - height


@subroutine
def _along_axes(edge, beyond, above, along):
    """Return a vector along the axes of the piece."""
    (axis, side, _), (beside, sign, _), _, _, _ = edge
    above, beyond = side * above, sign * beyond
    one, two = (beyond, along) if beside == (axis + 1) % 3 else (along, beyond)
    return (
        component(axis, 0, above, one, two), component(axis, 1, above, one, two),
        component(axis, 2, above, one, two),
    )  # fmt: skip


@subroutine
def _nearness(piece, edge, row):
    """Return what is 1 for a magnet near an edge and 0 far from it, and the gradient."""
    place, apart = center_on_piece(piece, row), edge[4]
    x, y = _from_edge(edge, place)
    distance = math.sqrt(x * x + y * y)
    near, slope = step((NEAR + FADING) / FADING - (distance - row[RADIUS]) / (FADING * apart))
    if near == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    slope = -slope / (FADING * apart * distance) if slope != 0.0 else 0.0
    size = row[RADIUS] + NEAR * apart
    height = size, TINY * size
    inside, by_along, _ = window(edge[3][0], edge[3][1], place[edge[2]], SEAM * apart, height)
    return (
        near * inside,
        *_along_axes(edge, inside * slope * x, inside * slope * y, near * by_along),
    )


@subroutine
def _moved(edge, place, size):
    """Return where a charge is seen, and how far it is moved, and the derivative of that.

    This is half the derivative by the squared distance from the edge.
    """
    x, y = _from_edge(edge, place)
    away = AWAY * size
    square = x * x + y * y + away * away
    shift = away * away / math.sqrt(square) if away > 0.0 else 0.0
    return x + shift, y + shift, -shift / square if away > 0.0 else 0.0


@subroutine
def _outside(x, y):
    """Return what is 1 outside of a wedge and falls to 0 in its middle, and the slope.

    This is the derivative by the sine of the angle from the nearer face.
    """
    if max(x, y) >= 0.0:
        return 1.0, 0.0
    outside, slope = step(SUNK + SUNK * math.sqrt(2.0) * max(x, y) / math.sqrt(x * x + y * y))
    return outside, SUNK * math.sqrt(2.0) * slope


@subroutine
def _set_charges(piece, edge, row, shaped, lifted, share, room):
    """Write the charges of a magnet as an edge sees them; return how many, or 0 for too many.

    Their weights are times `share`.
    """
    if int(row[KIND]) == POINT or not shaped:
        count = set_dipole(room, dipole_of(row), edge[4])
    else:
        count = set_charges(room, row, LEVEL)
        if count > FEW:
            count = set_charges(room, row, LEVEL - 1)
        if count > MOST:
            return 0
    a, b, c = lifted * row[LIFT], lifted * row[LIFT + 1], lifted * row[LIFT + 2]
    for k in range(count):
        x, y, z = place_on_piece(piece, room[0, k], room[1, k], room[2, k])
        place = x + a, y + b, z + c
        room[0, k], room[1, k], room[2, k] = place
        x, y = _from_edge(edge, place)
        outside, slope = _outside(x, y)
        room[FADE, k], room[3, k] = slope * room[3, k], outside * room[3, k]
        x, y, _ = _moved(edge, place, row[RADIUS])
        angle = arctangent(y, -x)
        # Inside the iron, a charge has just come through the nearer face.
        third = (angle + (2.0 * math.pi if angle < -0.25 * math.pi else 0.0)) / (6.0 * math.pi)
        room[ROUND, k], room[COSINE, k], room[SINE, k] = (
            math.sqrt(x * x + y * y), cosine(third), sine(third)
        )  # fmt: skip
        room[WEIGHT, k] = share * rounded(x, y, edge[4], row[RADIUS])[0]
    for k in range(count, padded(count)):
        for i in range(WEIGHT + 1):
            room[i, k] = room[i, 0] if i != 3 else 0.0
    return count


@subroutine
def _add_pair(piece, edge, pair, lifted, sign, room, wanted):
    """Add the wrenches of two magnets at their true or lifted places, or return the energy."""
    row, other, same, shaped = pair
    share, second = 0.5 if same else 1.0, room
    count = number = _set_charges(piece, edge, row, shaped, lifted, share, room)
    if not same and count > 0:
        second = memory.from_column(room, MOST)
        number = _set_charges(piece, edge, other, shaped, lifted, 0.0, second)
    if number == 0:
        return 0.0
    results = memory.from_column(room, 2 * MOST)
    soft = max(SOFT * max(row[RADIUS], other[RADIUS]), TINY * edge[4])
    _set_results(edge, room, count, second, number, same, soft * soft, results)
    strength = piece[SUSCEPTIBILITY] / (piece[SUSCEPTIBILITY] + 2.0)
    part = strength * math.sqrt(strength) / (4.0 * math.pi * VACUUM_PERMEABILITY)
    energy = 0.0
    for k in range(count):
        energy += share * part * room[3, k] * results[0, k]
    if not wanted:
        sign *= part
        _add_forces(piece, edge, row, lifted, sign, (room, count, share, 0), results)
        if not same:
            _add_forces(piece, edge, other, lifted, sign, (second, number, 0.0, 5), results)
    return energy


@subroutine
def _set_results(edge, one, count, two, number, same, soft, results):
    """Write the potentials at charges, and the derivatives, to rows 0 to 4, and 5 to 9.

    The first five are those at the charges of one magnet in the field of another: the potential,
    its derivatives by the distance, the angle and the place along the edge, and by the weight. The
    others are those of the other magnet, unless it is the same.
    """
    first, tiny = 0 if same else 5, (TINY * edge[4]) ** 2
    for i in range(10):
        for k in range(max(padded(count), padded(number))):
            results[i, k] = 0.0
    for i in range(count):
        charge, along, weight = one[3, i], one[edge[2], i], one[WEIGHT, i]
        source = one[ROUND, i], one[COSINE, i], one[SINE, i]
        phi = by_distance = by_angle = by_along = by_weight = broadcast(0.0)
        # A magnet's own pairs count once.
        begin = i // COUNT * COUNT if same else 0
        for k in range(begin, number, COUNT):
            target = load(two, ROUND, k), load(two, COSINE, k), load(two, SINE, k)
            apart, weights = load(two, edge[2], k) - along, load(two, WEIGHT, k) + weight
            value, by_r, by_s, by_difference, by_sum, slope, image = induced(
                target, source, apart, weights, tiny, soft
            )
            this, that = broadcast(charge), load(two, 3, k)
            if same and k == begin:
                lanes, itself, half = lane_numbers(), broadcast(float(i - k)), broadcast(0.5)
                whole = where_equal(lanes, itself, half, broadcast(1.0))
                whole = where_less(lanes, itself, broadcast(0.0), whole)
                this, that = whole * this, whole * that
            phi, by_distance = phi + that * value, by_distance + that * by_s
            by_angle, by_along = by_angle + that * (by_sum - by_difference), by_along - that * slope
            by_weight = by_weight + that * image
            _add_to(results, first, k, this * value)
            _add_to(results, first + 1, k, this * by_r)
            _add_to(results, first + 2, k, this * (by_sum + by_difference))
            _add_to(results, first + 3, k, this * slope)
            _add_to(results, first + 4, k, this * image)
        results[0, i] += total(phi)
        results[1, i] += total(by_distance)
        results[2, i] += total(by_angle)
        results[3, i] += total(by_along)
        results[4, i] += total(by_weight)


@subroutine(forceinline=True)
def _add_to(results, row, k, eight):
    """Add eight numbers to those of a row."""
    store(results, row, k, load(results, row, k) + eight)


@subroutine
def _add_forces(piece, edge, row, lifted, sign, charges, results):
    """Add the wrench on a magnet, given the derivatives at its charges.

    The charges are an array and their number; the share of their weights; and the first row of
    results.
    """
    room, count, share, first = charges
    x, y, z = center_on_piece(piece, row)
    x, y, z = x + lifted * row[LIFT], y + lifted * row[LIFT + 1], z + lifted * row[LIFT + 2]
    fx = fy = fz = tx = ty = tz = 0.0
    for k in range(count):
        place = room[0, k], room[1, k], room[2, k]
        u, v, slope = _moved(edge, place, row[RADIUS])
        _, wu, wv = rounded(u, v, edge[4], row[RADIUS])
        inverse, by_weight = 1.0 / room[ROUND, k], share * results[first + 4, k]
        by_r = inverse * results[first + 1, k]
        by_angle = inverse * inverse * results[first + 2, k]
        gu = by_r * u + by_angle * v + by_weight * wu
        gv = by_r * v - by_angle * u + by_weight * wv
        both = slope * (gu + gv)
        u, v = _from_edge(edge, place)
        charge, square = -room[3, k], u * u + v * v
        fade = -room[FADE, k] * results[first, k]
        # The sine of the angle from the nearer face varies across the direction from the edge.
        fade *= (v if u >= v else -u) / (square * math.sqrt(square)) if fade != 0.0 else 0.0
        gx, gy, gz = _along_axes(
            edge, charge * (gu + both * u) + fade * v, charge * (gv + both * v) - fade * u,
            charge * results[first + 3, k],
        )  # fmt: skip
        a, b, c = place[0] - x, place[1] - y, place[2] - z
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + b * gz - c * gy, ty + c * gx - a * gz, tz + a * gy - b * gx
    add_to_row(row, lifted, sign, (fx, fy, fz, tx, ty, tz))
