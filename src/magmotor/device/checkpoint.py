"""Checkpoints: all that a run needs to go on, in one file that is whole or not there.

The file is a line and the bytes of the arrays, one after another. The line is a mark, a checksum of
what follows it, and JSON: the task, how much of it is done, the kinds and shapes of the arrays, and
the checksum of their bytes. Whoever loads one says what has to be in it. So its size is known
before any of it is read, and nothing in it has a meaning that it could choose.
"""

import json
import os
import stat
import time
import warnings
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.common.files import whole_file

SECONDS_BETWEEN = 30.0

MARK = b"magmotor checkpoint"

LONGEST_LINE = 2**24
"""Bytes; a task takes some 2000."""

LARGEST = float(np.finfo(float).max)

Arrays = Mapping[str, NDArray]


class Expected(NamedTuple):
    """What an array of a checkpoint must be: as `like` in kind and shape, finite and in bounds."""

    like: NDArray
    least: Any = -LARGEST
    most: Any = LARGEST


class Checkpoint:
    """The checkpoint of a task, written now and then; without a path, nothing is.

    Parameters
    ----------
    path : str, Path or None
    task : dict
        What the run is to do; a file with another task is refused.
    total : int
        How much there is to do: records, or samples.
    expected : callable
        From how much is done, the arrays that there must be.
    """

    def __init__(
        self,
        path: str | Path | None,
        task: dict[str, Any],
        total: int,
        expected: Callable[[int], Mapping[str, Expected]],
    ):
        if not isinstance(path, str | os.PathLike | None) or "\0" in str(path):
            raise reject("checkpoint", path, "must be a path, or None")
        self.path = None if path is None else Path(path)
        self.task, self.total, self.expected = task, total, expected
        self.saved_at = time.monotonic()

    @property
    def due(self) -> bool:
        """Whether the last one was half a minute ago."""
        return self.path is not None and time.monotonic() - self.saved_at > SECONDS_BETWEEN

    def save(self, done: int, arrays: Arrays) -> None:
        """Save how much is done, and these arrays.

        Warns
        -----
        UserWarning
            They cannot be written; the checkpoint before them stays.
        """
        if self.path is None:
            return
        self.saved_at = time.monotonic()
        try:
            save(self.path, self.task, done, arrays)
        except OSError as error:
            warnings.warn(
                f"no checkpoint {self.path}: {error.strerror or error}; the one before it stays",
                stacklevel=4,
            )

    def load(self) -> tuple[int, dict[str, NDArray]] | None:
        """How much was done, and the arrays saved last; None if there is no file.

        Raises
        ------
        ValueError
            It cannot be read, is no checkpoint or a damaged one, is one of another task, or holds
            what a run of this task cannot have: names what differs.
        """
        if self.path is None:
            return None
        try:
            if not stat.S_ISREG(self.path.stat().st_mode):
                raise self._reject("must be a file, or no file")
            with self.path.open("rb") as file:
                return self._read(file)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._reject(f"must be a file ({error.strerror})") from None

    def _reject(self, sentence: str) -> ValueError:
        return reject("checkpoint", str(self.path), sentence)

    def _read(self, file: Any) -> tuple[int, dict[str, NDArray]]:
        line = file.readline(LONGEST_LINE)
        text = line[len(_marked(b"")) :]
        try:
            head = json.loads(text) if line == _marked(text) + text else {}
            recorded, done = dict(head["task"]), head["done"]
            given, checksum = head["arrays"], head["checksum"]
        except (ValueError, TypeError, KeyError, RecursionError):
            raise self._reject("must be a checkpoint, or no file") from None
        for name in {**recorded, **self.task}:
            if recorded.get(name, ...) != self.task.get(name, ...):
                sentence = (
                    f"its {name} is {recorded.get(name)!r}, and must be {self.task.get(name)!r}"
                )
                raise self._reject(sentence)
        if type(done) is not int or not 0 <= done <= self.total:
            raise self._reject(
                f"must be one of which 0 to {self.total} records are done; it has {done!r}"
            )
        expected = self.expected(done)
        wanted = _layout({name: array.like for name, array in expected.items()})
        if given != wanted:
            raise self._reject(f"must be one with the arrays {wanted}; it has {given!r:.1000}")
        sizes = [array.like.nbytes for array in expected.values()]
        if os.fstat(file.fileno()).st_size != len(line) + sum(sizes):
            raise self._reject("must be whole; this one is damaged: it is too short or too long")
        content = np.fromfile(file, np.uint8)
        if zlib.crc32(content.data) != checksum:
            raise self._reject("must be whole; this one is damaged: its checksum is another")
        pieces = np.split(content, np.cumsum(sizes)[:-1])
        return done, {
            name: self._checked(name, piece, array)
            for (name, array), piece in zip(expected.items(), pieces, strict=True)
        }

    def _checked(self, name: str, piece: NDArray[np.uint8], array: Expected) -> NDArray:
        values = piece.view(array.like.dtype).reshape(array.like.shape)
        wrong = ~((array.least <= values) & (values <= array.most))  # NaN is
        if wrong.any():
            sentence = f"its {name} must be finite and in bounds, and holds {values[wrong].flat[0]}"
            raise self._reject(sentence)
        return values


def save(path: Path, task: dict[str, Any], done: int, arrays: Arrays) -> None:
    """Write a checkpoint; the file before it stays until the new one is whole.

    Raises
    ------
    OSError
        The file cannot be written; the checkpoint before it is still there.
    """
    checksum = 0
    for array in arrays.values():
        checksum = zlib.crc32(_bytes(array), checksum)
    head = {"task": task, "done": done, "arrays": _layout(arrays), "checksum": checksum}
    text = json.dumps(head).encode() + b"\n"
    with whole_file(path) as part, part.open("wb") as file:
        file.write(_marked(text) + text)
        for array in arrays.values():
            file.write(_bytes(array))


def _marked(text: bytes) -> bytes:
    return MARK + b" %08x " % zlib.crc32(text)


def _bytes(array: NDArray) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _layout(arrays: Arrays) -> list[list]:
    return [[name, array.dtype.str, *array.shape] for name, array in arrays.items()]
