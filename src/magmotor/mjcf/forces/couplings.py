"""Couplings: tuples of two bodies that scale the interaction of the bodies' magnets.

A tuple whose name starts with `coupling` and whose elements are two bodies scales the interaction
by `prm`, which must be the same for both elements. It applies to the named bodies only, not to
bodies welded to them. The factors of several tuples for one pair multiply.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import njit

from magmotor.mjcf import memory

COUPLING = tuple(b"coupling")

BODY_TYPE = 1
"""mjOBJ_BODY."""


@njit
def read_couplings(couplings, m, offsets):
    """Write one row for each coupling, two bodies and a factor; return their number."""
    ntuple = len(couplings)
    start = memory.integers(m[offsets.tuple_adr // 8], ntuple)
    element = memory.integers(m[offsets.tuple_objid // 8], memory.UNBOUNDED)
    strength = memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)
    count = 0
    for k in range(ntuple):
        if _is_coupling(k, m, offsets):
            i = start[k]
            couplings[count, 0], couplings[count, 1] = element[i], element[i + 1]
            couplings[count, 2] = strength[0, i]
            count += 1
    return count


@njit
def is_coupled(body, couplings):
    """Whether any coupling names the body."""
    coupled = False
    for k in range(len(couplings)):
        coupled = coupled or couplings[k, 0] == body or couplings[k, 1] == body
    return coupled


@njit
def coupling_factor(body, other, couplings):
    """Return the factor by which couplings scale the interaction of two bodies."""
    factor = 1.0
    for k in range(len(couplings)):
        a, b = couplings[k, 0], couplings[k, 1]
        if (a == body and b == other) or (a == other and b == body):
            factor *= couplings[k, 2]
    return factor


@njit
def invalid_coupling(m, offsets):
    """Return the first coupling that is not of two bodies with equal and finite `prm`, or -1."""
    ntuple = m[offsets.ntuple // 8]
    size = memory.integers(m[offsets.tuple_size // 8], ntuple)
    start = memory.integers(m[offsets.tuple_adr // 8], ntuple)
    kind = memory.integers(m[offsets.tuple_objtype // 8], memory.UNBOUNDED)
    strength = memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)
    for k in range(ntuple):
        if _is_coupling(k, m, offsets):
            i, j = start[k], start[k] + 1
            bodies = size[k] == 2 and kind[i] == BODY_TYPE and kind[j] == BODY_TYPE
            if not (bodies and strength[0, i] == strength[0, j] and abs(strength[0, i]) < np.inf):
                return k
    return -1


@njit
def _is_coupling(k, m, offsets):
    """Whether the name of tuple k starts with `coupling`."""
    start = memory.integers(m[offsets.name_tupleadr // 8], memory.UNBOUNDED)
    return memory.starts_with(m[offsets.names // 8] + start[k], COUPLING)
