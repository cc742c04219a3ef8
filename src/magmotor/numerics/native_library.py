"""The library of functions that were compiled ahead of time, if one fits the processor.

A file is an ELF object and, behind it, a description in JSON: what it was compiled from, and its
functions. Code finds MuJoCo's functions, our variables and the layout of MuJoCo's structs through
cells of the library, so that one file serves all versions of MuJoCo.
"""

import ctypes
import hashlib
import json
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from magmotor.common.exceptions import ArgumentError, MagmotorError
from magmotor.common.files import is_private
from magmotor.numerics import dependencies, symbols
from magmotor.numerics.constants import ConstantInCode

LEVELS = {"x86_64": ("x86-64-v4", "x86-64-v3"), "aarch64": ("aarch64",)}
"""Kinds of processors for which there may be libraries, best first, by machine."""

FOLDER = Path(__file__).parent / "native"
MARK = b"magmotor library"
"""Last bytes of a file, before which are the length of the description and a checksum."""

FORMAT = 1
"""Version of the description and of the functions by which Python uses a library."""

SWITCH = "MAGMOTOR_LIBRARY"
"""The environment variable that turns the library off if it is 0."""

_LENGTH, _DIGEST = 8, 32


class Version(NamedTuple):
    """The code of a function for arguments of some types; see `magmotor.numerics.native_calls`."""

    address: int
    arguments: str
    result: str


class UnfitLibraryError(MagmotorError, OSError):
    """A file cannot serve as a library, and why."""


class NativeLibrary:
    """A library that has been loaded.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    path : Path
    description : dict
        What the file says of itself.

    Raises
    ------
    UnfitLibraryError
        The file is damaged, foreign, of another format or for another machine, or users who cannot
        write to the package can write to it, or others use it in this process.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.description = path, described(path)
        try:
            with _registering_nothing():
                self._c = ctypes.CDLL(str(path))
        except OSError as error:
            raise UnfitLibraryError(str(error)) from error
        if self._c.magmotor_is_registered():
            raise UnfitLibraryError("a program that embeds Python uses it as a plugin")
        self._c.magmotor_function.restype = ctypes.c_void_p
        self._c.magmotor_bind.argtypes = ctypes.c_char_p, ctypes.c_void_p
        self._offsets: tuple | None = None
        self._functions: dict[str, dict] = self.description["functions"]

    def runs_here(self) -> bool:
        """Whether the processor has all instructions of the code."""
        return bool(self._c.magmotor_is_supported())

    def bind(self, symbol: str, address: int) -> None:
        """Let the code find what a symbol stands for, if it has that symbol."""
        self._c.magmotor_bind(symbol.encode(), address)

    def has_name(self, define: Any, by: Sequence[Any]) -> bool:
        """Whether there is a function of that name, be it of other sources."""
        return name_of(define, by) in self._functions

    def versions(self, define: Any, by: Sequence[Any]) -> list[Version]:
        """Return the versions of a function with these cells; none if it was made from others."""
        found = self._functions.get(name_of(define, by))
        if found is None or not all(self._agrees(value) for value in by):
            return []
        if found["checksum"] != dependencies.checksum_of(define):
            return []
        return [
            Version(self._c.magmotor_function(number), arguments, result)
            for number, arguments, result in found["versions"]
        ]

    def _agrees(self, value: Any) -> bool:
        """Whether a layout is the one that the library has; the first one is."""
        if not isinstance(value, ConstantInCode):
            return True
        numbers: Any = value
        if self._offsets is None and list(numbers._fields) == self.description["offsets"]:
            self._c.magmotor_set_offsets((ctypes.c_int64 * len(numbers))(*numbers))
            self._offsets = numbers
        return self._offsets == numbers


@contextmanager
def _registering_nothing() -> Iterator[None]:
    """Let a library that is loaded in the block register no plugins with MuJoCo; Python does it."""
    before = os.environ.get(SWITCH)
    os.environ[SWITCH] = "0"
    try:
        yield
    finally:
        del os.environ[SWITCH]
        os.environ |= {} if before is None else {SWITCH: before}


def name_of(define: Any, by: Sequence[Any]) -> str:
    """Return the name of a function in a library: that of what defines it, and its other cells."""
    cells = [value for value in by if not isinstance(value, ConstantInCode)]
    return f"{define.__module__}.{define.__qualname__}{(*cells,)}"


def described(path: Path, machine: str = platform.machine()) -> dict[str, Any]:
    """Return the description of a library for a machine, without running anything of it.

    Raises
    ------
    UnfitLibraryError
        See `NativeLibrary`.
    """
    try:
        # Who can change the package has more than its library.
        if hasattr(os, "getuid") and not is_private(str(path), like=__file__):
            raise UnfitLibraryError("others can write to it")
        content = path.read_bytes()
    except OSError as error:
        raise UnfitLibraryError(error.strerror or str(error)) from error
    body, digest = content[: -_DIGEST - len(MARK)], content[-_DIGEST - len(MARK) : -len(MARK)]
    if not content.endswith(MARK) or hashlib.sha256(body).digest() != digest:
        raise UnfitLibraryError("it is damaged, or no library of magmotor")
    size = int.from_bytes(body[-_LENGTH:], "little")
    description = json.loads(body[-_LENGTH - size : -_LENGTH])
    if description["format"] != FORMAT:
        raise UnfitLibraryError(f"its format is {description['format']} instead of {FORMAT}")
    if description["machine"] != machine:
        raise UnfitLibraryError(f"it is for {description['machine']}")
    return description


def with_description(content: bytes, description: dict[str, Any]) -> bytes:
    """Return the content of a file, with its description."""
    text = json.dumps(description, sort_keys=True).encode()
    body = content + text + len(text).to_bytes(_LENGTH, "little")
    return body + hashlib.sha256(body).digest() + MARK


@cache
def library() -> NativeLibrary | None:
    """Return the best library that fits the processor; None without one.

    A file that is unfit for another reason is named on stderr.

    Raises
    ------
    ArgumentError
        The environment variable that can turn it off is neither 0 nor 1.
    """
    mode = os.environ.get(SWITCH) or "1"
    if mode not in ("0", "1"):
        raise ArgumentError(SWITCH, mode, "must be 0 or 1, in the environment")
    if sys.platform != "linux" or mode == "0":
        return None
    for level in LEVELS.get(platform.machine(), ()):
        path = FOLDER / f"libmagmotor-{level}.so"
        if not path.exists():
            continue
        try:
            found = NativeLibrary(path)
        except UnfitLibraryError as error:
            print(f"magmotor: {path} is not used: {error}", file=sys.stderr)
            continue
        if found.runs_here():
            symbols.bind_in(found)
            return found
    return None


def versions(define: Any, by: Sequence[Any]) -> list[Version]:
    """Return the versions of a function in the library, if that has it."""
    found = library()
    return found.versions(define, by) if found else []


def has_changed(define: Any, by: Sequence[Any]) -> bool:
    """Whether the library has a function, but it was made from other sources."""
    found = library()
    return found is not None and found.has_name(define, by) and not found.versions(define, by)
