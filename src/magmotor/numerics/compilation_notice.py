"""Compilation of this package's code: a line on stderr if it takes long, its time, its thread."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

SLOW = 5.0
"""Seconds after which compilation is explained."""

TEXT = "magmotor: compiling what is used for the first time"
"""How the line begins; what follows is how many of the functions are compiled."""

CHANGED = "magmotor: compiling what has changed since `make library`"
"""How it begins if the library has a function, but of other sources."""


class CompilationNotice:
    """Prints the line once per process, or, on a terminal, a line that counts.

    Attributes
    ----------
    seconds : float
        Wall time of all compilation that has ended.
    when_added : callable
        Is called with each function when it is compiled.
    """

    def __init__(self, after: float = SLOW) -> None:
        self.seconds = 0.0
        self.when_added: Callable[[Callable], object] = lambda _function: None
        self._after, self._depth, self._began, self._printed = after, 0, 0.0, False
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._teller = threading.Thread()
        self._compiled: set[Callable] = set()
        self._has_changed = False
        self._expected: set[Callable] = set()
        self._elsewhere: tuple[Callable[[], int], int] = (lambda: 0), 0

    def add(self, function: Callable) -> None:
        """Count a function that has been compiled."""
        if function not in self._compiled:
            self._compiled.add(function)
            self.when_added(function)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Count a `with` block as compilation, also where it only waits for another process."""
        self.begin()
        try:
            yield
        finally:
            self.end()

    def expect(self, functions: set[Callable], has_changed: bool = False) -> None:
        """Count functions among those that are being compiled, unless they already are.

        `has_changed` tells that they have changed since the library was built.
        """
        self._expected |= functions - self._compiled
        self._has_changed |= has_changed

    def expect_elsewhere(self, count: Callable[[], int], total: int) -> None:
        """Count the functions that another process compiles; `count()` is how many it has."""
        self._elsewhere = count, total

    def progress(self) -> tuple[int, int]:
        """Return how many of how many functions are compiled."""
        count, total = self._elsewhere
        here = len(self._expected & self._compiled)
        return here + min(count(), total), len(self._expected) + total

    def begin(self) -> None:
        """Begin what `end` ends; both may be nested."""
        with self._lock:
            if self._depth == 0:
                self._began, self._ended = time.perf_counter(), threading.Event()
                self._teller = threading.Thread(target=self._tell, args=(self._ended,), daemon=True)
                self._teller.start()
            self._depth += 1

    def end(self) -> None:
        """End what `begin` began."""
        with self._lock:
            self._depth -= 1
            if self._depth == 0:
                self.seconds += time.perf_counter() - self._began
                self._expected, self._elsewhere = set(), ((lambda: 0), 0)
                self._has_changed = False
                self._ended.set()
                self._teller.join(1.0)  # so that what is printed next begins a line

    def _tell(self, ended: threading.Event) -> None:
        """Print the line if compilation takes long; on a terminal, until it ends."""
        if ended.wait(self._after):
            return
        on_terminal = sys.stderr is not None and sys.stderr.isatty()
        if not on_terminal and not self._printed:
            text, counted = self._words()
            print(f"{text}; this takes a minute or two{counted}", file=sys.stderr, flush=True)
        self._printed = True
        while on_terminal and not ended.wait(0.5):
            print(f"\r{''.join(self._words()):79}", end="", file=sys.stderr, flush=True)
        if on_terminal:
            print(f"\r{'':79}\r", end="", file=sys.stderr, flush=True)

    def _words(self) -> tuple[str, str]:
        done, total = self.progress()
        counted = f" ({done} of {total} functions)" if total else ""
        return CHANGED if self._has_changed else TEXT, counted


COMPILATION = CompilationNotice()
"""The notice of this process; `magmotor.numerics.numba_cache` tells it what Numba does."""


class Progress(tqdm):
    """A progress bar whose clock stops while this package's code is compiled."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._compiled = COMPILATION.seconds
        super().__init__(*args, **kwargs)

    @classmethod
    def get_lock(cls) -> Any:
        """Return the lock of all bars: one of its own would not be replaced with that of tqdm."""
        return tqdm.get_lock()

    def update(self, n: float | None = 1) -> bool | None:
        """Advance the bar."""
        if not self.disable:
            spent = COMPILATION.seconds - self._compiled
            self._compiled += spent
            self.start_t += spent
            self.last_print_t += spent
        return super().update(n)
