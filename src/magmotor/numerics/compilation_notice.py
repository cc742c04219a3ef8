"""A line on stderr while this package's code is compiled, if that takes long."""

import sys
import threading
from typing import Any

from numba.core import event

SLOW = 5.0
"""Seconds after which compilation is explained."""

TEXT = "magmotor: compiling its code, on first use only; this takes a minute or two"


class CompilationNotice(event.Listener):
    """Prints the line once per process. Numba compiles one function at a time, with its callees."""

    def __init__(self, after: float = SLOW) -> None:
        self._after, self._depth, self._printed = after, 0, False
        self._timer = threading.Timer(after, self._print)

    def on_start(self, event: Any) -> None:
        """Print the line later, unless the outermost function is compiled by then."""
        if _is_ours(event) and not self._printed:
            if self._depth == 0:
                self._timer = threading.Timer(self._after, self._print)
                self._timer.daemon = True
                self._timer.start()
            self._depth += 1

    def on_end(self, event: Any) -> None:
        """Cancel the line once compilation ends."""
        if _is_ours(event) and not self._printed:
            self._depth -= 1
            if self._depth == 0:
                self._timer.cancel()

    def _print(self) -> None:
        self._printed = True
        print(TEXT, file=sys.stderr, flush=True)


def _is_ours(event: Any) -> bool:
    module = event.data["dispatcher"].py_func.__module__ or ""  # None after exec
    return module.partition(".")[0] == "magmotor"
