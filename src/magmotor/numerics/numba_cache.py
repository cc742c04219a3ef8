"""Functions that are compiled once per process and kept on disk.

Numba's cache keys contain the bytecode and the closure cells of a function, but neither the
functions that it calls nor the constants that it reads. A checksum of these in a closure cell fills
that gap. Each combination of closure cells, processor and version of Numba has files of its own,
whose names tell whether it has been compiled.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import inspect
import sys
import zlib
from collections.abc import Callable, Iterator
from functools import cache, update_wrapper
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import njit
from numba.core import config, event
from numba.core.ccallback import CFunc
from numba.core.codegen import get_host_cpu_features
from numba.core.dispatcher import Dispatcher
from numba.core.sigutils import normalize_signature
from numba.core.types import ExternalFunction

from magmotor.numerics.code_files import CodeCache
from magmotor.numerics.compilation_notice import COMPILATION
from magmotor.numerics.simd import COUNT
from magmotor.numerics.subroutine import subroutine

CONSTANTS = (bool, int, float, complex, str, bytes, tuple, frozenset, np.generic, np.ndarray)
"""Types of global values that Numba freezes into the code."""

event.register("numba:compile", COMPILATION)


def compiled_once(signature: Any = None, **options: Any) -> Callable[[Callable], Any]:
    """Turn a function that defines another one into one that compiles it, once per process.

    Parameters
    ----------
    signature : optional
        Signature of a C function to compile by `numba.cfunc`; by default, `numba.njit` compiles.
    **options
        Options of Numba's decorator.

    Returns
    -------
    callable
        Decorator for a function whose arguments are `checksum` and whatever the code is
        specialized by: plain numbers, strings or tuples. The function that it defines and returns
        must refer to these, and to `checksum` by `_ = checksum`, to make them its closure cells.
        The method `is_cached` tells whether that is on the disk.

    Raises
    ------
    TypeError
        When called, if the defined function does not refer to `checksum`.
    """

    def decorate(define: Callable) -> Callable:
        @cache
        def defined(*by: Any) -> FunctionType:
            checksum = checksum_of(define)
            function = define(checksum, *by)
            if "checksum" not in function.__code__.co_freevars:
                raise TypeError(f"{function.__qualname__} does not refer to its checksum")
            key = checksum, by, target(), numba.__version__
            function.__qualname__ += f"_{zlib.crc32(repr(key).encode()):08x}"
            return function

        @cache
        def compiled(*by: Any) -> Any:
            function = defined(*by)
            kept = CodeCache(function, lambda: COMPILATION.expect(subroutines_of(define)))
            if signature is None:
                dispatcher: Any = njit(**options)(function)
                dispatcher._cache = kept
                return dispatcher
            callback: Any = _Callback(function, normalize_signature(signature), {}, options)
            callback._cache = kept
            callback.compile()
            return callback

        def is_cached(*by: Any) -> bool:
            return CodeCache(defined(*by)).files.any_is_whole()

        wrapper: Any = update_wrapper(compiled, define)
        wrapper.is_cached = is_cached
        return wrapper

    return decorate


_CFunc: Any = CFunc  # whose members have no types


class _Callback(_CFunc):
    """Numba's C function, whose compilation is an event, too."""

    def _compile_uncached(self) -> Any:
        with COMPILATION.running():
            return super()._compile_uncached()


def checksum_of(function: Callable) -> int:
    """Return a checksum of the modules and constants that a function depends on."""
    modules, constants = reached(function)
    sources = [inspect.getsource(sys.modules[name]) for name in sorted(modules)]
    return zlib.crc32("".join([*sources, *sorted(constants)]).encode())


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
            elif isinstance(found, ExternalFunction):
                constants.add(f"{name} = {found.symbol}{found.sig}")
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
            if isinstance(value, Dispatcher) or hasattr(value, "is_cached"):
                called = inspect.unwrap(value)
                pending += [called] * (called not in seen)
                found |= {called} if isinstance(value, Dispatcher) else set()
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


def target() -> tuple[str, str]:
    """Return the name and the features of the processor that Numba compiles for."""
    settings: Any = config
    name, features = settings.CPU_NAME, settings.CPU_FEATURES
    return name or llvm.get_host_cpu_name(), _host() if features is None else features


_host = cache(get_host_cpu_features)


@subroutine(forceinline=True)
def aligned(count):
    """Return an uninitialized array of doubles that starts a cache line and shares none.

    Vectors that straddle two cache lines are slow, and so is a line that two threads use.
    """
    room = np.empty(count + 2 * COUNT)
    start = -(room.ctypes.data // 8) % COUNT
    return room[start : start + count]


@subroutine(forceinline=True)
def copy(target, source):
    """Copy numbers until the target is full.

    It compiles seconds faster than an array assignment, which includes an error about shapes.
    """
    for i in range(len(target)):
        target[i] = source[i]
