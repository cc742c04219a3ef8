"""Functions that are compiled once per process and kept on disk."""

from collections.abc import Callable
from functools import cache, partial, update_wrapper
from typing import Any

from magmotor.numerics import dependencies
from magmotor.numerics.c_types import Signature
from magmotor.numerics.deferred import Deferred
from magmotor.numerics.dependencies import Defined


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
        def defined(*by: Any) -> Defined:
            return dependencies.defined(define, by)

        @cache
        def compiled(*by: Any) -> Any:
            found = defined(*by)
            function = Deferred(partial(_compiled, found, text, options), found.function)
            return function.real if text else function

        def is_cached(*by: Any) -> bool:
            from magmotor.numerics import numba_cache

            return numba_cache.is_cached(defined(*by))

        wrapper: Any = update_wrapper(compiled, define)
        wrapper.is_cached = is_cached
        return wrapper

    return decorate


def _compiled(defined: Defined, signature: str, options: dict[str, Any]) -> Any:
    from magmotor.numerics import numba_cache

    return numba_cache.compiled(defined, signature, options)
