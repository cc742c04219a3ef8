"""Calls of functions that were compiled ahead of time, with arguments as Numba passes them.

Numba divides arrays and tuples into words. So do these calls, which also decide by the types of the
arguments which compiled version of a function they need.
"""

import ctypes
import struct
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from magmotor.numerics.native_library import Version

_CALL = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_char_p, ctypes.c_void_p)
_SIGNED, _UNSIGNED, _FLOAT = struct.Struct("<q"), struct.Struct("<Q"), struct.Struct("<d")
_SCALARS: dict[type, tuple[str, struct.Struct]] = {
    int: ("q", _SIGNED),
    bool: ("?", _SIGNED),
    float: ("d", _FLOAT),
    np.bool_: ("?", _SIGNED),
    np.int32: ("i", _SIGNED),
    np.int64: ("q", _SIGNED),
    np.longlong: ("q", _SIGNED),
    np.uint64: ("Q", _UNSIGNED),
    np.ulonglong: ("Q", _UNSIGNED),
    np.float64: ("d", _FLOAT),
}
"""The letters of types, which are those of `struct`, and how their numbers are packed."""

_NOTHING = (object(), "", b"")
"""Stands for an argument that is packed anew."""


class NativeFunction:
    """A function in a library that Python calls.

    Parameters
    ----------
    versions : iterable of Version
        The versions of the function, for arguments of different types.
    """

    def __init__(self, versions: Iterable[Version]) -> None:
        self._versions = {
            version.arguments: (_CALL(version.address), struct.Struct(version.result))
            for version in versions
        }
        self._last: tuple = ()

    def call_with(self, arguments: tuple) -> Callable[[], Any] | None:
        """Return what calls the version for some arguments, or None if there is none.

        The call releases the GIL, and returns the result; it raises ZeroDivisionError if the code
        divided by zero where that is an error.
        """
        if not self._versions:
            return None
        last, packed = self._last, []
        for k, argument in enumerate(arguments):
            if k < len(last) and last[k][0] is argument:
                packed.append(last[k])
            else:
                packed.append((argument, *_packed(argument)))
        found = self._versions.get(",".join([kind for _, kind, _ in packed]))
        if found is None:
            return None
        # Tuples of arrays are the same in many calls, and their arrays are never resized; a single
        # array may be large, and is not kept.
        self._last = tuple([p if isinstance(p[0], tuple) else _NOTHING for p in packed])
        return partial(_call, *found, b"".join([words for _, _, words in packed]))


def _call(function: Any, result: struct.Struct, words: bytes) -> Any:
    room = ctypes.create_string_buffer(max(result.size, 8))  # a null pointer is no result
    if function(words, room) != 0:
        raise ZeroDivisionError("compiled code divided by zero")
    found = result.unpack_from(room)
    return found[0] if len(found) == 1 else (found or None)


def _packed(value: Any) -> tuple[str, bytes]:
    """Return the kind of an argument, and its words."""
    scalar = _SCALARS.get(type(value))
    if scalar is not None:
        letter, words = scalar
        if letter == "q" and value >= 1 << 63:
            letter, words = "Q", _UNSIGNED
        if letter in "qQ" and not -(1 << 63) <= value < 1 << 64:
            raise OverflowError(f"{value} has more than 64 bits")
        return letter, words.pack(int(value) if letter == "?" else value)
    if isinstance(value, np.ndarray) and value.flags.aligned and value.dtype.isnative:
        flags = value.flags
        layout = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
        access = "" if flags.writeable else "r"
        kind = f"{value.dtype.char}{value.ndim}{layout}{access}"
        words = (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
        return kind, struct.pack(f"<{len(words)}q", *words)
    if isinstance(value, tuple):
        parts = [_packed(part) for part in value]
        return f"({','.join([kind for kind, _ in parts])})", b"".join([words for _, words in parts])
    return ("NoneType", bytes(8)) if value is None else ("of another type", b"")
