"""What type hints say of arguments beyond their types: bounds, shapes, choices, files.

`magmotor.common.arguments` reads them from the signatures of public functions.
"""

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import (
    check_array,
    check_choice,
    check_flags,
    check_floats,
    check_integer,
    check_number,
    check_type,
    reject,
)

Check = Callable[[str, Any], Any]
"""Returns the value of a named argument, perhaps as another type, or raises ValueError."""


def number(**bounds: Any) -> Check:
    """A number inside the bounds of `check_number`."""
    return partial(check_number, **bounds)


def integer(**bounds: Any) -> Check:
    """An integer inside the bounds of `check_integer`."""
    return partial(check_integer, **bounds)


class Shaped(NamedTuple):
    """A check of an array's shape; the shapes of all arguments of a call must agree.

    The name of a length stands for the same length in each, and the axes in the place of `...` must
    broadcast.
    """

    shape: tuple[Any, ...]
    of_kind: Callable[..., Any]

    def __call__(self, name: str, value: Any) -> Any:
        """Return the array; ValueError if it is none of this shape."""
        return self.of_kind(name, value, *self.shape)


def shaped(*shape: Any) -> Check:
    """An array of numbers of a shape, as `check_array` has it."""
    return Shaped(shape, check_array)


def floats(*shape: Any) -> Check:
    """An array of numbers of a shape, finite or not, as `check_floats` has it."""
    return Shaped(shape, check_floats)


def positive_definite(*shape: Any) -> Check:
    """A matrix of such a shape, whose eigenvalues are positive."""

    def check(name: str, value: Any, *shape: Any) -> Any:
        matrix = check_array(name, value, *shape)
        if not matrix.size:
            raise reject(f"shape of {name}", matrix.shape, "must be of a matrix that is not empty")
        check_number(f"smallest eigenvalue of {name}", np.linalg.eigvalsh(matrix)[0], above=0)
        return matrix

    return Shaped(shape, check)


def flags(*shape: Any) -> Check:
    """An array of booleans of a shape, as `check_array` has it."""
    return Shaped(shape, check_flags)


def numbers(*shape: Any, **bounds: Any) -> Check:
    """An array of numbers, of a shape if one is given, all inside the bounds of `check_number`."""

    def check(name: str, value: Any, *shape: Any) -> Any:
        array = check_array(name, value, *shape)
        if array.size:
            check_number(f"smallest {name}", float(array.min()), **bounds)
            check_number(f"largest {name}", float(array.max()), **bounds)
        return array

    return Shaped(shape, check) if shape else check


def choice(*choices: str) -> Check:
    """One of some names."""

    def check(name: str, value: Any) -> Any:
        check_choice(name, value, choices)
        return value

    return check


def several(kind: type) -> Check:
    """A sequence of at least one object of a class."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, Sequence) or isinstance(value, str | bytes) or not len(value):
            raise reject(name, value, f"must be a sequence of at least one {kind.__name__}")
        for i, element in enumerate(value):
            check_type(f"{name}[{i}]", element, kind)
        return value

    return check


def output(*suffixes: str) -> Check:
    """A path to which a file can be written, with one of these suffixes if any are given."""

    def check(name: str, value: Any) -> Any:
        path = Path(check_path(name, value))
        if suffixes and path.suffix.lower() not in suffixes:
            raise reject(name, value, f"must be a file name that ends in {' or '.join(suffixes)}")
        if path.is_dir():
            raise reject(name, value, "must be a file: this is a directory")
        if not path.parent.is_dir():
            raise reject(name, value, "must be in a directory that exists")
        return path  # without a slash at its end, which others take for an extension

    return check


Positive = Annotated[float, number(above=0)]
Seconds = Annotated[float, number(above=0, unit="s")]
NotNegative = Annotated[float, number(at_least=0)]
Seed = Annotated[int, integer(at_least=0)]
Count = Annotated[int, integer(at_least=1, at_most=10**8)]
Times = Annotated[ArrayLike, numbers(above=0)]
Elapsed = Annotated[ArrayLike, numbers(at_least=0)]
Points = Annotated[ArrayLike, shaped(..., 3)]
Vectors = Annotated[NDArray[np.float64], shaped(..., 3)]
Fractions = Annotated[NDArray[np.float64], numbers(at_least=0, below=1)]
Square = Annotated[NDArray[np.float64], shaped("n", "n")]
Inertia = Annotated[NDArray[np.float64], positive_definite("n", "n")]
PICTURES = (".eps", ".jpeg", ".jpg", ".pdf", ".png", ".svg", ".tif", ".tiff", ".webp")
Picture = Annotated[str | Path, output(*PICTURES)]
"""A file that a picture is written to."""


def check_path(name: str, value: Any) -> Any:
    """Return a value if it is a path: text or a `pathlib.Path`; ValueError if it is none."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        raise reject(name, value, "must be a path: text or pathlib.Path")
    return value
