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

CONSTANTS = (bool, int, float, complex, str, bytes, tuple, frozenset, np.generic, np.ndarray)
"""Types of global values that Numba freezes into the code."""


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
    themselves, and the constants in the closures of others. Only magmotor and the function's own
    package are considered.
    """
    packages = {"magmotor", function.__module__.partition(".")[0]}
    modules, constants, seen, pending = set(), set(), set(), [function]
    while pending:
        one = pending.pop()
        seen.add(one)
        modules.add(one.__module__)
        for name, cell in zip(one.__code__.co_freevars, one.__closure__ or (), strict=True):
            if isinstance(cell.cell_contents, CONSTANTS):
                constants.add(f"{one.__qualname__}.{name} = {_text(cell.cell_contents)}")
        for name, value in _globals(one):
            found: Any = inspect.unwrap(value) if callable(value) else value
            if isinstance(found, CONSTANTS):
                constants.add(f"{name} = {_text(found)}")
            elif isinstance(found, External | Intrinsic):
                constants.add(f"{name} = {found.text}")
            elif getattr(found, "__module__", "").partition(".")[0] not in packages:
                continue
            elif isinstance(found, FunctionType):
                pending += [found] * (found not in seen)
            else:
                modules.add(found.__module__ if isinstance(found, type) else type(found).__module__)
    return modules, constants


def subroutines_of(*functions: Callable) -> set[Callable]:
    """Return the subroutines of compiled functions, and of those that Python functions call."""
    found, seen, pending = set(), set(), [inspect.unwrap(function) for function in functions]
    while pending:
        one = pending.pop()
        seen.add(one)
        for _, value in _globals(one):
            if isinstance(value, Deferred) and not isinstance(value, Subroutine):
                continue
            if isinstance(value, Subroutine) or hasattr(value, "is_cached"):
                called = inspect.unwrap(value)
                pending += [called] * (called not in seen)
                found |= {called} if isinstance(value, Subroutine) else set()
    return found


def _globals(function: Any) -> Iterator[tuple[str, Any]]:
    """Yield the global values that a function refers to, also through modules, with full names."""
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
