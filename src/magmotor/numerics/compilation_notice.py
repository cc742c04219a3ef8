"""Compilation of this package's code: a line on stderr if it takes long, and its time."""

import sys
import threading
import time
from typing import Any

from numba.core import event
from tqdm import tqdm

SLOW = 5.0
"""Seconds after which compilation is explained."""

TEXT = "magmotor: compiling what is used for the first time; this takes a minute or two"


class CompilationNotice(event.Listener):
    """Prints the line once per process. Numba compiles one function at a time, with its callees.

    Attributes
    ----------
    seconds : float
        Wall time of all compilation that has ended.
    """

    def __init__(self, after: float = SLOW) -> None:
        self.seconds = 0.0
        self._after, self._depth, self._began, self._printed = after, 0, 0.0, False
        self._timer = threading.Timer(after, self._print)

    def on_start(self, event: Any) -> None:
        """Print the line later, unless the outermost function is compiled by then."""
        if not _is_ours(event):
            return
        if self._depth == 0:
            self._began = time.perf_counter()
            if not self._printed:
                self._timer = threading.Timer(self._after, self._print)
                self._timer.daemon = True
                self._timer.start()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """Cancel the line once compilation ends."""
        if not _is_ours(event):
            return
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._began
            self._timer.cancel()

    def _print(self) -> None:
        self._printed = True
        print(TEXT, file=sys.stderr, flush=True)


COMPILATION = CompilationNotice()
"""The notice of this process; `magmotor.numerics.numba_cache` registers it."""


class Progress(tqdm):
    """A progress bar whose clock stops while this package's code is compiled."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._compiled = COMPILATION.seconds
        super().__init__(*args, **kwargs)

    def update(self, n: float | None = 1) -> bool | None:
        """Advance the bar."""
        if not self.disable:
            spent = COMPILATION.seconds - self._compiled
            self._compiled += spent
            self.start_t += spent
            self.last_print_t += spent
        return super().update(n)


def _is_ours(event: Any) -> bool:
    module = event.data["dispatcher"].py_func.__module__ or ""  # None after exec
    return module.partition(".")[0] == "magmotor"
