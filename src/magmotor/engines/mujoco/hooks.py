"""Hooks of MuJoCo's, of which a process has one each, for all models and threads."""

import threading
from collections.abc import Callable
from typing import Any


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
