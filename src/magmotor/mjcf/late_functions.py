"""Functions that most models do not need, compiled when compiled code first asks for them."""

import ctypes
import os
import threading
import zlib
from collections.abc import Callable
from typing import Any

from magmotor.mjcf import memory
from magmotor.numerics import c_types as types
from magmotor.numerics.deferred import External, subroutine
from magmotor_plugin.c_callbacks import interrupted, returning

_load = External("magmotor_load", types.void(types.int64))
_failed = ctypes.c_int64()
loading_failed = memory.variable("magmotor_loading_failed")
"""Whether a function could not be compiled, so that what needs it must be an error."""

_loaders: dict[int, "LateFunction"] = {}
_lock = threading.RLock()
if hasattr(os, "register_at_fork"):  # a child gets no lock that another thread holds
    os.register_at_fork(
        before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release
    )


class LateFunction:
    """A C function of other compiled code, whose address is 0 until it is needed.

    Parameters
    ----------
    symbol : str
        Symbol of the variable that has the address.
    signature : Signature
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
        # The number is in the code of callers, so that it must be the same in all processes.
        address, number = memory.variable(symbol), zlib.crc32(f"{symbol}{signature}".encode())
        _loaders[number] = self

        @subroutine
        def is_ready():
            if address() == 0:
                _load(number)
            return address() != 0

        self.is_ready, self.call = is_ready, memory.function_at(symbol, signature)

    def bind(self) -> None:
        """Bind the variable, and the function that loads, to symbols in compiled code."""
        memory.bind_variable(self._symbol, self._address)
        memory.bind_variable("magmotor_loading_failed", _failed)
        memory.bind_function("magmotor_load", _loaded)

    def load(self) -> None:
        """Compile the function, or load it from the disk, once."""
        with _lock:
            self._address.value = self._address.value or self._compiled().address


@ctypes.CFUNCTYPE(None, ctypes.c_int64)
@returning
def _loaded(number):
    """Load a function, unless Ctrl-C or an error ends that; nothing while Ctrl-C is on its way."""
    if interrupted.is_set():
        return
    try:
        _loaders[number].load()
    except Exception:
        _failed.value = 1
        raise  # is printed
