"""Workers: processes of this machine, or of a Dask cluster, as `concurrent.futures` has them."""

import gc
import logging
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from tqdm import tqdm

from magmotor.checks import check_integer, reject
from magmotor.interrupts import blocked

ONE_THREAD: dict[str, str] = {
    f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")
}
"""A worker takes one core: the sweep, not the case, is what runs in parallel."""


class Pool:
    """Processes of this machine, which end when the pool is closed or its own process dies.

    Parameters
    ----------
    workers : int
        How many.
    """

    def __init__(self, workers: int):
        check_integer("workers", workers, at_least=1)
        self.workers = workers
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        # Nobody else has the end that is kept here: when it closes, the workers know.
        there, self._here = context.Pipe(duplex=False)
        self._executor = ProcessPoolExecutor(self.workers, context, _initialize, (there,))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """As of an `Executor`."""
        with _environment(ONE_THREAD), _deaf_children():  # it may start a process
            return self._executor.submit(function, *arguments)

    def restart(self) -> None:
        """Begin with new processes."""
        self.kill()
        self._start()

    def close(self) -> None:
        """End the processes when they have nothing to do."""
        self._executor.shutdown()
        self._here.close()

    def kill(self) -> None:
        """End the processes, whatever they do."""
        self._here.close()
        self._executor.shutdown(cancel_futures=True)


@contextmanager
def _deaf_children() -> Iterator[None]:
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


def _initialize(there: Connection) -> None:
    """In a worker: end with the driver."""
    tqdm.set_lock(threading.RLock())  # its own is a semaphore, which outlives a killed process
    threading.Thread(target=_end_with, args=(there,), daemon=True).start()


def _end_with(there: Connection) -> None:
    try:
        there.recv()
    except (EOFError, OSError):
        os._exit(1)


@contextmanager
def dask_workers(scheduler: str) -> Iterator[tuple[Executor, int]]:
    """Connect to a running Dask scheduler; yield its executor and its number of threads.

    Parameters
    ----------
    scheduler : str
        Its address, as in tcp://127.0.0.1:8786.

    Raises
    ------
    ValueError
        Nothing answers there, it has no workers, or Dask is not installed.
    """
    with _connected(scheduler) as client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise reject("scheduler", scheduler, "that of a cluster with workers")
        yield client.get_executor(), threads


def _connected(scheduler: str) -> Any:
    """A Dask client, to be closed."""
    distributed = _distributed()
    try:
        return distributed.Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        mistake = reject("scheduler", scheduler, f"a Dask scheduler's address ({error})")
    # One that failed ends when it is collected, and waits for Dask's lock, which may then be held.
    gc.collect()
    raise mistake


@contextmanager
def local_cluster(workers: int | None = None, host: str = "127.0.0.1") -> Iterator[str]:
    """Start a Dask cluster on this machine, a process and thread each worker; yield its address.

    Whoever can reach a scheduler can have it run any code: it listens on the loopback interface
    only, unless another `host` is given.

    Parameters
    ----------
    workers : int, optional
        How many, by default one a core.
    host : str
        Address of the interface on which it listens.

    Yields
    ------
    str
        Address of the scheduler, for `dask_workers`.

    Raises
    ------
    ValueError
        `workers` is not a number of them, or `host` no interface of this machine.
    """
    distributed = _distributed()
    if workers is not None:
        check_integer("workers", workers, at_least=1)
    with ExitStack() as stack:
        try:
            with _deaf_children():
                cluster = stack.enter_context(
                    distributed.LocalCluster(
                        n_workers=workers or os.cpu_count() or 1,
                        threads_per_worker=1,
                        host=host,
                        dashboard_address=f"{host}:0",  # two clusters cannot share a port
                        env=ONE_THREAD,
                        silence_logs=logging.ERROR,
                    )
                )
        except RuntimeError as error:
            if not isinstance(error.__cause__, OSError):
                raise
            bound = f"an interface of this machine ({error.__cause__.strerror})"
            raise reject("host", host, bound) from None
        yield cluster.scheduler_address


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise ValueError("no Dask here: pip install magmotor[cluster]") from None
    return distributed
