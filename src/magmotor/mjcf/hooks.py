"""MuJoCo's global hooks, each of which is shared by all models and threads of a process.

`Hook` replaces one for the duration of a `with` block. `errors_raised` replaces the error handler
and `without_stopwatch` the stopwatch; `magmotor.mjcf.magnetism` replaces the control callback.
"""

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco

from magmotor_plugin.library import library


class Hook:
    """Context manager that installs a hook, and restores the previous one at the end.

    Blocks may be nested and may overlap in several threads: the first one installs the hook, and
    the last one restores it.

    Parameters
    ----------
    install : callable
        `install()` installs the hook and returns the previous one.
    restore : callable
        `restore(previous)` restores the previous hook.

    Attributes
    ----------
    depth : int
        Number of open blocks.
    """

    def __init__(self, install: Callable[[], Any], restore: Callable[[Any], object]):
        self._install, self._restore = install, restore
        self._lock = threading.Lock()
        self.depth = 0
        self._previous: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self.depth == 0:
                self._previous = self._install()
            self.depth += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self.depth -= 1
            if self.depth == 0:
                self._restore(self._previous)
                self._previous = None


@contextmanager
def errors_raised() -> Iterator[None]:
    """Raise the first error that C code reported in this thread, at the end of the block.

    The C code continues after reporting an error.

    Raises
    ------
    mujoco.FatalError
    """
    before = getattr(_of_thread, "messages", None)
    _of_thread.messages = messages = []
    try:
        with _error_hook:
            yield
    finally:
        _of_thread.messages = before
    if messages:
        raise mujoco.FatalError(messages[0])


def catches_errors(handler: int) -> bool:
    """Whether a handler of MuJoCo's errors, an address, handles those of this thread."""
    ours = handler == ctypes.cast(_keep, ctypes.c_void_p).value
    return handler != 0 and not (ours and not inside_errors_raised())


def inside_errors_raised() -> bool:
    """Whether `errors_raised` handles the errors of this thread."""
    return getattr(_of_thread, "messages", None) is not None


_of_thread = threading.local()
"""Its `messages` are the errors of a thread inside `errors_raised`, else None."""


@ctypes.CFUNCTYPE(None, ctypes.c_char_p)
def _keep(message: bytes) -> None:
    messages = getattr(_of_thread, "messages", None)
    if messages is None:  # another thread, in which MuJoCo cannot go on
        os.write(2, b"ERROR: " + message + b"\n")
        os._exit(1)
    messages.append(message.decode(errors="replace"))


@cache
def _handler() -> ctypes.c_void_p:
    """Return MuJoCo's pointer to the user's error handler; without one, errors end the process."""
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
    """Stop the stopwatch that the Python bindings start whenever they create an MjData.

    Blocks may be nested and may overlap in several threads; the last one restarts the stopwatch.
    """
    with _stopwatch_hook:
        _stopwatch().value = None
        yield


@cache
def _stopwatch() -> ctypes.c_void_p:
    return ctypes.c_void_p.in_dll(library(), "mjcb_time")


def _set_stopwatch(clock: int | None) -> None:
    _stopwatch().value = clock


_stopwatch_hook = Hook(lambda: _stopwatch().value, _set_stopwatch)
