"""Whether a timestep resolves the magnetic forces: no magnet moves by its size in one step.

Magnets that come so near that it does not fly apart, since the force on each of them at the start
of a step says nothing about the rest of the step. The motion is that from rest, with the mean
inverse inertia of the body at `qpos0`.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from numba import njit

from magmotor.mjcf import memory
from magmotor.mjcf.forces.dipole_table import BODY, MOVES

FASTEST_TURN = 4.0
"""Largest turn in rad from rest within one timestep: (omega h)^2 = 4 across the field."""


@njit
def unresolved_body(table, magnets, m, offsets, applied):
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
                return body
            if geoms[body] > 0:
                size = radius[first[body]]
                if shift * shift * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) > size * size > 0.0:
                    return body
    return -1
