"""Python functions that C calls: they raise nothing, and Ctrl-C is delivered after them."""

import _thread
import signal
import threading
from collections.abc import Callable
from functools import partial, wraps
from types import CodeType, FrameType
from typing import Any


def returning(function: Callable) -> Callable:
    """Make a function return None instead of raising, for use as a C callback.

    A C callback that raises returns an undefined value. Ctrl-C is delivered a little later.
    """

    @called_by_c
    @wraps(function)
    def call(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except KeyboardInterrupt:
            interrupt_later()
        except BaseException:
            print_exception()
        return None

    return call


def print_exception() -> None:
    """Print the traceback of the current exception to stderr."""
    import traceback

    traceback.print_exc()


_CALLBACKS: set[CodeType] = set()
"""Code of functions that C calls, where Python discards KeyboardInterrupt."""


def called_by_c(function: Any) -> Any:
    """Add a function to these."""
    _CALLBACKS.add(function.__code__)
    return function


interrupted = threading.Event()
"""Set from Ctrl-C in such a function until KeyboardInterrupt is raised."""


def interrupt_later() -> None:
    """Raise KeyboardInterrupt as soon as C has returned to the main thread, which received it.

    A timer of the system does not need the GIL, which the main thread may keep for long.
    """
    if threading.current_thread() is not threading.main_thread():
        return  # a loader, which receives it again
    if interrupted.is_set():
        return
    interrupted.set()
    if not hasattr(signal, "setitimer"):  # Windows
        threading.Timer(0.05, _press_ctrl_c).start()
    else:
        before = signal.getsignal(signal.SIGALRM), signal.getitimer(signal.ITIMER_REAL)
        signal.signal(signal.SIGALRM, partial(_interrupt_outside, before))
        signal.setitimer(signal.ITIMER_REAL, 2e-4, 2e-4)


def _press_ctrl_c() -> None:
    interrupted.clear()
    _thread.interrupt_main()


def _interrupt_outside(before: Any, number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but not inside of a callback, and give the timer back."""
    while frame is not None:
        if frame.f_code in _CALLBACKS:
            return
        frame = frame.f_back
    handler, times = before
    signal.setitimer(signal.ITIMER_REAL, *times)
    signal.signal(signal.SIGALRM, handler)
    interrupted.clear()
    raise KeyboardInterrupt
