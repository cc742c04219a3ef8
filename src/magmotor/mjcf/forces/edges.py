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
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.elementary import arctangent, cosine, prefer_wide_vectors, sine
from magmotor.numerics.iron.wedge import induced

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
    inside, by_along, _ = window(edge[3][0], edge[3][1], place[edge[2]], SEAM * apart, size)
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
def _set_charges(piece, edge, row, shaped, lifted, room):
    """Write the charges of a magnet as an edge sees them; return how many, or 0 for too many."""
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
        room[WEIGHT, k] = rounded(x, y, edge[4], row[RADIUS])[0]
    return count


@subroutine
def _add_pair(piece, edge, pair, lifted, sign, room, wanted):
    """Add the wrenches of two magnets at their true or lifted places, or return the energy."""
    sources, results = memory.from_column(room, MOST), memory.from_column(room, 2 * MOST)
    energy, (row, other, same, shaped) = 0.0, pair
    for turn in range(1 if same or wanted else 2):
        target, source = (other, row) if turn == 0 else (row, other)
        count = _set_charges(piece, edge, source, shaped, lifted, room)
        for i in range(WEIGHT + 1):
            for k in range(count):
                sources[i, k] = room[i, k]
        number = _set_charges(piece, edge, target, shaped, lifted, room) if count > 0 else 0
        share = 0.5 if same else float(turn)
        soft = max(SOFT * max(row[RADIUS], other[RADIUS]), TINY * edge[4])
        _set_results(edge, room, sources, results, number, count, share, soft * soft)
        part = piece[SUSCEPTIBILITY] / (piece[SUSCEPTIBILITY] + 2.0)
        part *= 1.0 / (4.0 * math.pi * VACUUM_PERMEABILITY)
        if turn == 0:
            for k in range(number):
                energy += (0.5 if same else 1.0) * part * room[3, k] * results[4, k]
        if not wanted:
            _add_forces(piece, edge, target, lifted, sign * part, room, results, number)
    return energy


@subroutine
def _set_results(edge, room, sources, results, number, count, share, soft):
    """Write the potentials of sources at targets, and derivatives, to rows 4 and 5 to 8.

    `share` is that of the targets' weights.
    """
    prefer_wide_vectors()
    along, tiny = room[edge[2]], (TINY * edge[4]) ** 2
    distance, a, b, weight = room[ROUND], room[COSINE], room[SINE], room[WEIGHT]
    phi, by_r, by_angle = results[4], results[5], results[6]
    by_along, by_weight = results[7], results[8]
    for k in range(number):
        phi[k] = by_r[k] = by_angle[k] = by_along[k] = by_weight[k] = 0.0
    for i in range(count):
        charge, place, w = sources[3, i], sources[edge[2], i], (1.0 - share) * sources[WEIGHT, i]
        r, c, s = sources[ROUND, i], sources[COSINE, i], sources[SINE, i]
        for k in range(number):
            target, total = (distance[k], a[k], b[k]), w + share * weight[k]
            v, p, q, t, u = induced(target, (r, c, s), along[k] - place, total, tiny, soft)
            phi[k] += charge * v
            by_r[k] += charge * p
            by_angle[k] += charge * q
            by_along[k] += charge * t
            by_weight[k] += charge * share * u


@subroutine
def _add_forces(piece, edge, row, lifted, sign, room, results, count):
    """Add the wrench on a magnet, given the derivatives at its charges."""
    x, y, z = center_on_piece(piece, row)
    x, y, z = x + lifted * row[LIFT], y + lifted * row[LIFT + 1], z + lifted * row[LIFT + 2]
    fx = fy = fz = tx = ty = tz = 0.0
    for k in range(count):
        place = room[0, k], room[1, k], room[2, k]
        u, v, slope = _moved(edge, place, row[RADIUS])
        _, wu, wv = rounded(u, v, edge[4], row[RADIUS])
        inverse = 1.0 / room[ROUND, k]
        by_r, by_angle = inverse * results[5, k], inverse * inverse * results[6, k]
        gu = by_r * u + by_angle * v + results[8, k] * wu
        gv = by_r * v - by_angle * u + results[8, k] * wv
        both = slope * (gu + gv)
        u, v = _from_edge(edge, place)
        charge, fade, square = -room[3, k], -room[FADE, k] * results[4, k], u * u + v * v
        # The sine of the angle from the nearer face varies across the direction from the edge.
        fade *= (v if u >= v else -u) / (square * math.sqrt(square)) if fade != 0.0 else 0.0
        gx, gy, gz = _along_axes(
            edge, charge * (gu + both * u) + fade * v, charge * (gv + both * v) - fade * u,
            charge * results[7, k],
        )  # fmt: skip
        a, b, c = place[0] - x, place[1] - y, place[2] - z
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + b * gz - c * gy, ty + c * gx - a * gz, tz + a * gy - b * gx
    add_to_row(row, lifted, sign, (fx, fy, fz, tx, ty, tz))
