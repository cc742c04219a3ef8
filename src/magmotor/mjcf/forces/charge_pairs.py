"""Charges at the nodes of two pieces of iron, or of one and its image, in each other's field.

The charge of a node stands for that of the surface around it. Where surfaces are nearer than nodes
are from each other, each charge is a ball of uniform density instead of a point, so that potentials
remain finite and their quadratic form positive. Balls that do not overlap act as points.
"""

import math

from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import prefer_wide_vectors

PER_4PI = 0.25 / math.pi


@subroutine
def add_potentials(target, potential, source, charge, radius, factor):
    """Add the potentials of the charges of other nodes, times a factor, to those at nodes.

    `target` and `source` have the places of nodes in the rows 0 to 2, and `radius` is that of the
    balls. The energy of two balls of unit charge at the distance x radius is that of
    (6/5 - x^2/2 + 3 x^3/16 - x^5/160)/radius for x < 2.
    """
    prefer_wide_vectors()
    x, y, z = target[0], target[1], target[2]
    inverse = 1.0 / radius
    for j in range(len(charge)):
        u, v, w = source[0, j], source[1, j], source[2, j]
        q = factor * PER_4PI * charge[j]
        for k in range(len(potential)):
            dx, dy, dz = x[k] - u, y[k] - v, z[k] - w
            square = dx * dx + dy * dy + dz * dz
            distance = math.sqrt(square)
            s = distance * inverse
            t = s * s
            near = inverse * (1.2 + t * (s * (0.1875 - 0.00625 * t) - 0.5))
            potential[k] += q * (near if s < 2.0 else 1.0 / distance)


@subroutine
def set_fields(room, count, source, charge, radius):
    """Write the fields of these charges at the places in the rows 0 to 2 to the rows 4 to 6."""
    prefer_wide_vectors()
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    for k in range(count):
        hx[k] = hy[k] = hz[k] = 0.0
    inverse = 1.0 / radius
    cube = inverse * inverse * inverse
    for j in range(len(charge)):
        u, v, w = source[0, j], source[1, j], source[2, j]
        q = PER_4PI * charge[j]
        for k in range(count):
            dx, dy, dz = x[k] - u, y[k] - v, z[k] - w
            square = dx * dx + dy * dy + dz * dz
            distance = math.sqrt(square)
            s = distance * inverse
            near = cube * (1.0 + s * (0.03125 * s * s - 0.5625))
            slope = q * (near if s < 2.0 else 1.0 / (square * distance))
            hx[k] += slope * dx
            hy[k] += slope * dy
            hz[k] += slope * dz
