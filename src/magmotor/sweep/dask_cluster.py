"""Workers on a Dask cluster, of this machine or many, as an executor."""

import gc
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import ExitStack, contextmanager
from typing import Any

from magmotor.common.checks import check_integer, reject
from magmotor.sweep.process_pool import ONE_THREAD, deaf_children


class Cluster(Executor):
    """The workers of a Dask cluster, of which one can see whether there are any."""

    def __init__(self, client: Any):
        self._client = client
        self._executor = client.get_executor()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future:
        """As of any executor."""
        return self._executor.submit(fn, *args, **kwargs)

    def threads(self) -> int:
        """How many threads the workers have now; 0 where no scheduler answers."""
        try:
            found = self._client.sync(
                self._client.scheduler.ncores, callback_timeout=ANSWER_SECONDS
            )
        except Exception:  # Dask's own, of many kinds
            return 0
        return sum(found.values())


CONNECT_SECONDS = 10.0
"""How long connecting to a scheduler may take."""
ANSWER_SECONDS = 5.0
"""How long a scheduler may take to answer."""


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
        cluster = Cluster(client)
        threads = cluster.threads()
        if not threads:
            raise reject("scheduler", scheduler, "must be that of a cluster with workers")
        yield cluster, threads


def _connected(scheduler: str) -> Any:
    """A Dask client, to be closed."""
    distributed = _distributed()
    if not isinstance(scheduler, str):
        raise reject("scheduler", scheduler, "must be a Dask scheduler's address, str")
    try:
        return distributed.Client(scheduler, timeout=CONNECT_SECONDS)
    except (OSError, ValueError) as error:
        mistake = reject("scheduler", scheduler, f"must be a Dask scheduler's address ({error})")
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
    if not isinstance(host, str) or not host:  # Dask would take none for all interfaces
        raise reject("host", host, "must be an address of an interface of this machine, str")
    with ExitStack() as stack:
        try:
            with deaf_children():
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
            sentence = f"must be an interface of this machine ({error.__cause__.strerror})"
            raise reject("host", host, sentence) from None
        yield cluster.scheduler_address


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise ValueError("no Dask here: pip install magmotor[cluster]") from None
    return distributed
