"""Arrays in compiled code: one that starts a cache line, and a copy."""

import numpy as np

from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine


@subroutine(forceinline=True)
def aligned(count):
    """Return an uninitialized array of doubles that starts a cache line and shares none.

    Vectors that straddle two cache lines are slow, and so is a line that two threads use.
    """
    room = np.empty(count + 2 * COUNT)
    start = -(room.ctypes.data // 8) % COUNT
    return room[start : start + count]


@subroutine(forceinline=True)
def copy(target, source):
    """Copy numbers until the target is full.

    It compiles seconds faster than an array assignment, which includes an error about shapes.
    """
    for i in range(len(target)):
        target[i] = source[i]
