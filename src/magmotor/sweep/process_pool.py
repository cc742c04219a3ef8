"""Processes of this machine that take calls, each on a connection of its own.

What one process does is nobody else's: if it dies, the call that it had is known to be lost, and
no other; a new process takes its place.
"""

import multiprocessing
import os
import pickle
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from typing import Any

from tqdm import tqdm

from magmotor.common.checks import check_integer
from magmotor.common.interrupts import blocked

ONE_THREAD: dict[str, str] = {
    f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")
}
"""A worker takes one core: the sweep, not the case, is what runs in parallel."""

RESTARTS = 5
"""Processes, beyond one of each worker, that may be killed without a call before a call ends."""

SHORT = 0.1
"""Time (s) of a call behind which another may wait: while it is sent, nothing would be computed."""

DYING_SECONDS = 5.0
"""How long a process may take to end once its connection has."""

_CONTEXT = multiprocessing.get_context("spawn")


class WorkerDied(RuntimeError):
    """The process that had a call died."""


class NoWorkers(RuntimeError):
    """Nobody takes the cases: processes die whatever they are given, or a cluster is gone."""


class Pool:
    """Processes of this machine, which end when the pool is closed or its own process dies.

    Parameters
    ----------
    workers : int
        How many at most; a process is started when there is a call for it.
    """

    def __init__(self, workers: int):
        self._most = check_integer("workers", workers, at_least=1)
        self._calls: deque[tuple[Future, tuple[Any, ...]]] = deque()
        self._workers: list[_Worker] = []
        self._deaths = 0
        self._ending = False
        self._woken, self._wake = _CONTEXT.Pipe(duplex=False)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """As of an `Executor`; a call whose process dies ends in `WorkerDied`."""
        future = Future()
        self._calls.append((future, (function, *arguments)))
        self._wake.send(None)
        return future

    def close(self) -> None:
        """End the processes, whatever they do."""
        self._ending = True
        self._wake.send(None)
        self._thread.join()

    def _serve(self) -> None:
        """Deal calls out, and take what comes back, until the pool is closed."""
        try:
            while not self._ending:
                self._deal()
                for ready in wait([self._woken, *(worker.here for worker in self._workers)]):
                    if ready is self._woken:
                        self._woken.recv()
                    else:
                        self._hear(next(w for w in self._workers if w.here is ready))
        except BaseException as error:  # such as no more processes: whoever waits is to know
            self._drop([future for future, _ in self._calls], error)
            self._drop([future for w in self._workers for future, _ in w.calls], error)
        finally:
            for worker in self._workers:
                worker.end()

    def _deal(self) -> None:
        """Give calls to those who have none, then one ahead to those whose calls are short."""
        for ahead in (False, True):
            for worker in self._workers:
                if self._calls and worker.has_room(ahead) and worker.take(*self._calls[0]):
                    self._calls.popleft()
        starting = sum(not worker.is_ready for worker in self._workers)
        for _ in range(min(len(self._calls) - starting, self._most - len(self._workers))):
            self._workers.append(_Worker())

    def _hear(self, worker: "_Worker") -> None:
        if worker.hear():
            self._deaths = 0
        if not worker.is_dead:
            return
        self._workers.remove(worker)
        worker.end()
        if worker.calls:
            future, _ = worker.calls.popleft()
            self._calls.extendleft(reversed(worker.calls))  # which it had not begun
            future.set_exception(WorkerDied("its process died"))
            return
        self._deaths += 1
        if worker.was_killed and self._deaths < self._most + RESTARTS:
            return
        how = "are killed" if worker.was_killed else "end"
        mistake = f"worker processes {how} as soon as they start"
        if not worker.was_killed:
            mistake += (
                ", as they say above; a script that runs a sweep must do so"
                ' below `if __name__ == "__main__":`'
            )
        self._drop([future for future, _ in self._calls], NoWorkers(mistake))
        self._calls.clear()
        self._deaths = 0

    def _drop(self, futures: list[Future], error: BaseException) -> None:
        for future in futures:
            future.set_exception(error)


class _Worker:
    """A process, and what it has to do."""

    def __init__(self):
        self.here, there = _CONTEXT.Pipe()
        self.calls: deque[tuple[Future, tuple[Any, ...]]] = deque()
        self.is_ready = self.is_dead = self._is_quick = False
        self._since = 0.0
        self._process = _CONTEXT.Process(target=_work, args=(there,), daemon=True)
        with _environment(ONE_THREAD), deaf_children():
            self._process.start()
        there.close()  # the process alone has it: when it dies, its connection ends

    def has_room(self, ahead: bool) -> bool:
        """Whether it would take a call, or one that waits until it has answered another."""
        return self.is_ready and len(self.calls) <= (ahead and self._is_quick)

    @property
    def was_killed(self) -> bool:
        """Whether, now that it has ended, a signal ended it: of the out-of-memory killer, say."""
        return (self._process.exitcode or 0) < 0

    def take(self, future: Future, call: tuple[Any, ...]) -> bool:
        """Give it a call; False if it has died, which is heard next."""
        try:
            self.here.send(call)
        except OSError:
            self.is_ready = False
            return False
        if not self.calls:
            self._since = time.monotonic()
        self.calls.append((future, call))
        return True

    def hear(self) -> bool:
        """Receive what it says: that it is ready, or what came of a call, which is told."""
        try:
            is_result, value = self.here.recv()
        except (EOFError, OSError):
            self.is_dead = True
            return False
        self.is_ready = True
        if not self.calls:
            return False
        future, _ = self.calls.popleft()
        now = time.monotonic()
        self._is_quick, self._since = now - self._since < SHORT, now
        if is_result:
            future.set_result(value)
        else:
            future.set_exception(value)
        return True

    def end(self) -> None:
        """End the process, whatever it does."""
        if self.is_dead:
            self._process.join(DYING_SECONDS)  # so that its own exit code is known
        self._process.kill()
        self._process.join()
        self.here.close()


@contextmanager
def deaf_children() -> Iterator[None]:
    """Have processes that are started leave Ctrl-C to this one."""
    resource_tracker.ensure_running()  # its start lets Ctrl-C through
    with blocked():
        yield


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables of the environment, which processes that are started inherit."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _work(there: Connection) -> None:
    """In a worker: answer calls, until the driver ends."""
    tqdm.set_lock(threading.RLock())  # its own is a semaphore, which outlives a killed process
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(there, calls), daemon=True).start()
    answer: tuple[bool, Any] = True, None  # that it is ready
    own = os.getpid()
    while True:
        if os.getpid() != own:  # a measure has forked: its child has nothing to answer
            os._exit(0)
        try:
            there.send(answer)
        except OSError:
            os._exit(1)
        except Exception as error:
            there.send((False, RuntimeError(f"an answer cannot be sent: {error}")))
        try:
            function, *arguments = pickle.loads(calls.get())
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error


def _receive(there: Connection, calls: "SimpleQueue[bytes]") -> None:
    try:
        while True:
            calls.put(there.recv_bytes())
    except (EOFError, OSError):
        os._exit(1)  # whatever is being computed: nobody waits for it
