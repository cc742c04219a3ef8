"""States: what engines exchange with the front door, one row a recorded time.

Each kind is a named tuple of columns whose first is `time`; the first axis of every column is time,
and a column is None where an engine does not follow it.
"""

import zlib
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import LARGEST

Kind = TypeVar("Kind", bound=tuple[Any, ...])


def rows(states: Kind, chosen: slice) -> Kind:
    """Some of the rows."""
    columns: list[Any] = [None if c is None else c[chosen] for c in states]
    return type(states)(*columns)


def finite(states: tuple[Any, ...]) -> NDArray[np.bool_]:
    """Which rows hold finite values only, none of them huge."""
    columns = [c.reshape(len(c), -1) for c in states if c is not None]
    return np.logical_and.reduce(np.abs(np.hstack(columns)) <= LARGEST, axis=1)


def checksum(states: tuple[Any, ...]) -> int:
    """Of all that the rows hold, to the bit."""
    return zlib.crc32(b"".join(c.tobytes() for c in states if c is not None))


def concatenate(blocks: Sequence[Kind]) -> Kind:
    """One block of states from several, with the columns that all of them have."""
    columns: list[Any] = [
        None if any(c is None for c in column) else np.concatenate(column)
        for column in zip(*blocks, strict=True)
    ]
    return type(blocks[0])(*columns)


class Column(NamedTuple):
    """Dimensions, values, unit and description of a variable."""

    dimensions: tuple[str, ...]
    values: NDArray
    unit: str
    label: str
