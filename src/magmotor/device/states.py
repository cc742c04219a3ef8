"""Operations on states: named tuples of columns, with one row for each recorded time.

The first column is `time`; the first axis of every column is time. A column is None if an engine
does not compute it.
"""

import zlib
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import LARGEST

Kind = TypeVar("Kind", bound=tuple[Any, ...])


def rows(states: Kind, chosen: slice) -> Kind:
    """Return some of the rows."""
    columns: list[Any] = [None if c is None else c[chosen] for c in states]
    return type(states)(*columns)


def finite(states: tuple[Any, ...]) -> NDArray[np.bool_]:
    """Return which rows have only finite values up to 1e30 in magnitude, shape (T,)."""
    columns = [c.reshape(len(c), -1) for c in states if c is not None]
    return np.logical_and.reduce(np.abs(np.hstack(columns)) <= LARGEST, axis=1)


def checksum(states: tuple[Any, ...]) -> int:
    """Return the CRC-32 of all columns."""
    return zlib.crc32(b"".join(c.tobytes() for c in states if c is not None))


def concatenate(blocks: Sequence[Kind]) -> Kind:
    """Join blocks of states; a column that is None in one of them is None."""
    columns: list[Any] = [
        None if any(c is None for c in column) else np.concatenate(column)
        for column in zip(*blocks, strict=True)
    ]
    return type(blocks[0])(*columns)


class Column(NamedTuple):
    """Dimensions, values, unit and description of a dataset's variable."""

    dimensions: tuple[str, ...]
    values: NDArray
    unit: str
    label: str
