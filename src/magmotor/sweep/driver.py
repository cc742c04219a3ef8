"""The driver of a sweep: it hands cases to workers and stores their outcomes."""

import math
import os
import sys
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from tqdm import tqdm

from magmotor.common.arguments import check_flag
from magmotor.common.checks import check_integer, check_type
from magmotor.common.exceptions import ArgumentError, MagmotorError
from magmotor.common.hints import check_path
from magmotor.common.integrity import Damaged
from magmotor.common.interrupts import deferred
from magmotor.common.optional import extra
from magmotor.sweep.case import Case
from magmotor.sweep.compute import OtherVersions, Outcome, compute
from magmotor.sweep.dask_cluster import Cluster
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory
from magmotor.sweep.measures import imported, is_own
from magmotor.sweep.process_pool import NoWorkers, Pool, WorkerDied

CASES_PER_WORKER = 2
"""Cases submitted per worker: one is computed while one waits."""

TICK_SECONDS = 1.0
"""Time without a finished case after which the progress bar is drawn again."""

POLL_SECONDS = 5.0
"""Time without a finished case after which a cluster is checked for workers."""

LOST_SECONDS = 60.0
"""Time without workers after which a sweep on a cluster ends."""

DIED = "its worker process died (killed, or out of memory?)"


@dataclass
class Tally:
    """Progress of a sweep.

    Attributes
    ----------
    cases, done, failed : int
        All cases; those with a result; those with an error.
    computed : int
        Cases done or failed in this call.
    seconds : float
        Wall time that the workers spent on them.
    """

    cases: int
    done: int = 0
    failed: int = 0
    computed: int = 0
    seconds: float = 0.0

    def __str__(self) -> str:
        """Return a one-line summary."""
        missing = self.cases - self.done - self.failed
        left = f", {missing} missing" if missing else ""
        return f"{self.cases} cases: {self.done} done, {self.failed} failed{left}"


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; results so far are on disk, and the same call resumes it."""


class SweepFailed(MagmotorError, RuntimeError):
    """Every case of a sweep has failed.

    Attributes
    ----------
    tally : Tally
    """

    def __init__(self, tally: Tally, error: str):
        self.tally, self.error = tally, error
        count = f"all {tally.cases} cases" if tally.cases > 1 else "the only case"
        super().__init__(f"{count} of the sweep failed, the first of them with: {error}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments."""
        return type(self), (self.tally, self.error)


def run(
    sweep: Sweep,
    directory: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    retry: bool = False,
) -> Tally:
    """Run the cases of a sweep that have no result yet, and write each result as it arrives.

    A sweep that was stopped in any way resumes when it is run again: only the cases in progress are
    lost, and results are the same bit for bit. Several calls, on one or many machines, may work on
    the same directory. A damaged result is recomputed with a warning. A case whose worker process
    dies is retried once, alone, and fails if the process dies again.

    Parameters
    ----------
    sweep : Sweep
    directory : str or Path
        Directory of the results; created if it does not exist.
    workers : int, optional
        Number of processes, or of the workers of `executor`; by default the number of processors.
    executor : concurrent.futures.Executor, optional
        Computes the cases instead of local processes; for example the one of `dask_workers`.
    retry : bool
        Run failed cases again.

    Returns
    -------
    Tally

    Raises
    ------
    ValueError
        The directory holds another sweep, or the sweep was read from a file and has a measure
        `package.module:function` that has not been allowed.
    OSError
        A result cannot be written, a worker's machine has no room, or the directory or results were
        moved or removed meanwhile. Other results are intact, and the same call resumes the sweep.
    SweepInterrupted
        Ctrl-C.
    SweepFailed
        Every case has failed, now or before; the errors are on disk, and `status` returns them.
    NoWorkers
        Worker processes end as soon as they start, the executor drops cases, or a Dask cluster has
        had no workers for 60 s. Results so far are on disk, and the same call resumes the sweep.
    OtherVersions
        The workers have other versions than this process.

    Warns
    -----
    UserWarning
        A damaged file is written again.
    """
    check_type("sweep", sweep, Sweep)
    retry = check_flag("retry", retry)
    workers = (os.cpu_count() or 1) if workers is None else workers
    workers = check_integer("workers", workers, at_least=1)
    if not (executor is None or callable(getattr(executor, "submit", None))):
        raise ArgumentError("executor", executor, "must be a concurrent.futures.Executor, or None")
    for name in filter(is_own, sweep.measure):
        imported(name)
    with extra("sweep"):
        import netCDF4  # noqa: F401 - the workers write results with it
    store = Directory(Path(check_path("directory", directory)), sweep)
    store.remove_leftovers()
    if sweep.choice is not None:
        print(sweep.choice, file=sys.stderr)
    pool = Pool(workers) if executor is None else None
    driver = _Driver(sweep, store, pool or executor, workers, retry)
    try:
        with driver.progress:
            driver.work()
        if pool is not None:
            pool.close()
    except BaseException as error:
        with deferred():  # ignores a second Ctrl-C
            driver.stop()
        if isinstance(error, KeyboardInterrupt):
            raise SweepInterrupted(f"sweep interrupted; {driver.tally}") from None
        raise
    if driver.tally.failed == len(sweep):
        raise SweepFailed(driver.tally, str(store.error(sweep.case(0))))
    return driver.tally


class _Driver:
    """Keeps the workers busy and stores their outcomes."""

    def __init__(self, sweep: Sweep, store: Directory, workers, count: int, retry: bool):
        self.sweep, self.store, self.workers, self.retry = sweep, store, workers, retry
        self.window = CASES_PER_WORKER * count
        self.tally = Tally(len(sweep))
        self.running: dict[Future, Case] = {}
        self.ended: SimpleQueue[Future] = SimpleQueue()
        self.suspects: list[Case] = []
        self.progress = tqdm(total=len(sweep), desc="sweep", unit="case", smoothing=0, disable=None)
        self.progress.set_postfix_str("starting workers, which compile on first use")

    def work(self) -> None:
        """Run until all cases are done or failed."""
        cases = self._cases()
        exhausted = False
        while not exhausted or self.running or self.suspects:
            while not (exhausted or self.suspects) and len(self.running) < self.window:
                case = next(cases, None)
                exhausted = case is None
                if case is not None:
                    self._submit(case)
            if self.suspects and not self.running:
                self._submit(self.suspects[0])
            if self.running:
                self._handle(self._next_ended())
        self.store.check_kept(self.tally.done)

    def stop(self) -> None:
        """Abandon the cases in progress."""
        if isinstance(self.workers, Pool):
            self.workers.close()
        for future in self.running:
            future.cancel()
        self.store.release_claims()

    def _cases(self) -> Iterator[Case]:
        """Yield the cases to compute, in an order that soon covers the sweep evenly.

        Cases claimed by another driver come last, since it may have died.
        """
        size, claimed = len(self.sweep), []
        stride = _stride(size)
        for number in range(size):
            index = number * stride % size
            case = self.sweep.case(index)
            if self._is_done(case):
                self._skip()
            elif self.store.claim(case):
                yield case
            else:
                claimed.append(index)
        for index in claimed:
            case = self.sweep.case(index)
            if self._is_done(case):
                self._skip()
            else:
                yield case

    def _is_done(self, case: Case) -> bool:
        """Whether a case is done or has failed for good; counts it if so."""
        try:
            if self.store.result(case) is not None:
                self.tally.done += 1
            elif not self.retry and self.store.error(case) is not None:
                self.tally.failed += 1
            else:
                return False
        except Damaged as damage:
            warnings.warn(f"{damage}; the case is recomputed", stacklevel=2)
            return False
        return True

    def _skip(self) -> None:
        """Count a finished case without affecting the displayed rate."""
        if not self.progress.disable:
            self.progress.initial += 1
            self.progress.n += 1

    def _submit(self, case: Case) -> None:
        future = self.workers.submit(compute, case, self.sweep.measure)
        self.running[future] = case
        future.add_done_callback(self.ended.put)

    def _next_ended(self) -> Future:
        """Wait for the next case to end; NoWorkers if a cluster has long been without workers."""
        lost, cluster = None, isinstance(self.workers, Cluster)
        while True:
            try:
                return self.ended.get(timeout=POLL_SECONDS if cluster else TICK_SECONDS)
            except Empty:
                self.progress.refresh()
                now = time.monotonic()
                if not cluster or self.workers.threads():
                    lost = None
                elif lost is None:
                    lost = now
                    ends = f"the sweep ends unless one returns within {LOST_SECONDS:g} s"
                    tqdm.write(f"the cluster has no workers left; {ends}", file=sys.stderr)
                elif now - lost >= LOST_SECONDS:
                    gone = f"the cluster has had no workers for {LOST_SECONDS:g} s"
                    raise NoWorkers(f"{gone}; {self.tally}") from None

    def _handle(self, future: Future) -> None:
        """Store the outcome of a case; retry it once, alone, if its process died."""
        case = self.running.pop(future)
        if future.cancelled():
            raise NoWorkers("the executor dropped a case: is the cluster gone?")
        error = future.exception()
        if error is None:
            self._keep(case, future.result())
        elif isinstance(error, WorkerDied) and case.key not in [c.key for c in self.suspects]:
            self.suspects.append(case)
        # Dask has already retried it.
        elif isinstance(error, WorkerDied) or type(error).__name__ == "KilledWorker":
            self._keep(case, Outcome(None, DIED, 0.0))
        elif isinstance(self.workers, Cluster) and not isinstance(error, OtherVersions):
            kind = type(error).__name__  # one of Dask's, some caused by its own bugs
            raise NoWorkers(f"the cluster returned a case uncomputed ({kind}: {error})") from error
        else:
            raise error

    def _keep(self, case: Case, outcome: Outcome) -> None:
        self.store.keep(case, outcome)
        self.suspects = [suspect for suspect in self.suspects if suspect.key != case.key]
        if self.tally.computed == 0 and not self.progress.disable:
            self.progress.start_t = time.time() - outcome.seconds
            self.progress.set_postfix_str("", refresh=False)
        self.tally.computed += 1
        self.tally.seconds += outcome.seconds
        if outcome.error is None:
            self.tally.done += 1
        else:
            self.tally.failed += 1
            self.progress.set_postfix(failed=self.tally.failed, refresh=False)
        self.progress.update()


def _stride(size: int) -> int:
    """Return a number near 0.62 size and coprime to it, whose multiples cover all cases evenly."""
    stride = max(1, round(0.618 * size))
    while math.gcd(stride, size) > 1:
        stride += 1
    return stride
