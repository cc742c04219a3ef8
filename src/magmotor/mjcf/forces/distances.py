"""Distance of a point from a geom, negative inside, and its gradient.

That of an ellipsoid is right to first order near its surface.
"""

import math

from magmotor.mjcf.declarations.iron import BOX, CYLINDER, ELLIPSOID, SPHERE
from magmotor.numerics.deferred import subroutine


@subroutine
def distance_from_geom(geom, x, y, z):
    """Return the distance of a point in the frame of a geom, and the gradient.

    `geom` starts with the type and the size.
    """
    shape, a, b, c = int(geom[0]), geom[1], geom[2], geom[3]
    if shape == SPHERE:
        return _from_ball(x, y, z, a)
    if shape == BOX:
        return _from_box(x, y, z, a, b, c)
    if shape == ELLIPSOID:
        return _from_ellipsoid(x, y, z, a, b, c)
    if shape == CYLINDER:
        radius = math.sqrt(x * x + y * y)
        d, along, up, _ = _from_box(radius, z, 0.0, a, b, math.inf)
        inverse = along / radius if radius > 0.0 else 0.0
        return d, inverse * x, inverse * y, up
    return _from_ball(x, y, z - max(-b, min(b, z)), a)


@subroutine
def _from_ball(x, y, z, radius):
    """Return the same for a ball."""
    distance = math.sqrt(x * x + y * y + z * z)
    inverse = 1.0 / distance if distance > 0.0 else 0.0
    return distance - radius, inverse * x, inverse * y, inverse * z


@subroutine
def _from_box(x, y, z, a, b, c):
    """Return the same for a box with half edges a, b and c."""
    p, q, r = abs(x) - a, abs(y) - b, abs(z) - c
    sx, sy, sz = math.copysign(1.0, x), math.copysign(1.0, y), math.copysign(1.0, z)
    if max(p, max(q, r)) > 0.0:
        p, q, r = max(p, 0.0), max(q, 0.0), max(r, 0.0)
        distance = math.sqrt(p * p + q * q + r * r)
        return distance, sx * p / distance, sy * q / distance, sz * r / distance
    if p >= q and p >= r:
        return p, sx, 0.0, 0.0
    return (q, 0.0, sy, 0.0) if q >= r else (r, 0.0, 0.0, sz)


@subroutine
def _from_ellipsoid(x, y, z, a, b, c):
    """Return (k - 1) k/g with k = |(x/a, y/b, z/c)| and g = |(x/a^2, y/b^2, z/c^2)|."""
    p, q, r = x / (a * a), y / (b * b), z / (c * c)
    k, g = math.sqrt(x * p + y * q + z * r), math.sqrt(p * p + q * q + r * r)
    if g == 0.0:
        return -min(a, min(b, c)), 0.0, 0.0, 0.0
    u, v = (2.0 * k - 1.0) / (k * g), k * (k - 1.0) / (g * g * g)
    return (
        k * (k - 1.0) / g, p * (u - v / (a * a)), q * (u - v / (b * b)), r * (u - v / (c * c))
    )  # fmt: skip
