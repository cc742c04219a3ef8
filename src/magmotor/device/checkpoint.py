"""Checkpoints: everything that a run needs to continue, in one file that is written atomically.

The file is a line of JSON with a checksum, the bytes of the arrays, and a checksum of the whole;
see `magmotor.common.integrity`. The line has the task, the progress, and types and shapes of the
arrays. The caller of `load` states which arrays it expects, so that the file's size is known before
its content is read, and the file cannot choose how it is interpreted.
"""

import os
import stat
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError
from magmotor.common.files import whole_file
from magmotor.common.integrity import LENGTH, checksum_of, parsed, verified, with_checksum

SECONDS_BETWEEN = 30.0

LONGEST_LINE = 2**24
"""Largest length of the header in bytes; a typical one has 2000."""

LARGEST = float(np.finfo(float).max)

Arrays = Mapping[str, NDArray]


class Expected(NamedTuple):
    """An array that a checkpoint must have: type and shape of `like`, finite, and within bounds."""

    like: NDArray
    least: Any = -LARGEST
    most: Any = LARGEST


class Checkpoint:
    """The checkpoint of a run, saved periodically; without a path, nothing is saved.

    Parameters
    ----------
    path : str, Path or None
    task : dict
        Arguments of the run; a file with other arguments is refused.
    total : int
        Number of records, or of samples, in the whole run.
    expected : callable
        ``expected(done)`` returns the arrays that a file with `done` records must have, by name.

    Raises
    ------
    ValueError
        The path is not one, or its folder does not exist or is not writable.
    """

    def __init__(
        self,
        path: str | Path | None,
        task: dict[str, Any],
        total: int,
        expected: Callable[[int], Mapping[str, Expected]],
    ):
        if not isinstance(path, str | os.PathLike | None) or "\0" in str(path):
            raise ArgumentError("checkpoint", path, "must be a path or None")
        self.path = None if path is None else Path(path)
        if self.path is not None and not self.path.parent.is_dir():
            raise self._reject(f"must be in an existing folder, and {self.path.parent} is not one")
        if self.path is not None and not os.access(self.path.parent, os.W_OK):
            raise self._reject(f"cannot be saved, since {self.path.parent} is not writable")
        self.task, self.total, self.expected = task, total, expected
        self.saved_at = time.monotonic()

    @property
    def due(self) -> bool:
        """Whether half a minute has passed since the last save."""
        return self.path is not None and time.monotonic() - self.saved_at > SECONDS_BETWEEN

    def save(self, done: int, arrays: Arrays) -> None:
        """Save the number of finished records, and the arrays.

        Warns
        -----
        UserWarning
            The file cannot be written; the previous checkpoint is kept.
        """
        if self.path is None:
            return
        self.saved_at = time.monotonic()
        try:
            save(self.path, self.task, done, arrays)
        except OSError as error:
            warnings.warn(
                f"cannot save {self.path}: {error.strerror or error}; the previous checkpoint"
                " is kept",
                stacklevel=4,
            )

    def load(self) -> tuple[int, dict[str, NDArray]] | None:
        """Return the number of finished records and the arrays; None if there is no file.

        Raises
        ------
        ValueError
            The file cannot be read, is not a checkpoint, is damaged, belongs to another run, or has
            values that no run of this task can have; the message names what is wrong.
        """
        if self.path is None:
            return None
        try:
            if not stat.S_ISREG(self.path.stat().st_mode):
                raise self._reject("must be a regular file, or not exist yet")
            with self.path.open("rb") as file:
                return self._read(file)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._reject(f"cannot be read ({error.strerror})") from None

    def _reject(self, sentence: str) -> ValueError:
        return ArgumentError("checkpoint", str(self.path), sentence)

    def _read(self, file: Any) -> tuple[int, dict[str, NDArray]]:
        line = file.readline(LONGEST_LINE)
        try:
            header = verified(line)
            task, done, layout = dict(header["task"]), header["done"], header["arrays"]
        except (ValueError, TypeError, KeyError):
            raise self._reject("the file is not a checkpoint") from None
        for name in {**self.task, **task}:
            if task.get(name, ...) != self.task.get(name, ...):
                how = _difference(name, task.get(name, ...), self.task.get(name, ...))
                raise self._reject(f"the checkpoint is of another run: {how}")
        if type(done) is not int or not 0 <= done <= self.total:
            sentence = f"the number of finished records must be 0 to {self.total}, and is {done!r}"
            raise self._reject(sentence)
        expected = self.expected(done)
        wanted = _layout({name: array.like for name, array in expected.items()})
        if layout != wanted:
            raise self._reject(f"must have the arrays {wanted}, and has {layout!r:.1000}")
        sizes = [array.like.nbytes for array in expected.values()]
        if os.fstat(file.fileno()).st_size != len(line) + sum(sizes) + LENGTH:
            raise self._reject("the checkpoint is damaged: it is too short or too long")
        content = np.fromfile(file, np.uint8, sum(sizes))
        if file.read(LENGTH) != checksum_of(line, content.data):
            raise self._reject("the checkpoint is damaged: its checksum does not match")
        pieces = np.split(content, np.cumsum(sizes)[:-1])
        return done, {
            name: self._checked(name, piece, array)
            for (name, array), piece in zip(expected.items(), pieces, strict=True)
        }

    def _checked(self, name: str, piece: NDArray[np.uint8], array: Expected) -> NDArray:
        values = piece.view(array.like.dtype).reshape(array.like.shape)
        wrong = ~((array.least <= values) & (values <= array.most))  # also NaN
        if wrong.any():
            bad = values[wrong].flat[0]
            raise self._reject(f"its {name} must be finite and in bounds, and has the value {bad}")
        return values


def _difference(name: str, there: Any, here: Any) -> str:
    """Say how an argument of another run differs, or which fields of it if it is a JSON object.

    An argument that was not given is `...`.
    """
    if name == "initial":
        return "it started from another initial state"
    if here is ...:
        return f"{name} was given there only"
    if there is ...:
        return f"{name} is given here only"
    old: Any = None
    new: Any = None
    with suppress(TypeError, ValueError):
        old, new = parsed(there), parsed(here)
    fields = {**old, **new} if isinstance(old, dict) and isinstance(new, dict) else {}
    short = name.removesuffix("_fields")
    values = {f"{short}.{field}": (old.get(field, ...), new.get(field, ...)) for field in fields}
    differing = [_difference(field, *both) for field, both in values.items() if both[0] != both[1]]
    return ", ".join(differing) or f"{name} was {there!r} there and is {here!r} here"


def save(path: Path, task: dict[str, Any], done: int, arrays: Arrays) -> None:
    """Write a checkpoint; it replaces the previous file when it is complete.

    Raises
    ------
    OSError
        The file cannot be written; the previous one is kept.
    """
    line = with_checksum({"task": task, "done": done, "arrays": _layout(arrays)})
    pieces = [line, *map(_bytes, arrays.values())]
    with whole_file(path) as part, part.open("wb") as file:
        file.writelines([*pieces, checksum_of(*pieces)])


def _bytes(array: NDArray) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _layout(arrays: Arrays) -> list[list]:
    return [[name, array.dtype.str, *array.shape] for name, array in arrays.items()]
