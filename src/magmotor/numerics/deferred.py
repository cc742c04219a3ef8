"""Functions for Numba, which is imported when the first of them is compiled: that takes a while.

A module that defines or calls compiled functions needs only these names. What they stand for is
made when Numba meets them in the code that it compiles.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial, update_wrapper
from importlib import import_module
from typing import Any, Self

from magmotor.common.optional import extra
from magmotor.numerics.c_types import Signature
from magmotor.numerics.constants import StandIn

_disabled = os.environ.get("NUMBA_DISABLE_JIT", "0")
if _disabled.isdigit() and int(_disabled):
    raise ImportError("NUMBA_DISABLE_JIT is set: unset it, since magmotor needs compiled code")


@contextmanager
def needing_numba() -> Iterator[None]:
    """Import what needs Numba; an error says how to install it."""
    with extra("numba"):
        import numba  # noqa: F401  first, since users know it rather than what it needs

        yield


class Deferred(StandIn):
    """Stands for an object of Numba.

    Parameters
    ----------
    make : callable
        Returns the object.
    function : callable, optional
        The Python function that the object compiles.
    """

    def __init__(self, make: Callable[[], Any], function: Callable | None = None):
        self._make = make
        if function is not None:
            update_wrapper(self, function)

    def __getattr__(self, name: str) -> Any:
        """Return the object as `real`, or an attribute of the object."""
        if name.startswith("__") or "_make" not in vars(self):
            raise AttributeError(name)
        try:
            real = self._made()
        except AttributeError as error:  # Python would look for the attribute elsewhere
            raise ImportError(str(error)) from error
        return real if name == "real" else getattr(real, name)

    def _made(self) -> Any:
        """Return the object, which one thread makes."""
        with needing_numba():
            from magmotor.numerics.compiler import inference

        with inference.LOCK:  # with another lock, the compiler, which asks for objects, could wait
            if "real" not in vars(self):
                made = self._make()
                inference.refresh()
                self.real = made  # last, so that Ctrl-C leaves nothing half made
        return self.real

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Call the object."""
        return self.real(*args, **options)

    def __repr__(self) -> str:
        """Return the name of the class, and of the function."""
        return f"{type(self).__name__}({getattr(self, '__qualname__', '')})"

    def __copy__(self) -> Self:
        """Return the same, as of a function."""
        return self

    def __deepcopy__(self, _memo: Any) -> Self:
        """Return the same, as of a function."""
        return self

    def __reduce__(self) -> Any:
        """Pickle by the name in the module, as a function, or else as the object is pickled."""
        name = getattr(self, "__name__", "")
        is_global = getattr(sys.modules.get(self.__module__), name, None) is self if name else False
        return name if is_global else self.real.__reduce__()


class Subroutine(Deferred):
    """A function that compiled code calls."""


class Twofold(Subroutine):
    """A function that compiled code calls, and in whose place Python calls a Python function."""

    def __init__(self, make: Callable[[], Any], function: Callable, python: Callable):
        super().__init__(make, function)
        self._python = python

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Call the Python function."""
        return self._python(*args, **options)


class External(Deferred):
    """A C function, bound to a symbol when compiled code is loaded."""

    def __init__(self, symbol: str, signature: Signature):
        self.text = f"{symbol}{signature}"
        super().__init__(lambda: _external(symbol, signature))


def _external(symbol: str, signature: Signature) -> Any:
    from magmotor.numerics.compiler.subroutines import external

    return external(symbol, str(signature))


def subroutine(
    function: Callable | None = None, *, forceinline: bool = False, inline: str = "never"
) -> Any:
    """Compile a function for others to call; a decorator, with options of Numba or without.

    LLVM inlines the function where it sees fit, or always if `forceinline` is true. If `inline` is
    "always", Numba inlines it, which takes much longer. A division by zero is no error, whoever
    calls.
    """
    if function is None:
        return partial(subroutine, forceinline=forceinline, inline=inline)

    def make() -> Any:
        from magmotor.numerics.compiler.subroutines import compiled

        return compiled(function, forceinline, inline)

    return Subroutine(make, function)


def twofold(
    function: Callable | None = None,
    *,
    python: Callable | None = None,
    forceinline: bool = False,
) -> Any:
    """Make a `subroutine` that Python can call, too: as it is, or `python` instead; a decorator."""
    if function is None:
        return partial(twofold, python=python, forceinline=forceinline)
    compiled = subroutine(function, forceinline=forceinline)
    return Twofold(lambda: compiled.real, function, python or function)


def njit(function: Callable) -> Any:
    """Compile a function for Python and for others to call; a decorator."""

    def make() -> Any:
        import numba

        return numba.njit(function)

    return Subroutine(make, function)


def jitable(function: Callable) -> Any:
    """Let compiled code call a Python function, which Python calls as it is; a decorator."""

    def make() -> Any:
        from numba.extending import register_jitable

        return register_jitable(function)

    return _Jitable(make, function)


class _Jitable(Deferred):
    def __call__(self, *args: Any, **options: Any) -> Any:
        """Call the Python function."""
        return self.__wrapped__(*args, **options)  # pyright: ignore[reportAttributeAccessIssue]


class Intrinsic(Deferred):
    """A function that a module of `magmotor.numerics.compiler` writes in LLVM's language.

    `name` is an intrinsic of Numba in that module, or makes one if it is called with `by`.
    """

    def __init__(self, module: str, name: str, *by: Any):
        self.text = f"{module}.{name}{by}"
        super().__init__(lambda: _intrinsic(module, name, by))


def _intrinsic(module: str, name: str, by: tuple) -> Any:
    found = getattr(import_module(f"magmotor.numerics.compiler.{module}"), name)
    return found(*by) if by else found
