"""Whether a timestep resolves the magnetic forces: no magnet moves by its size in one step.

Magnets that come so near that it does not fly apart, since the force on each of them at the start
of a step says nothing about the rest of the step. The motion is that from rest, with the mean
inverse inertia of the body at `qpos0`. A body that moves by much less in the step before is held
by something else, such as strong damping.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from numba import njit

from magmotor.mjcf import memory
from magmotor.mjcf.forces.dipole_table import BODY, MOVES

FASTEST_TURN = 4.0
"""Largest turn in rad from rest within one timestep: (omega h)^2 = 4 across the field."""

MOVED = 0.5
"""Part of that motion that the velocity must give, too."""


@njit
def unresolved_body(table, magnets, m, d, offsets, applied):
    """Return a body that `applied` moves by more than its size, or turns by too much; or -1.

    `applied` (nbody, 6) are the magnetic wrenches; the size is the radius of the first geom.
    """
    timestep = memory.numbers(m.ctypes.data + offsets.timestep, 1, 1)[0, 0]
    inverse = memory.numbers(m[offsets.body_invweight0 // 8], memory.UNBOUNDED, 2)
    geoms = memory.integers(m[offsets.body_geomnum // 8], memory.UNBOUNDED)
    first = memory.integers(m[offsets.body_geomadr // 8], memory.UNBOUNDED)
    radius = memory.numbers(m[offsets.geom_rbound // 8], 1, memory.UNBOUNDED)[0]
    for k in range(magnets.number):
        if table[MOVES, k] > 0.0:
            body = int(table[BODY, k])
            w = applied[body]
            shift, turn = timestep**2 * inverse[body, 0], timestep**2 * inverse[body, 1]
            if turn * turn * (w[3] * w[3] + w[4] * w[4] + w[5] * w[5]) > FASTEST_TURN**2:
                spin, _ = _velocities(body, m, d, offsets)
                if timestep * spin > MOVED * FASTEST_TURN:
                    return body
            if geoms[body] > 0:
                size = radius[first[body]]
                if shift * shift * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) > size * size > 0.0:
                    _, speed = _velocities(body, m, d, offsets)
                    if timestep * speed > MOVED * size:
                        return body
    return -1


@njit
def _velocities(body, m, d, offsets):
    """Return the angular velocity of a body, and the velocity of its center of mass, in size."""
    root = memory.integers(m[offsets.body_rootid // 8], memory.UNBOUNDED)[body]
    v = memory.numbers(d[offsets.cvel // 8], memory.UNBOUNDED, 6)[body]
    origin = memory.numbers(d[offsets.subtree_com // 8], memory.UNBOUNDED, 3)[root]
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)[body]
    r = center[0] - origin[0], center[1] - origin[1], center[2] - origin[2]
    x = v[3] + v[1] * r[2] - v[2] * r[1]
    y = v[4] + v[2] * r[0] - v[0] * r[2]
    z = v[5] + v[0] * r[1] - v[1] * r[0]
    spin = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return spin, math.sqrt(x * x + y * y + z * z)
