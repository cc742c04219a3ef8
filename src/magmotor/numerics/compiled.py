"""Functions that are compiled once a process, and kept in Numba's disk cache.

Numba's keys hold a function's own bytecode and closure cells, but neither what it calls nor the
constants that it reads: a checksum of these in a closure cell makes up for that. Numba locks no
index while it adds an entry, so that two processes that do so at once may exchange their code:
functions that differ in closure cells have an index each, and so has each processor. Otherwise, of
two machines that share a home, one may get code that it cannot run. Nor does Numba survive an index
that names a type which newer code lacks: that of older code is never opened.
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
import numpy as np
from numba import cfunc, njit
from numba.core import config
from numba.core.codegen import get_host_cpu_features

from magmotor.numerics.eights import COUNT

CONSTANTS = (bool, int, float, complex, str, bytes, tuple, frozenset, np.generic, np.ndarray)
"""Kinds of global values that Numba freezes into the code."""


def compiled_once(signature: Any = None, **options: Any) -> Callable[[Callable], Callable]:
    """Turn a function that defines another one into one that compiles it, once a process.

    Parameters
    ----------
    signature : optional
        Compile a C function of this signature (`numba.cfunc`); by default `numba.njit`.
    **options
        Of Numba's decorator.

    Returns
    -------
    callable
        Decorates a function of `checksum`, and of whatever else the code is specialized by: plain
        numbers, strings or tuples. The function that it defines and returns names these, and
        `checksum` in the statement `_ = checksum`, so that they are its closure cells.

    Raises
    ------
    TypeError
        When it is called: the function that is defined does not name `checksum`.
    """
    options["cache"] = True
    compiler: Any = njit(**options) if signature is None else cfunc(signature, **options)

    def decorate(define: Callable) -> Callable:
        @cache
        def compiled(*by: Any) -> Any:
            checksum = checksum_of(define)
            function = define(checksum, *by)
            if "checksum" not in function.__code__.co_freevars:
                raise TypeError(f"{function.__qualname__} does not name its checksum")
            function.__qualname__ += f"_{zlib.crc32(repr((checksum, by, target())).encode()):08x}"
            return compiler(function)

        return update_wrapper(compiled, define)

    return decorate


def checksum_of(function: Callable) -> int:
    """Checksum of the modules that hold what a function reaches, and of the constants."""
    modules, constants = reached(function)
    sources = [inspect.getsource(sys.modules[name]) for name in sorted(modules)]
    return zlib.crc32("".join([*sources, *sorted(constants)]).encode())


def reached(function: Callable) -> tuple[set[str], set[str]]:
    """Names of modules with code or types that a function uses, itself or through others.

    Besides, the constants that it reads, as text. Of other packages, nothing counts.
    """
    packages = {"magmotor", function.__module__.partition(".")[0]}
    modules, constants, seen, pending = set(), set(), set(), [function]
    while pending:
        one = pending.pop()
        seen.add(one)
        modules.add(one.__module__)
        for name, value in _globals(one):
            found: Any = inspect.unwrap(value) if callable(value) else value
            if isinstance(found, CONSTANTS):
                constants.add(f"{name} = {found!r}")
            elif getattr(found, "__module__", "").partition(".")[0] not in packages:
                continue
            elif isinstance(found, FunctionType):
                pending += [found] * (found not in seen)
            else:
                modules.add(found.__module__ if isinstance(found, type) else type(found).__module__)
    return modules, constants


def _globals(function: Any) -> Iterator[tuple[str, Any]]:
    """The global values that a function names, also those within modules that it names."""
    names = set(_names(function.__code__))
    for name in names & function.__globals__.keys():
        value = function.__globals__[name]
        if isinstance(value, ModuleType):
            yield from ((n, getattr(value, n)) for n in names if hasattr(value, n))
        else:
            yield name, value


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def target() -> tuple[str, str]:
    """Name and features of the processor that Numba compiles for."""
    settings: Any = config
    name, features = settings.CPU_NAME, settings.CPU_FEATURES
    return name or llvm.get_host_cpu_name(), _host() if features is None else features


_host = cache(get_host_cpu_features)


@njit(inline="always")
def aligned(count):
    """Room for so many doubles, from the start of a cache line on and shared with nobody.

    Vectors across two lines are slow, and so is a line that two threads use.
    """
    room = np.empty(count + 2 * COUNT)
    start = -(room.ctypes.data // 8) % COUNT
    return room[start : start + count]


@njit(inline="always")
def copy(target, source):
    """Copy as many numbers as the target holds.

    An assignment of arrays compiles Numba's message about shapes that differ, too, for seconds.
    """
    for i in range(len(target)):
        target[i] = source[i]
