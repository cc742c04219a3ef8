"""The tolerance that a model declares for the forces of many magnets on one another."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from numba import njit

from magmotor.mjcf import memory

NAME = (*b"magnetic_tolerance", 0)


@njit
def tolerance_of(m, offsets):
    """Return the number of `<numeric name="magnetic_tolerance">`, or 0, which means exact."""
    k = _numeric(m, offsets)
    if k < 0:
        return 0.0
    start = memory.integers(m[offsets.numeric_adr // 8], memory.UNBOUNDED)
    return memory.numbers(m[offsets.numeric_data // 8], 1, memory.UNBOUNDED)[0, start[k]]


@njit
def invalid_tolerance(m, offsets):
    """Return the number of the tolerance's numeric if it is not one number from 0 to 0.1, or -1."""
    k = _numeric(m, offsets)
    if k < 0:
        return -1
    size = memory.integers(m[offsets.numeric_size // 8], memory.UNBOUNDED)
    return -1 if size[k] == 1 and 0.0 <= tolerance_of(m, offsets) <= 0.1 else k


@njit
def _numeric(m, offsets):
    """Return the number of the numeric that is the tolerance, or -1."""
    names, count = m[offsets.names // 8], m[offsets.nnumeric // 8]
    start = memory.integers(m[offsets.name_numericadr // 8], count)
    for k in range(count):
        if memory.starts_with(names + start[k], NAME):
            return k
    return -1
