"""MuJoCo's hooks: one of each per process, shared by all models and threads.

`Hook` replaces one of them inside a `with` block. Here `raised` uses it for the error handler and
`without_stopwatch` for the stopwatch; `magmotor.mjcf.magnetism` uses it for the callback.
"""

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco

from magmotor.mjcf.memory import library


class Hook:
    """A `with` block in which a hook is ours; at the end it is again what it was.

    Blocks may be nested and may overlap in several threads: the first installs, the last restores.

    Parameters
    ----------
    install : callable
        `install()` makes the hook ours and returns what it was.
    restore : callable
        `restore(previous)` undoes that.
    """

    def __init__(self, install: Callable[[], Any], restore: Callable[[Any], object]):
        self._install, self._restore = install, restore
        self._lock = threading.Lock()
        self._depth = 0
        self._previous: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self._depth == 0:
                self._previous = self._install()
            self._depth += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._depth -= 1
            if self._depth == 0:
                self._restore(self._previous)
                self._previous = None


@contextmanager
def raised() -> Iterator[None]:
    """Raise, at the end of the block, the first error that C code reported in its thread.

    The code that reported it goes on, as if it had not.

    Raises
    ------
    mujoco.FatalError
    """
    try:
        with _error_hook:
            yield
    finally:
        message = _messages.pop(threading.get_ident(), None)
    if message is not None:
        raise mujoco.FatalError(message)


_messages: dict[int, str] = {}
"""The first error of each thread."""


@ctypes.CFUNCTYPE(None, ctypes.c_char_p)
def _keep(message: bytes) -> None:
    _messages.setdefault(threading.get_ident(), message.decode())


@cache
def _handler() -> ctypes.c_void_p:
    """The user's handler of errors, MuJoCo's last resort before it ends the process."""
    return ctypes.c_void_p.in_dll(library(), "mju_user_error")


def _keep_errors() -> int | None:
    previous = _handler().value
    _set_handler(ctypes.cast(_keep, ctypes.c_void_p).value)
    return previous


def _set_handler(handler: int | None) -> None:
    _handler().value = handler


_error_hook = Hook(_keep_errors, _set_handler)


@contextmanager
def without_stopwatch() -> Iterator[None]:
    """Stop the stopwatch, which the Python bindings start whenever an MjData is made.

    Blocks may be nested and may overlap in several threads: the last that ends starts it again.
    """
    with _stopwatch_hook:
        _stopwatch().value = None
        yield


@cache
def _stopwatch() -> ctypes.c_void_p:
    return ctypes.c_void_p.in_dll(library(), "mjcb_time")


def _start(clock: int | None) -> None:
    _stopwatch().value = clock


_stopwatch_hook = Hook(lambda: _stopwatch().value, _start)
