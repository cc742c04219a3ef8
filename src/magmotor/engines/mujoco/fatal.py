"""MuJoCo's errors in C code that is called past its Python bindings, which would raise them.

Without them MuJoCo ends the process.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import mujoco

from magmotor.engines.mujoco.hooks import Hook
from magmotor.engines.mujoco.memory import library

_messages: dict[int, str] = {}


@contextmanager
def raised() -> Iterator[None]:
    """Raise, at the end of the block, the first error that C code reported in its thread.

    The code that reported it goes on, as if it had not.

    Raises
    ------
    mujoco.FatalError
    """
    try:
        with _hook:
            yield
    finally:
        message = _messages.pop(threading.get_ident(), None)
    if message is not None:
        raise mujoco.FatalError(message)


def _install() -> int | None:
    previous = _handler().value
    _handler().value = ctypes.cast(_keep, ctypes.c_void_p).value
    return previous


def _restore(previous: int | None) -> None:
    _handler().value = previous


_hook = Hook(_install, _restore)


@cache
def _handler() -> ctypes.c_void_p:
    """The user's handler of errors, MuJoCo's last resort before it ends the process."""
    return ctypes.c_void_p.in_dll(library(), "mju_user_error")


@ctypes.CFUNCTYPE(None, ctypes.c_char_p)
def _keep(message: bytes) -> None:
    _messages.setdefault(threading.get_ident(), message.decode())
