"""What Numba meets in the code that it compiles: constants, and what stands for its own objects.

Numba passes a named tuple by value: a call has one argument for each number. With a hundred numbers
and as many functions, compiling takes most of its time for moving them. A type that knows the
numbers passes nothing, and compiled code contains each number where it is read.
"""

from typing import Any

COUNT = 8
"""Number of doubles in an `Eight`, in the widest vector and in a cache line."""


class ConstantInCode:
    """Base, before a named tuple of integers, of a class of constants in compiled code.

    Functions are compiled again for each instance that differs.
    """

    __slots__ = ()


class StandIn:
    """Base of what stands for an object of Numba, which is its attribute `real`."""

    real: Any
