"""Numbers and tuples of `<custom>`, by which a model declares what MJCF has no element for.

Only the reader of a table looks at names.
"""

from typing import Any

import numpy as np

from magmotor.mjcf import memory
from magmotor.numerics.deferred import subroutine

BODY, JOINT, GEOM, SITE, ACTUATOR, SENSOR, NUMERIC, TEXT, TUPLE = 1, 3, 5, 6, 19, 20, 21, 22, 23
"""mjOBJ_BODY and so on."""

FEW, FIRST, KIND, MISNAMED, SHAPE, DELAY, PRM, REPEATED, CONTAINED, SECOND, UNPOLARIZED, ASLANT = (
    range(12)
)
"""Rules that the elements of a tuple can break; `error_sentences.py` has the sentences."""


@subroutine
def tuple_starts_with(k, prefix, m, offsets):
    """Whether the name of tuple k starts with `prefix`, a tuple of characters."""
    start = memory.integers(m[offsets.name_tupleadr // 8], memory.UNBOUNDED)
    return memory.starts_with(m[offsets.names // 8] + start[k], prefix)


@subroutine
def numeric_starts_with(k, prefix, m, offsets):
    """Whether the name of numeric k starts with `prefix`, a tuple of characters."""
    start = memory.integers(m[offsets.name_numericadr // 8], memory.UNBOUNDED)
    return memory.starts_with(m[offsets.names // 8] + start[k], prefix)


@subroutine
def numeric_named(name, m, offsets):
    """Return the first numeric with a name, a tuple of characters and 0; or -1."""
    for k in range(m[offsets.nnumeric // 8]):
        if numeric_starts_with(k, name, m, offsets):
            return k
    return -1


@subroutine
def elements_of(k, m, offsets) -> range:
    """Return the range of the elements of tuple k."""
    first = np.int64(memory.integers(m[offsets.tuple_adr // 8], memory.UNBOUNDED)[k])
    size = np.int64(memory.integers(m[offsets.tuple_size // 8], memory.UNBOUNDED)[k])
    return range(first, first + size)


@subroutine(forceinline=True)
def element(i, m, offsets):
    """Return the type, the number and the `prm` of element i of all tuples."""
    return (
        np.int64(memory.integers(m[offsets.tuple_objtype // 8], memory.UNBOUNDED)[i]),
        np.int64(memory.integers(m[offsets.tuple_objid // 8], memory.UNBOUNDED)[i]),
        memory.numbers(m[offsets.tuple_objprm // 8], 1, memory.UNBOUNDED)[0, i],
    )


@subroutine(forceinline=True)
def numbers_of(numeric, m, offsets) -> Any:
    """Return the numbers of a numeric."""
    first = memory.integers(m[offsets.numeric_adr // 8], memory.UNBOUNDED)[numeric]
    count = memory.integers(m[offsets.numeric_size // 8], memory.UNBOUNDED)[numeric]
    return memory.numbers(m[offsets.numeric_data // 8] + 8 * first, 1, count)[0]
