"""The permeance of a narrow gap between two pieces of iron, or one and a plane; see `gaps.py`.

What nodes miss of it is the integral

    P = int s(c) (1 - (d/D)^2)^2/(1 + (d/delta)^2)/d dS

over points on the surface of one piece. The distance d from the other one, or from one of its
geoms, is kept above zero, c is the cosine of the angle between the surfaces, s is a smooth step,
delta is `WIDTH` and D is `REACH` times the radius of the balls of charge at nodes.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.faces import step
from magmotor.mjcf.forces.gap_paths import (
    ANSWER,
    FELT,
    ONE,
    OTHER,
    PERMEANCE,
    PLACE,
    SHARE,
    THROUGH,
    U,
    X,
    path_of,
)
from magmotor.mjcf.forces.iron_pieces import (
    EXTENT,
    POSITION,
    RADIUS,
    RESPONSE,
    center_of,
    radius_of_pair,
)
from magmotor.mjcf.forces.lifts import place_on_piece, to_world
from magmotor.mjcf.forces.mirror import height_above
from magmotor.mjcf.forces.threaded_iron import distance_from_piece
from magmotor.numerics.deferred import subroutine

WIDTH, REACH, CLOSEST, TURN = 0.285, 1.7, 0.007, 0.01
"""delta, D, the distance d in contact, and the length by which cosines are found, over the radius
of the balls of charge. With the first three, the pull of two spheres and that of two rods are right
to 5 % and 12 %. In contact, there is a gap of some hundredths of a millimeter."""

NODE = 6
"""Row of points: the nodes to which they belong."""


@subroutine
def _distance(state, other, geom, x, y, z):
    """Return the distance of a point of the world from the second piece, and its gradient.

    Of the piece, only one geom counts, or all if it is -1. The gradient is along the axes of the
    world.
    """
    if other < 0:
        mirror = state.mirror
        return height_above(mirror, x, y, z), mirror[1], mirror[2], mirror[3]
    piece = state.pieces[other]
    distance, gx, gy, gz, _ = distance_from_piece(piece, geom, *place_on_piece(piece, x, y, z))
    gx, gy, gz = to_world(piece, gx, gy, gz)
    return distance, gx, gy, gz


@subroutine
def set_permeance(state, gap):
    """Set P, its mean place, and the shares and mean places of nodes of the first piece in it."""
    piece, permeance = state.pieces[int(gap[ONE])], 0.0
    points, path = _points(piece), path_of(gap, piece, ONE)
    path[SHARE:ANSWER] = 0.0
    for k in range(points.shape[1]):
        part, x, y, z = _part(state, gap, points, k)[:4]
        node, permeance = int(points[NODE, k]), permeance + part
        path[SHARE, node] += part
        path[X, node] += part * x
        path[X + 1, node] += part * y
        path[X + 2, node] += part * z
    gap[PERMEANCE], center = permeance, center_of(piece)
    for axis in range(3 if permeance > 0.0 else 0):
        gap[PLACE + axis] = center[axis]
        for k in range(path.shape[1]):
            gap[PLACE + axis] += path[X + axis, k] / permeance
            if path[SHARE, k] > 0.0:
                path[X + axis, k] = center[axis] + path[X + axis, k] / path[SHARE, k]
    for k in range(path.shape[1] if permeance > 0.0 else 0):
        path[SHARE, k] /= permeance


@subroutine
def wrench_of_gap(state, gap, by_permeance, flux):
    """Return the wrench on the first piece, for an energy of P and of potentials on its path.

    The path has the potentials at its nodes, and their slopes by the mean places; `flux` is over
    mu0, and so is P. The torque is about the center of the piece.
    """
    piece = state.pieces[int(gap[ONE])]
    fx = fy = fz = tx = ty = tz = mean = 0.0
    points, path, share = _points(piece), path_of(gap, piece, ONE), flux / gap[PERMEANCE]
    for k in range(path.shape[1]):
        mean += path[SHARE, k] * path[FELT, k]
    for k in range(points.shape[1]):
        part, p, q, r, slope, a, b, c, more, dx, dy, dz, ex, ey, ez = _part(state, gap, points, k)
        if part == 0.0:
            continue
        node = int(points[NODE, k])
        x, y, z = path[X, node], path[X + 1, node], path[X + 2, node]
        u, v, w = path[U, node], path[U + 1, node], path[U + 2, node]
        cx, cy, cz = center_of(piece)
        along = u * (cx + p - x) + v * (cy + q - y) + w * (cz + r - z)
        factor = by_permeance + share * (path[FELT, node] - mean + along)
        slope, more = factor * slope, factor * more
        # The mean places move with the first piece.
        u, v, w = share * part * u, share * part * v, share * part * w
        gx, gy, gz = -(slope + more) * dx - u, -(slope + more) * dy - v, -(slope + more) * dz - w
        hx, hy, hz = more * ex, more * ey, more * ez
        fx, fy, fz = fx + gx + hx, fy + gy + hy, fz + gz + hz
        a, b, c = p + a, q + b, r + c
        tx += q * gz - r * gy + b * hz - c * hy
        ty += r * gx - p * gz + c * hx - a * hz
        tz += p * gy - q * gx + a * hy - b * hx
    return fx, fy, fz, tx, ty, tz


@subroutine
def _points(piece):
    """Return the points on the surface of a piece."""
    address = int(piece[RESPONSE])
    words = memory.words(address, responses.START)
    return memory.numbers(address + 8 * words[responses.POINT], NODE + 1, words[responses.POINTS])


@subroutine
def _part(state, gap, points, k):
    """Return the part of a point in P, and what its derivatives need.

    That is the place of the point, from the center of the piece; the slope of the part by the
    distance; the place of a second point, from the first one, and the slope by the difference of
    both distances; and the gradients of the distances.
    """
    piece, other, geom = state.pieces[int(gap[ONE])], int(gap[OTHER]), int(gap[THROUGH])
    nothing = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    radius = piece[RADIUS]
    p, q, r = to_world(piece, points[0, k], points[1, k], points[2, k])
    x, y, z = piece[POSITION] + p, piece[POSITION + 1] + q, piece[POSITION + 2] + r
    if other >= 0:
        second = state.pieces[other]
        radius, (cx, cy, cz) = radius_of_pair(piece, second), center_of(second)
        reach = second[EXTENT] + REACH * radius
        square = (x - cx) * (x - cx) + (y - cy) * (y - cy) + (z - cz) * (z - cz)
        if square > reach * reach:
            return nothing
    most, delta, turn = REACH * radius, WIDTH * radius, TURN * radius
    d, dx, dy, dz = _distance(state, other, geom, x, y, z)
    if d > most:
        return nothing
    u, v, w = points[3, k], points[4, k], points[5, k]
    size = math.sqrt(u * u + v * v + w * w)
    scale = turn / size
    a, b, c = to_world(piece, scale * u, scale * v, scale * w)
    end, ex, ey, ez = _distance(state, other, geom, x + a, y + b, z + c)
    cosine = (d - end) / turn
    if cosine <= 0.0:
        return nothing
    density, fall = _density(d, delta, most, CLOSEST * radius)
    facing, by_cosine = step(cosine)
    slope, more = size * facing * fall, size * by_cosine / turn * density
    return size * facing * density, p, q, r, slope, a, b, c, more, dx, dy, dz, ex, ey, ez


@subroutine
def _density(distance, delta, most, closest):
    """Return the permeance per area at a distance, and its slope.

    The distance is that plus `closest`, or less where pieces overlap.
    """
    d, slope = distance + closest, 1.0
    if distance < 0.0:
        slope = closest / (closest - distance)
        d, slope = closest * slope, slope * slope
    x, y = d / delta, d / most
    if y >= 1.0:
        return 0.0, 0.0
    low, fall = 1.0 / (1.0 + x * x), 1.0 - y * y
    weight = fall * fall * low
    change = -4.0 * y / most * fall * low - 2.0 * x / delta * weight * low
    return weight / d, slope * (change - weight / d) / d
