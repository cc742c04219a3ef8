"""Functions that are taken from the library, or compiled once per process and kept on disk."""

from collections.abc import Callable
from functools import cache, partial, update_wrapper
from typing import Any, NamedTuple

from magmotor.numerics import dependencies, native_library
from magmotor.numerics.c_types import Signature
from magmotor.numerics.deferred import Deferred, needing_numba
from magmotor.numerics.dependencies import Defined
from magmotor.numerics.native_calls import NativeFunction


def compiled_once(signature: Signature | None = None, **options: Any) -> Callable[[Callable], Any]:
    """Turn a function that defines another one into one that compiles it, once per process.

    Parameters
    ----------
    signature : Signature, optional
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
    text = str(signature or "")

    def decorate(define: Callable) -> Callable:
        @cache
        def compiled(*by: Any) -> Any:
            if text and (in_library := native_library.versions(define, by)):
                return CFunction(in_library[0].address)
            found = dependencies.defined(define, by)
            function = CompiledFunction(partial(_compiled, found, text, options), found)
            return function.real if text else function

        def is_cached(*by: Any) -> bool:
            if native_library.versions(define, by):
                return True
            return _numba_cache().is_cached(dependencies.defined(define, by))

        wrapper: Any = update_wrapper(compiled, define)
        wrapper.is_cached = is_cached
        return wrapper

    return decorate


class CFunction(NamedTuple):
    """A C function of the library."""

    address: int


class CompiledFunction(Deferred):
    """A function that Python calls: one in the library, or, for other arguments, Numba's.

    Parameters
    ----------
    make : callable
        Returns Numba's function.
    defined : Defined
    """

    def __init__(self, make: Callable[[], Any], defined: Defined) -> None:
        super().__init__(make, defined.function)
        self._defined = defined
        self._in_library: NativeFunction | None = None

    def _call_with(self, args: tuple) -> Callable[[], Any] | None:
        """Return what calls the function in the library, if that has it for such arguments."""
        if self._in_library is None:  # without a lock, which a fork could leave locked
            versions = native_library.versions(self._defined.define, self._defined.by)
            self._in_library = NativeFunction(versions)
        return self._in_library.call_with(args)

    def __call__(self, *args: Any) -> Any:
        """Call the function."""
        call = self._call_with(args)
        return self.real(*args) if call is None else call()

    def compile_for(self, *args: Any) -> None:
        """Compile for such arguments here, if need be: Ctrl-C would not end it in a new thread."""
        if self._call_with(args) is None:
            function = self.real  # which imports Numba, or says how to install it
            from numba import typeof

            function.compile(tuple(map(typeof, args)))


def _compiled(defined: Defined, signature: str, options: dict[str, Any]) -> Any:
    return _numba_cache().compiled(defined, signature, options)


def _numba_cache() -> Any:
    with needing_numba():
        from magmotor.numerics import numba_cache
    return numba_cache
