"""Magnetic forces and torques on bodies, written into MuJoCo's memory."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import njit

from magmotor.dipoles import COINCIDENCE_SQUARED
from magmotor.mjcf import memory
from magmotor.mjcf.forces.clusters import cluster_bytes
from magmotor.mjcf.forces.couplings import coupling_factor, read_couplings
from magmotor.mjcf.forces.dipole_table import ROWS, gather, table_size
from magmotor.mjcf.forces.dipole_wrenches import add_dipole_wrenches
from magmotor.mjcf.forces.marks import COUPLINGS
from magmotor.mjcf.forces.tolerance import tolerance_of

ALIGNMENT = 1024
"""Bytes that MuJoCo may add for frames and alignment, generously."""


@njit(forceinline=True)
def set_magnetic_wrenches(m, d, offsets, kinds, applied):
    """Overwrite the wrench of each body that can move and has dipoles.

    `m` and `d` are the words of mjModel and mjData, `offsets` is their layout, `kinds` are the bits
    of `forces_of`, and `applied` (nbody, 6) receives the wrenches. Returns the number of
    interactions, and two sites that coincide and act on each other; -1, -1 if there are none.
    """
    nsite = m[offsets.nsite // 8]
    if nsite == 0 or m[offsets.nuser_site // 8] == 0:
        return 0, -1, -1
    ntuple = m[offsets.ntuple // 8] if kinds & COUPLINGS else 0
    boundary, columns = table_size(nsite, ntuple)
    stack = d.ctypes.data
    memory.mark_stack(stack)
    block = memory.allocate(stack, 8 * (ROWS * columns + 3 * ntuple), 64)
    table = memory.numbers(block, ROWS, columns)
    couplings = memory.numbers(block + 8 * ROWS * columns, ntuple, 3)
    couplings = couplings[: read_couplings(couplings, m, offsets)]
    magnets = gather(table, boundary, couplings, m, d, offsets, applied)
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
    acting, coincident = add_dipole_wrenches(
        m.ctypes.data, stack, tolerance_of(m, offsets), table, magnets, boundary, couplings, center,
        applied,
    )  # fmt: skip
    i = j = -1
    if coincident > 0:
        i, j = _find_coincidence(couplings, m, d, offsets)
    memory.free_stack(stack)
    return acting, i, j


def stack_bytes(nsite: int, ntuple: int) -> int:
    """Return the bytes that `set_magnetic_wrenches` needs on the stack of `mjData`, at most."""
    _, columns = table_size(nsite, ntuple)
    return 8 * (ROWS * columns + 3 * ntuple) + cluster_bytes(nsite) + ALIGNMENT


@njit
def _find_coincidence(couplings, m, d, offsets):
    """Find two dipole sites that coincide and act on each other; -1, -1 if there are none."""
    nsite = m[offsets.nsite // 8]
    moment = memory.numbers(m[offsets.site_user // 8], nsite, m[offsets.nuser_site // 8])
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
    for i in range(nsite):
        for j in range(i):
            dipoles = moment[i, 0] != 0.0 and moment[j, 0] != 0.0
            gap = position[i] - position[j]
            near = np.sum(gap * gap) < COINCIDENCE_SQUARED
            a, b = weld_of[body_of[i]], weld_of[body_of[j]]
            may_act = a != b and freedoms[a] + freedoms[b] > 0
            if (
                dipoles
                and near
                and may_act
                and coupling_factor(body_of[i], body_of[j], couplings) != 0.0
            ):
                return i, j
    return -1, -1
