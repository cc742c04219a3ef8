"""A pool of local processes, each with its own connection.

If a process dies, only the call that it was computing is lost; a new process replaces it.
"""

import gc
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
from magmotor.common.exceptions import InputError, MagmotorError
from magmotor.common.interrupts import blocked

ONE_THREAD: dict[str, str] = {
    f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")
}
"""Environment of a worker, which uses one core: cases run in parallel, each on one thread."""

OWN_PATH: dict[str, str] = {"PYTHONSAFEPATH": "1"}
"""Environment in which a worker starts without the working folder, and imports what its driver can.

Else what multiprocessing imports before it passes on the driver's path could come from there.
"""

RESTARTS = 5
"""Idle processes, beyond one per worker, that may be killed in a row before the calls fail."""

SHORT = 0.1
"""Duration (s) up to which a call has another queued behind it, to hide the time of sending it."""

DYING_SECONDS = 5.0
"""Time that a process may take to end after its connection has closed."""

_CONTEXT = multiprocessing.get_context("spawn")


class WorkerDied(MagmotorError, RuntimeError):
    """The process that computed a call died."""


class NoWorkers(MagmotorError, RuntimeError):
    """No worker computes the cases: processes die at once, or a cluster is gone."""


class Pool:
    """A pool of local processes, which end when the pool is closed or its own process dies.

    Parameters
    ----------
    workers : int
        Largest number of processes; one is started when there is a call for it.
    """

    def __init__(self, workers: int):
        self._most = check_integer("workers", workers, at_least=1)
        if multiprocessing.current_process().daemon:
            raise InputError("a daemonic process, as of multiprocessing.Pool, cannot start workers")
        self._calls: deque[tuple[Future, tuple[Any, ...]]] = deque()
        self._workers: list[_Worker] = []
        self._deaths = 0
        self._ending = False
        self._wake_reader, self._wake_writer = _CONTEXT.Pipe(duplex=False)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """Submit a call, as to an `Executor`; it raises `WorkerDied` if its process dies."""
        future = Future()
        self._calls.append((future, (function, *arguments)))
        self._wake_writer.send(None)
        return future

    def close(self) -> None:
        """Kill the processes."""
        self._ending = True
        self._wake_writer.send(None)
        self._thread.join()

    def _serve(self) -> None:
        """Hand out calls and receive answers until the pool is closed."""
        try:
            while not self._ending:
                self._hand_out()
                connections = (worker.connection for worker in self._workers)
                for ready in wait([self._wake_reader, *connections]):
                    if ready is self._wake_reader:
                        self._wake_reader.recv()
                    else:
                        self._receive(next(w for w in self._workers if w.connection is ready))
        except BaseException as error:  # for example, no more processes can be started
            self._fail([future for future, _ in self._calls], error)
            self._fail([future for w in self._workers for future, _ in w.calls], error)
        finally:
            for worker in self._workers:
                worker.end()

    def _hand_out(self) -> None:
        """Send calls to idle workers, then one more to each worker whose calls are short."""
        for ahead in (False, True):
            for worker in self._workers:
                if self._calls and worker.has_room(ahead) and worker.send(*self._calls[0]):
                    self._calls.popleft()
        starting = sum(not worker.is_ready for worker in self._workers)
        for _ in range(min(len(self._calls) - starting, self._most - len(self._workers))):
            self._workers.append(_Worker())

    def _receive(self, worker: "_Worker") -> None:
        if worker.receive():
            self._deaths = 0
        if not worker.is_dead:
            return
        self._workers.remove(worker)
        worker.end()
        if worker.calls:
            future, _ = worker.calls.popleft()
            self._calls.extendleft(reversed(worker.calls))  # those that it had not begun
            future.set_exception(WorkerDied("its process died"))
            return
        self._deaths += 1
        if worker.was_killed and self._deaths < self._most + RESTARTS:
            return
        how = "are killed" if worker.was_killed else "end"
        message = f"worker processes {how} as soon as they start"
        if not worker.was_killed:
            message += (
                " (see their output above); a script that runs a sweep must do so"
                ' below `if __name__ == "__main__":`'
            )
        self._fail([future for future, _ in self._calls], NoWorkers(message))
        self._calls.clear()
        self._deaths = 0

    def _fail(self, futures: list[Future], error: BaseException) -> None:
        for future in futures:
            future.set_exception(error)


class _Worker:
    """A process and the calls that it was sent."""

    def __init__(self):
        self.connection, remote = _CONTEXT.Pipe()
        self.calls: deque[tuple[Future, tuple[Any, ...]]] = deque()
        self.is_ready = self.is_dead = self._is_quick = False
        self._since = 0.0
        given = {name: os.environ.get(name) for name in OWN_PATH}
        self._process = _CONTEXT.Process(target=_work, args=(remote, given), daemon=True)
        with environment(ONE_THREAD | OWN_PATH), children_without_interrupts():
            self._process.start()
        remote.close()  # now the connection closes when the process dies

    def has_room(self, ahead: bool) -> bool:
        """Whether it can be sent a call; with `ahead`, even while it computes another."""
        return self.is_ready and len(self.calls) <= (ahead and self._is_quick)

    @property
    def was_killed(self) -> bool:
        """Whether a signal ended it, for example from the out-of-memory killer."""
        return (self._process.exitcode or 0) < 0

    def send(self, future: Future, call: tuple[Any, ...]) -> bool:
        """Send it a call; False if it has died, as `receive` will find next."""
        try:
            self.connection.send(call)
        except OSError:
            self.is_ready = False
            return False
        if not self.calls:
            self._since = time.monotonic()
        self.calls.append((future, call))
        return True

    def receive(self) -> bool:
        """Receive a message, that it is ready or the outcome of a call; True for an outcome."""
        try:
            is_result, value = self.connection.recv()
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
        """Kill the process."""
        if self.is_dead:
            self._process.join(DYING_SECONDS)  # so that its own exit code is kept
        self._process.kill()
        self._process.join()
        self.connection.close()


@contextmanager
def children_without_interrupts() -> Iterator[None]:
    """Make processes that are started inside a `with` block ignore Ctrl-C."""
    with environment(OWN_PATH):
        resource_tracker.ensure_running()  # starting it would unblock Ctrl-C
    with blocked():
        yield


@contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for the processes that are started inside a `with` block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        _set(before)


def _set(values: Mapping[str, str | None]) -> None:
    """Set environment variables, or remove those that are None."""
    for name, value in values.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _work(connection: Connection, given: Mapping[str, str | None]) -> None:
    """Answer calls in a worker process until the driver ends, which was given some variables."""
    gc.freeze()  # looks for no garbage in what has been imported
    _set(given)  # for programs that a measure starts
    tqdm.set_lock(threading.RLock())  # tqdm's own semaphore would outlive a killed process
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls), daemon=True).start()
    answer: tuple[bool, Any] = True, None  # "ready"
    own = os.getpid()
    while True:
        if os.getpid() != own:  # the child of a measure that forked
            os._exit(0)
        try:
            connection.send(answer)
        except OSError:
            os._exit(1)
        except Exception as error:
            connection.send((False, RuntimeError(f"a result cannot be sent: {error}")))
        try:
            function, *arguments = pickle.loads(calls.get())
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error


def _receive(connection: Connection, calls: "SimpleQueue[bytes]") -> None:
    try:
        while True:
            calls.put(connection.recv_bytes())
    except (EOFError, OSError):
        os._exit(1)  # nobody waits for what is being computed
