"""What a compiled function depends on: functions that it calls, and constants that it reads.

None of it needs Numba.
"""

import inspect
import sys
import zlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np

from magmotor.numerics.deferred import Deferred, External, Intrinsic, Subroutine

CONSTANTS = (
    bool, int, float, complex, str, bytes, tuple, frozenset, np.generic, np.ndarray, np.dtype,
)  # fmt: skip
"""Types of values that Numba freezes into the code."""


class Defined(NamedTuple):
    """A function that another one, `define`, has defined for a checksum and for what is in `by`."""

    define: Callable
    by: tuple
    checksum: int
    function: FunctionType


def defined(define: Callable, by: tuple) -> Defined:
    """Let `define` define a function for the checksum of what that depends on.

    Raises
    ------
    TypeError
        The function does not refer to `checksum`.
    """
    checksum = checksum_of(define)
    function = define(checksum, *by)
    if "checksum" not in function.__code__.co_freevars:
        raise TypeError(f"{function.__qualname__} does not refer to its checksum")
    return Defined(define, by, checksum, function)


def checksum_of(function: Callable) -> int:
    """Return a checksum of the modules and constants that a function depends on."""
    modules, constants = reached(function)
    sources = [inspect.getsource(sys.modules[name]) for name in sorted(modules)]
    return zlib.crc32("".join([*sources, *sorted(constants), *_compiler()]).encode())


@cache
def _compiler() -> list[str]:
    """Return the sources of what all compiled code depends on, without importing Numba."""
    here = Path(__file__).parent
    files = [here / "constants.py", here / "deferred.py", *sorted((here / "compiler").glob("*.py"))]
    return [path.read_text(encoding="utf-8") for path in files]


def reached(function: Callable) -> tuple[set[str], set[str]]:
    """Return the modules and constants that a function depends on, directly or indirectly.

    The modules are names of those with code or types that it uses; the constants are text, with the
    name of the module that reads or holds them, as are signatures of functions that are compiled by
    themselves, and the constants in the closures of others. Of other packages than magmotor and the
    function's own, only subroutines are considered.
    """
    modules, constants = set(), set()
    for one, values in _functions(function):
        modules.add(one.__module__)
        for name, value in values:
            if isinstance(value, CONSTANTS):
                constants.add(_noted(one, name, value))
            elif isinstance(value, External | Intrinsic):
                constants.add(f"{name} = {value.text}")
            elif _is_of_package(value, function):
                kind = value if isinstance(value, type | FunctionType) else type(value)
                modules.add(kind.__module__)
    return modules, constants


def are_unchanged(function: Callable) -> bool:
    """Whether no constant that a function depends on has had two values in this process.

    Otherwise, its code may have another value than its checksum, or a subroutine in memory has.
    """
    reached(function)
    return not any(one in _changed for one, _ in _functions(function))


def note(function: Callable) -> None:
    """Note the constants that a function reads while it is compiled."""
    for name, value in _values(function):
        if isinstance(value, CONSTANTS):
            _noted(function, name, value)


_first: dict[tuple[Callable, str], str] = {}
"""What constants were when they were first seen, by their readers and names."""

_changed: set[Callable] = set()
"""The readers of constants that have changed."""


def _noted(reader: Callable, name: str, value: Any) -> str:
    """Return a constant with its name as text, which is compared with the one that was first."""
    text = f"{name} = {_text(value)}"
    if _first.setdefault((reader, name), text) != text:
        _changed.add(reader)
    return text


def _functions(function: Callable) -> Iterator[tuple[Any, list[tuple[str, Any]]]]:
    """Yield the functions that a function depends on, and itself, with what each refers to."""
    seen, pending = {function}, [function]
    while pending:
        one: Any = pending.pop()
        values = []
        for name, value in _values(one):
            found: Any = inspect.unwrap(value) if callable(value) else value
            values.append((name, found))
            # Whatever package has a subroutine, its code becomes part of the caller's.
            follows = isinstance(value, Deferred) or _is_of_package(found, function)
            if isinstance(found, FunctionType) and follows and found not in seen:
                seen.add(found)
                pending.append(found)
        yield one, values


def _is_of_package(value: Any, function: Callable) -> bool:
    packages = {"magmotor", function.__module__.partition(".")[0]}
    return (getattr(value, "__module__", None) or "").partition(".")[0] in packages


def subroutines_of(*functions: Callable) -> set[Callable]:
    """Return the subroutines of compiled functions, and of those that Python functions call."""
    found, seen, pending = set(), set(), [inspect.unwrap(function) for function in functions]
    while pending:
        one = pending.pop()
        seen.add(one)
        for _, value in _values(one):
            if isinstance(value, Deferred) and not isinstance(value, Subroutine):
                continue
            if isinstance(value, Subroutine) or hasattr(value, "is_cached"):
                called = inspect.unwrap(value)
                pending += [called] * (called not in seen)
                found |= {called} if isinstance(value, Subroutine) else set()
    return found


def _values(function: Any) -> Iterator[tuple[str, Any]]:
    """Yield cells and global values of a function, also through modules, with full names."""
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield f"{function.__qualname__}.{name}", cell.cell_contents
    names = set(_names(function.__code__))
    read = {name: function.__globals__[name] for name in names & function.__globals__.keys()}
    modules, pending = set(), [(function.__module__, read)]
    while pending:
        where, values = pending.pop()
        for name, value in values.items():
            if not isinstance(value, ModuleType):
                yield f"{where}.{name}", value
            elif value not in modules:
                modules.add(value)
                found = {n: getattr(value, n) for n in names if hasattr(value, n)}
                pending.append((value.__name__, found))


def _text(value: Any) -> str:
    """Return a text that two constants share only if they are equal, unlike the repr of arrays."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_text, value))})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype!r} {value.shape} {value.tobytes().hex()}"
    return repr(value)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
