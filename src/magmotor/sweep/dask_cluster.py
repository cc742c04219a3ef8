"""Executors that run cases on the workers of a Dask cluster."""

import gc
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import ExitStack, contextmanager
from typing import Any

from magmotor.common.checks import check_integer
from magmotor.common.exceptions import ArgumentError
from magmotor.common.optional import extra
from magmotor.sweep.process_pool import (
    ONE_THREAD,
    OWN_PATH,
    children_without_interrupts,
    environment,
)


class Cluster(Executor):
    """The executor of a Dask cluster, which also reports how many worker threads it has."""

    def __init__(self, client: Any):
        self._client = client
        self._executor = client.get_executor()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future:
        """Submit a call, as to any executor."""
        return self._executor.submit(fn, *args, **kwargs)

    def threads(self) -> int:
        """Return the current number of worker threads; 0 if the scheduler does not answer."""
        try:
            found = self._client.sync(
                self._client.scheduler.ncores, callback_timeout=ANSWER_SECONDS
            )
        except Exception:  # one of Dask's many
            return 0
        return sum(found.values())


CONNECT_SECONDS = 10.0
"""Time limit for connecting to a scheduler."""
ANSWER_SECONDS = 5.0
"""Time limit for an answer of a scheduler."""


@contextmanager
def dask_workers(scheduler: str) -> Iterator[tuple[Executor, int]]:
    """Connect to a running Dask scheduler; yield its executor and its number of threads.

    Parameters
    ----------
    scheduler : str
        Its address, for example tcp://127.0.0.1:8786.

    Raises
    ------
    ValueError
        No scheduler answers there, it has no workers.
    MissingExtra
        Dask is not installed.
    """
    with _connected(scheduler) as client:
        cluster = Cluster(client)
        threads = cluster.threads()
        if not threads:
            raise ArgumentError("scheduler", scheduler, "its cluster has no workers")
        yield cluster, threads


def _connected(scheduler: str) -> Any:
    """Return a Dask client, which the caller must close."""
    distributed = _distributed()
    if not isinstance(scheduler, str):
        raise ArgumentError(
            "scheduler", scheduler, "must be the address of a Dask scheduler, a string"
        )
    try:
        return distributed.Client(scheduler, timeout=CONNECT_SECONDS)
    except (OSError, ValueError) as error:
        sentence = f"must be the address of a Dask scheduler ({error})"
        failure = ArgumentError("scheduler", scheduler, sentence)
    # A failed client waits for Dask's lock when it is collected; later that might be held.
    gc.collect()
    raise failure


@contextmanager
def local_cluster(workers: int | None = None, host: str = "127.0.0.1") -> Iterator[str]:
    """Start a local Dask cluster with single-threaded worker processes; yield its address.

    Anyone who can reach a scheduler can make it run arbitrary code. It therefore listens only on
    the loopback interface, unless another `host` is given.

    Parameters
    ----------
    workers : int, optional
        Number of workers, by default one per processor.
    host : str
        Address of the interface to listen on.

    Yields
    ------
    str
        Address of the scheduler, for `dask_workers`.

    Raises
    ------
    ValueError
        `workers` is not a positive integer, or `host` is not an interface of this machine.
    """
    distributed = _distributed()
    if workers is not None:
        check_integer("workers", workers, at_least=1)
    if not isinstance(host, str) or not host:  # for Dask, "" means all interfaces
        raise ArgumentError("host", host, "must be the address of a network interface, a string")
    with ExitStack() as stack:
        try:
            with children_without_interrupts():
                cluster = stack.enter_context(
                    distributed.LocalCluster(
                        n_workers=workers or os.cpu_count() or 1,
                        threads_per_worker=1,
                        host=host,
                        dashboard_address=f"{host}:0",  # two clusters cannot share a port
                        env=ONE_THREAD | OWN_PATH,
                        silence_logs=logging.ERROR,
                        worker_class=_safely_starting(distributed.Nanny),
                    )
                )
        except RuntimeError as error:
            if not isinstance(error.__cause__, OSError):
                raise
            sentence = f"must be an interface of this machine ({error.__cause__.strerror})"
            raise ArgumentError("host", host, sentence) from None
        yield cluster.scheduler_address


def _safely_starting(nanny: type) -> type:
    """Return a class of those that start workers, also again after they die; see `OWN_PATH`.

    Dask sets a part of a worker's environment after it has started, and another part in this
    process, for good. Here, all of it is that of this process until no worker is starting.
    """
    stack, starting = ExitStack(), set()

    class Nanny(nanny):
        async def instantiate(self) -> Any:
            if not starting:
                stack.enter_context(environment(self.pre_spawn_env | OWN_PATH))
            starting.add(self)
            try:
                return await super().instantiate()
            finally:
                starting.discard(self)
                if not starting:
                    stack.close()

    return Nanny


def _distributed() -> Any:
    with extra("cluster"):
        import distributed
    return distributed
