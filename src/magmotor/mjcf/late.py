"""Functions that most models do not need, compiled when compiled code first asks for them."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import ctypes
import threading
from collections.abc import Callable
from typing import Any

from numba import types

from magmotor.mjcf import memory
from magmotor.numerics.subroutine import subroutine
from magmotor_plugin import returning

_load = types.ExternalFunction("magmotor_load", types.int64(types.int64))
_loaders: list["LateFunction"] = []
_lock = threading.RLock()


class LateFunction:
    """A C function of other compiled code, whose address is 0 until it is needed.

    Parameters
    ----------
    symbol : str
        Symbol of the variable that has the address.
    signature : numba signature
    compiled : callable
        Returns the function as `numba.cfunc` does.

    Attributes
    ----------
    is_ready : compiled function
        Whether the function can be called; it is loaded, if need be. False after Ctrl-C.
    call : compiled function
        Calls it with a tuple of arguments.
    """

    def __init__(self, symbol: str, signature: Any, compiled: Callable[[], Any]) -> None:
        self._symbol, self._compiled = symbol, compiled
        self._address = ctypes.c_int64()
        address, number = memory.variable(symbol), len(_loaders)
        _loaders.append(self)

        @subroutine
        def is_ready():
            return address() != 0 or _load(number) != 0

        self.is_ready, self.call = is_ready, memory.function_at(symbol, signature)

    def bind(self) -> None:
        """Bind the variable, and the function that loads, to symbols in compiled code."""
        memory.bind_variable(self._symbol, self._address)
        memory.bind_function("magmotor_load", _loaded)

    def load(self) -> None:
        """Compile the function, or load it from the disk, once."""
        with _lock:
            self._address.value = self._address.value or self._compiled().address


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)
@returning
def _loaded(number):
    """Load a function; return 1, or None, which is 0, after Ctrl-C."""
    _loaders[number].load()
    return 1
