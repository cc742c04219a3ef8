"""Interrupts that are heard when it suits."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def deferred() -> Iterator[threading.Event]:
    """Turn Ctrl-C inside a `with` block into an event, which is set from then on.

    Nothing is then broken off halfway. Threads but the main one get no signals: there, nothing
    changes.
    """
    heard = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield heard
        return
    before = signal.signal(signal.SIGINT, lambda *_: heard.set())
    try:
        yield heard
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def blocked() -> Iterator[None]:
    """Let no Ctrl-C through to this thread inside a `with` block, at whose end it comes.

    Threads and processes that are started there never hear any: they inherit that. Windows, where
    nothing can be blocked, lets all through.
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
    """Hold Ctrl-C back inside a `with` block, at whose end it comes.

    Raises
    ------
    KeyboardInterrupt
        At the end, if Ctrl-C was heard.
    """
    with deferred() as heard:
        yield
    if heard.is_set():
        raise KeyboardInterrupt
