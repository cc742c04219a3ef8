"""Forces and torques on bodies with dipole sites, written into MuJoCo's own memory.

A dipole is a site: its z axis is the dipole's direction, the first of its `user` numbers the
moment in A m^2 (zero or none: not a dipole). Dipoles of one rigid body do not act on one another.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import literal_unroll, njit

from magmotor.dipoles import COINCIDENCE_SQUARED, sum_over_sources
from magmotor.engines.mujoco import memory


@njit(inline="always")
def _dipole(i, moment, position, frame):
    """Position and moment of a site: its z axis is the third column of its frame."""
    strength = moment[i, 0]
    x, y, z = position[i, 0], position[i, 1], position[i, 2]
    return x, y, z, strength * frame[i, 2], strength * frame[i, 5], strength * frame[i, 8]


@njit(inline="always")
def set_magnetic_wrenches(m, d, offsets):
    """Overwrite the wrench of each body that can move and has dipoles; return how many there are.

    `m` and `d` are the words of mjModel and mjData, `offsets` their layout.
    """
    nsite = m[offsets.nsite // 8]
    nuser = m[offsets.nuser_site // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
    centre = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
    applied = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)

    sources = memory.stack_tile()
    dipole_count = 0
    start = 0 if nuser > 0 else nsite
    while start < nsite:
        first = start
        count = 0
        while start < nsite and count < memory.TILE:
            if moment[start, 0] != 0.0:
                source = _dipole(start, moment, position, frame)
                for row in literal_unroll((0, 1, 2, 3, 4, 5)):
                    sources[row, count] = source[row]
                sources[6, count] = weld_of[body_of[start]]
                count += 1
            start += 1
        dipole_count += count
        last_body = -1
        for i in range(nsite):
            body = body_of[i]
            weld = weld_of[body]
            if freedoms[weld] == 0 or moment[i, 0] == 0.0:
                continue
            if first == 0 and body != last_body:
                applied[body] = 0.0
            last_body = body
            target = _dipole(i, moment, position, frame)
            fx, fy, fz, bx, by, bz, coincident = sum_over_sources(target, weld, sources, count)
            if coincident > 0:
                names = m[offsets.names // 8]
                starts = memory.integers(m[offsets.name_siteadr // 8], nsite)
                for j in range(first, start):
                    gap = position[i] - position[j]
                    near = np.sum(gap * gap) < COINCIDENCE_SQUARED
                    if near and moment[j, 0] != 0.0 and weld_of[body_of[j]] != weld:
                        memory.fatal_coincidence(i, names + starts[i], j, names + starts[j])
            x, y, z, mx, my, mz = target
            x -= centre[body, 0]
            y -= centre[body, 1]
            z -= centre[body, 2]
            applied[body, 0] += fx
            applied[body, 1] += fy
            applied[body, 2] += fz
            applied[body, 3] += my * bz - mz * by + y * fz - z * fy
            applied[body, 4] += mz * bx - mx * bz + z * fx - x * fz
            applied[body, 5] += mx * by - my * bx + x * fy - y * fx
    return dipole_count
