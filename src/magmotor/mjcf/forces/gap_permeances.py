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

WIDTH, REACH, CLOSEST, TURN = 0.3, 1.7, 0.01, 0.01
"""delta, D, the distance d in contact, and the length by which cosines are found, over the radius
of the balls of charge. With the first two, the pull of two spheres is right to 5 %, and that of two
rods end to end to 25 %, mostly to 15 %."""


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
def gap_permeance(state, one, other, geom, by_permeance):
    """Return P, where the flux goes through, and the wrench on the first piece for a slope by P.

    The torque is about the center of the first piece.
    """
    piece = state.pieces[one]
    address = int(piece[RESPONSE])
    words = memory.words(address, responses.START)
    points = memory.numbers(address + 8 * words[responses.POINT], 6, words[responses.POINTS])
    radius, reach = piece[RADIUS], math.inf
    cx = cy = cz = 0.0
    if other >= 0:
        second = state.pieces[other]
        radius, reach = radius_of_pair(piece, second), second[EXTENT]
        cx, cy, cz = center_of(second)
    most, delta, turn = REACH * radius, WIDTH * radius, TURN * radius
    reach = (reach + most) * (reach + most)
    permeance = sx = sy = sz = fx = fy = fz = tx = ty = tz = 0.0
    for k in range(points.shape[1]):
        p, q, r = to_world(piece, points[0, k], points[1, k], points[2, k])
        x, y, z = piece[POSITION] + p, piece[POSITION + 1] + q, piece[POSITION + 2] + r
        square = (x - cx) * (x - cx) + (y - cy) * (y - cy) + (z - cz) * (z - cz)
        if square > reach:
            continue
        d, dx, dy, dz = _distance(state, other, geom, x, y, z)
        if d > most:
            continue
        u, v, w = points[3, k], points[4, k], points[5, k]
        size = math.sqrt(u * u + v * v + w * w)
        scale = turn / size
        a, b, c = to_world(piece, scale * u, scale * v, scale * w)
        end, ex, ey, ez = _distance(state, other, geom, x + a, y + b, z + c)
        cosine = (d - end) / turn
        if cosine <= 0.0:
            continue
        density, fall = _density(d, delta, most, CLOSEST * radius)
        facing, by_cosine = step(cosine)
        part = size * facing * density
        permeance, sx, sy, sz = permeance + part, sx + part * x, sy + part * y, sz + part * z
        if by_permeance != 0.0:
            slope = by_permeance * size * facing * fall
            more = by_permeance * size * by_cosine / turn * density
            gx, gy, gz = -(slope + more) * dx, -(slope + more) * dy, -(slope + more) * dz
            hx, hy, hz = more * ex, more * ey, more * ez
            fx, fy, fz = fx + gx + hx, fy + gy + hy, fz + gz + hz
            a, b, c = p + a, q + b, r + c
            tx += q * gz - r * gy + b * hz - c * hy
            ty += r * gx - p * gz + c * hx - a * hz
            tz += p * gy - q * gx + a * hy - b * hx
    if permeance > 0.0:
        sx, sy, sz = sx / permeance, sy / permeance, sz / permeance
    return permeance, sx, sy, sz, fx, fy, fz, tx, ty, tz


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
