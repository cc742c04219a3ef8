"""Context managers that postpone Ctrl-C."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def deferred() -> Iterator[threading.Event]:
    """Make Ctrl-C inside a `with` block set an event instead of raising KeyboardInterrupt.

    Only the main thread receives signals; in other threads, the event is never set.
    """
    interrupted = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield interrupted
        return
    before = signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def blocked() -> Iterator[None]:
    """Block Ctrl-C for this thread inside a `with` block, and deliver it at the end.

    Threads and processes that are started in the block inherit this and never receive Ctrl-C. On
    Windows, signals cannot be blocked, and this does nothing.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Postpone Ctrl-C to the end of a `with` block.

    Raises
    ------
    KeyboardInterrupt
        At the end, if Ctrl-C was pressed.
    """
    with deferred() as interrupted:
        yield
    if interrupted.is_set():
        raise KeyboardInterrupt
