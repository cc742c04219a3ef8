"""Room for compiled loops: whole vectors, on cache lines of their own."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np
from numba import njit

from magmotor.eights import COUNT


@njit(inline="always")
def aligned(count):
    """Room for so many doubles, from the start of a cache line on and shared with nobody.

    Vectors across two lines are slow, and so is a line that two threads use.
    """
    room = np.empty(count + 2 * COUNT)
    start = -(room.ctypes.data // 8) % COUNT
    return room[start : start + count]


@njit(inline="always")
def copy(target, source):
    """Copy as many numbers as the target holds.

    An assignment of arrays compiles Numba's message about shapes that differ, too, for seconds.
    """
    for i in range(len(target)):
        target[i] = source[i]
