"""Functions that are compiled once per process and kept on disk.

Numba's cache keys contain the bytecode and the closure cells of a function, but neither the
functions that it calls nor the constants that it reads. A checksum of these in a closure cell fills
that gap, and no code is kept once one of the constants has changed in this process. Each
combination of closure cells, processor and version of Numba has files of its own, whose names tell
whether it has been compiled.
"""

import zlib
from functools import cache, update_wrapper
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numba
from numba import njit
from numba.core import config, event
from numba.core.ccallback import CFunc
from numba.core.codegen import get_host_cpu_features
from numba.core.sigutils import normalize_signature

from magmotor.numerics import dependencies, native_library
from magmotor.numerics.code_files import CodeCache
from magmotor.numerics.compilation_notice import COMPILATION, CompilationNotice
from magmotor.numerics.dependencies import Defined


class Listener(event.Listener):
    """Tells a notice which of this package's functions Numba compiles."""

    def __init__(self, notice: CompilationNotice):
        self._notice = notice

    def on_start(self, event: Any) -> None:
        """Begin with a function, with its callees."""
        if _is_ours(event):
            self._notice.begin()

    def on_end(self, event: Any) -> None:
        """End with it."""
        if _is_ours(event):
            dispatcher = event.data["dispatcher"]
            dependencies.note(dispatcher.py_func)
            if dispatcher.overloads:  # `is_failed` of Numba 0.68 means the opposite
                self._notice.add(dispatcher.py_func)
            self._notice.end()


def _is_ours(event: Any) -> bool:
    module = event.data["dispatcher"].py_func.__module__ or ""  # None after exec
    return module.partition(".")[0] == "magmotor"


event.register("numba:compile", Listener(COMPILATION))


def compiled(defined: Defined, signature: str, options: dict[str, Any]) -> Any:
    """Return Numba's object for a function, which is compiled, or loaded from the disk.

    With a signature, that is a C function; else, Python's arguments decide.
    """
    function, define = _named(defined), defined.define
    kept = CodeCache(
        function,
        is_true=lambda: dependencies.are_unchanged(define),
        missing=lambda: COMPILATION.expect(
            dependencies.subroutines_of(define), native_library.has_changed(define, defined.by)
        ),
    )
    if not signature:
        dispatcher: Any = njit(**options)(function)
        dispatcher._cache = kept
        return dispatcher
    callback: Any = _Callback(function, normalize_signature(signature), {}, options)
    callback._cache = kept
    callback.compile()
    return callback


def is_cached(defined: Defined) -> bool:
    """Whether a function is on the disk."""
    return CodeCache(_named(defined)).files.any_is_whole()


def _named(defined: Defined) -> Any:
    """Return a copy of a function with a name of its own for each combination."""
    of: Any = defined.function
    function: Any = FunctionType(
        of.__code__, of.__globals__, of.__name__, of.__defaults__, of.__closure__
    )
    update_wrapper(function, of)
    key = defined.checksum, defined.by, target(), numba.__version__
    function.__qualname__ += f"_{zlib.crc32(repr(key).encode()):08x}"
    return function


_CFunc: Any = CFunc  # whose members have no types


class _Callback(_CFunc):
    """Numba's C function, whose compilation is an event, too."""

    def _compile_uncached(self) -> Any:
        with COMPILATION.running():
            return super()._compile_uncached()


def target() -> tuple[str, str]:
    """Return the name and the features of the processor that Numba compiles for."""
    settings: Any = config
    name, features = settings.CPU_NAME, settings.CPU_FEATURES
    return name or llvm.get_host_cpu_name(), _host() if features is None else features


_host = cache(get_host_cpu_features)
