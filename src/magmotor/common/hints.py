"""Annotations for type hints: bounds, shapes, choices and files.

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
)
from magmotor.common.exceptions import ArgumentError

Check = Callable[[str, Any], Any]
"""Returns the value of a named argument, perhaps converted, or raises ValueError."""


class Described:
    """A check that `help` shows as a text, in the signature of a function."""

    def __init__(self, text: str, check: Check):
        self._text, self._check = text, check

    def __call__(self, name: str, value: Any) -> Any:
        """Return the value, perhaps converted; raise ValueError if the check fails."""
        return self._check(name, value)

    def __repr__(self) -> str:
        return self._text


def _within(what: str, bounds: dict[str, Any]) -> str:
    """Return a text for bounds, such as "number, at_least 0 s"."""
    unit = f" {bounds['unit']}" if "unit" in bounds else ""
    limits = [f"{name} {value}{unit}" for name, value in bounds.items() if name != "unit"]
    return ", ".join([what, *limits]).replace("at_", "at ")


def number(**bounds: Any) -> Check:
    """A number inside the bounds of `check_number`."""
    return Described(_within("number", bounds), partial(check_number, **bounds))


def fraction(**bounds: Any) -> Check:
    """A fraction inside the bounds of `check_number`, which might be mistaken for a percentage."""
    return number(**bounds, unit="(a fraction: 0.01 is 1 %)")


def integer(**bounds: Any) -> Check:
    """An integer inside the bounds of `check_integer`."""
    return Described(_within("integer", bounds), partial(check_integer, **bounds))


class Shaped(NamedTuple):
    """A check of an array and its shape; the shapes of all arguments of a call must be consistent.

    A named length must be the same in all arguments, and the axes that `...` stands for must
    broadcast.
    """

    shape: tuple[Any, ...]
    check: Callable[..., Any]

    def __call__(self, name: str, value: Any) -> Any:
        """Return the array; raise ValueError if the check fails."""
        return self.check(name, value, *self.shape)

    def __repr__(self) -> str:
        return f"shape ({', '.join('...' if n is ... else str(n) for n in self.shape)})"


def shaped(*shape: Any) -> Check:
    """An array of finite numbers; see `check_array` for `shape`."""
    return Shaped(shape, check_array)


def floats(*shape: Any) -> Check:
    """An array of numbers, finite or not; see `check_array` for `shape`."""
    return Shaped(shape, check_floats)


def positive_definite(*shape: Any) -> Check:
    """A symmetric matrix whose eigenvalues are positive; see `check_array` for `shape`."""

    def check(name: str, value: Any, *shape: Any) -> Any:
        matrix = check_array(name, value, *shape)
        if not matrix.size:
            raise ArgumentError(f"shape of {name}", matrix.shape, "the matrix must not be empty")
        check_number(f"smallest eigenvalue of {name}", np.linalg.eigvalsh(matrix)[0], above=0)
        return matrix

    return Shaped(shape, check)


def flags(*shape: Any) -> Check:
    """An array of booleans; see `check_array` for `shape`."""
    return Shaped(shape, check_flags)


def numbers(*shape: Any, **bounds: Any) -> Check:
    """An array of numbers inside the bounds of `check_number`, of any shape unless one is given."""

    def check(name: str, value: Any, *shape: Any) -> Any:
        array = check_array(name, value, *shape)
        if array.size:
            for i in (array.argmin(), array.argmax()):
                place = "".join(f"[{k}]" for k in np.unravel_index(i, array.shape))
                check_number(f"{name}{place}", float(array.flat[i]), **bounds)
        return array

    return Shaped(shape, check) if shape else Described(_within("numbers", bounds), check)


def choice(*choices: str) -> Check:
    """One of the given names."""

    def check(name: str, value: Any) -> Any:
        check_choice(name, value, choices)
        return value

    return Described(f"one of {', '.join(choices)}", check)


def several(cls: type) -> Check:
    """A sequence of at least one instance of a class."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, Sequence) or isinstance(value, str | bytes) or not len(value):
            raise ArgumentError(name, value, f"must be a sequence of at least one {cls.__name__}")
        for i, element in enumerate(value):
            check_type(f"{name}[{i}]", element, cls)
        return value

    return Described(f"at least one {cls.__name__}", check)


def output(*suffixes: str) -> Check:
    """A path to which a file can be written, ending in one of the suffixes if any are given."""

    def check(name: str, value: Any) -> Any:
        path = Path(check_path(name, value))
        if suffixes and path.suffix.lower() not in suffixes:
            ends = "one of " * (len(suffixes) > 1) + ", ".join(suffixes)
            raise ArgumentError(name, value, f"must be a file name that ends in {ends}")
        if path.is_dir():
            raise ArgumentError(name, value, "must be a file, not a folder")
        if not path.parent.is_dir():
            raise ArgumentError(name, value, "must be in an existing folder")
        return path  # without a trailing slash, which others take for an extension

    return Described(f"file {' or '.join(suffixes)}".rstrip(), check)


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
"""The file to which a picture is written."""
STILLS = tuple(kind for kind in PICTURES if kind != ".svg")
Still = Annotated[str | Path, output(*STILLS)]
"""The file to which a picture of pixels is written."""
Dpi = Annotated[int, integer(at_least=10, at_most=2400)]
"""Dots per inch of a picture."""


def check_path(name: str, value: Any) -> Any:
    """Return a value if it is a path: a string or a `pathlib.Path`; else raise ValueError."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        raise ArgumentError(name, value, "must be a path: a string or a pathlib.Path")
    return value
