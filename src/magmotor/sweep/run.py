"""A sweep under way: which cases are to be run, by whom, and what becomes of them."""

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

from tqdm import tqdm

from magmotor.common.arguments import check_flag
from magmotor.common.checks import check_integer, check_type, reject
from magmotor.common.interrupts import deferred
from magmotor.sweep.case import Case
from magmotor.sweep.dask_cluster import Cluster
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory, folder_of
from magmotor.sweep.measures import imported, is_own
from magmotor.sweep.process_pool import NoWorkers, Pool, WorkerDied
from magmotor.sweep.sealed import Damaged
from magmotor.sweep.worker import OtherVersions, Outcome, compute

AHEAD = 2
"""Cases under way for each worker: one is computed, one waits."""

LOOK_SECONDS = 5.0
"""How often a cluster is looked at whether it has workers, while none of its cases ends."""

LOST_SECONDS = 60.0
"""How long a cluster may be without workers before the sweep ends."""

DIED = "its worker process died (killed, or out of memory?)"


@dataclass
class Tally:
    """How far a sweep has come.

    Attributes
    ----------
    cases, done, failed : int
        In all; with a result; with an error.
    computed : int
        Done or failed by this call.
    seconds : float
        Wall time that the workers spent on these.
    """

    cases: int
    done: int = 0
    failed: int = 0
    computed: int = 0
    seconds: float = 0.0

    def __str__(self) -> str:
        """For people."""
        missing = self.cases - self.done - self.failed
        left = f", {missing} missing" if missing else ""
        return f"{self.cases} cases: {self.done} done, {self.failed} failed{left}"


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; what was done is on disk, and the same call goes on."""


def run(
    sweep: Sweep,
    directory: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    retry: bool = False,
) -> Tally:
    """Run the cases of a sweep that have no result yet, and write each result when it is there.

    A sweep that was stopped, in whatever way, goes on when it is run again: nothing is lost but the
    cases that were under way, and results are the same to the bit. Several calls, on one machine or
    many, may work on one directory. A result that is damaged is computed again, with a warning. A
    case whose worker process dies is tried once more, alone, and fails if the process dies again.

    Parameters
    ----------
    sweep : Sweep
    directory : str or Path
        Where results are; made if it is not there.
    workers : int, optional
        How many processes; with an `executor`, how many it has. By default as many as cores.
    executor : concurrent.futures.Executor, optional
        Takes the cases instead of processes of this machine: that of `dask_workers`, for example.
    retry : bool
        Run failed cases again.

    Returns
    -------
    Tally

    Raises
    ------
    ValueError
        The directory holds another sweep, or the sweep was read from a file and has a measure
        `package.module:function` that nobody has allowed.
    OSError
        A result cannot be written; those before it are there.
    SweepInterrupted
        Ctrl-C.
    NoWorkers
        Worker processes end as soon as they start, the executor drops cases, or a Dask cluster has
        had no workers for 60 s. What was done is on disk, and the same call goes on.
    OtherVersions
        The workers compute with other versions than this process.

    Warns
    -----
    UserWarning
        A file is damaged and is written again.
    """
    check_type("sweep", sweep, Sweep)
    retry = check_flag("retry", retry)
    workers = (os.cpu_count() or 1) if workers is None else workers
    workers = check_integer("workers", workers, at_least=1)
    if not (executor is None or callable(getattr(executor, "submit", None))):
        raise reject("executor", executor, "must be a concurrent.futures.Executor, or None")
    for name in filter(is_own, sweep.measure):
        imported(name)
    store = Directory(folder_of(directory), sweep)
    store.remove_what_the_dead_left()
    pool = Pool(workers) if executor is None else None
    driver = _Driver(sweep, store, pool or executor, workers, retry)
    try:
        with driver.progress:
            driver.work()
    except BaseException as error:
        with deferred():  # a second Ctrl-C comes too late
            driver.stop()
        if isinstance(error, KeyboardInterrupt):
            raise SweepInterrupted(f"sweep interrupted; {driver.tally}") from None
        raise
    if pool is not None:
        pool.close()
    return driver.tally


class _Driver:
    """Keeps the workers busy, and what they bring."""

    def __init__(self, sweep: Sweep, store: Directory, workers, count: int, retry: bool):
        self.sweep, self.store, self.workers, self.retry = sweep, store, workers, retry
        self.window = AHEAD * count
        self.tally = Tally(len(sweep))
        self.running: dict[Future, Case] = {}
        self.ended: SimpleQueue[Future] = SimpleQueue()
        self.suspects: list[Case] = []
        self.progress = tqdm(total=len(sweep), desc="sweep", unit="case", smoothing=0, disable=None)

    def work(self) -> None:
        """Until all cases are done or failed."""
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
                self._take(self._ended())

    def stop(self) -> None:
        """Drop the cases that are under way."""
        if isinstance(self.workers, Pool):
            self.workers.close()
        for future in self.running:
            future.cancel()
        self.store.take_back_claims()

    def _cases(self) -> Iterator[Case]:
        """Those that nobody has done, in an order that soon covers the sweep, evenly.

        Last come those that another driver had under way: it may have died.
        """
        size, claimed = len(self.sweep), []
        stride = _stride(size)
        for place in range(size):
            index = place * stride % size
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
        """Whether there is nothing left to do, which is counted."""
        try:
            if self.store.result(case) is not None:
                self.tally.done += 1
            elif not self.retry and self.store.error(case) is not None:
                self.tally.failed += 1
            else:
                return False
        except Damaged as damage:
            warnings.warn(f"{damage}; the case is computed again", stacklevel=2)
            return False
        return True

    def _skip(self) -> None:
        """Count a case that costs nothing: it is no measure of the rate."""
        if not self.progress.disable:
            self.progress.initial += 1
            self.progress.n += 1

    def _submit(self, case: Case) -> None:
        future = self.workers.submit(compute, case, self.sweep.measure)
        self.running[future] = case
        future.add_done_callback(self.ended.put)

    def _ended(self) -> Future:
        """The next to end; of a cluster, NoWorkers if it loses all its workers for long."""
        lost = None
        while True:
            try:
                cluster = isinstance(self.workers, Cluster)
                return self.ended.get(timeout=LOOK_SECONDS if cluster else None)
            except Empty:
                now = time.monotonic()
                if self.workers.threads():
                    lost = None
                elif lost is None:
                    lost = now
                    ends = f"the sweep ends if none comes back within {LOST_SECONDS:g} s"
                    tqdm.write(f"the cluster has no workers left; {ends}", file=sys.stderr)
                elif now - lost >= LOST_SECONDS:
                    gone = f"the cluster has had no workers for {LOST_SECONDS:g} s"
                    raise NoWorkers(f"{gone}; {self.tally}") from None

    def _take(self, future: Future) -> None:
        """Keep what came of a case; one whose process died is tried once more, alone."""
        case = self.running.pop(future)
        if future.cancelled():
            raise NoWorkers("a case was dropped by those who had it: is the cluster gone?")
        error = future.exception()
        if error is None:
            self._keep(case, future.result())
        elif isinstance(error, WorkerDied) and case.key not in [c.key for c in self.suspects]:
            self.suspects.append(case)
        # Dask has tried it several times.
        elif isinstance(error, WorkerDied) or type(error).__name__ == "KilledWorker":
            self._keep(case, Outcome(None, DIED, 0.0))
        elif isinstance(self.workers, Cluster) and not isinstance(error, OtherVersions):
            kind = type(error).__name__  # Dask's, some of them raised by mistakes of its own
            raise NoWorkers(f"the cluster gave a case back undone ({kind}: {error})") from error
        else:
            raise error

    def _keep(self, case: Case, outcome: Outcome) -> None:
        self.store.keep(case, outcome)
        self.suspects = [suspect for suspect in self.suspects if suspect.key != case.key]
        self.tally.computed += 1
        self.tally.seconds += outcome.seconds
        if outcome.error is None:
            self.tally.done += 1
        else:
            self.tally.failed += 1
            self.progress.set_postfix(failed=self.tally.failed, refresh=False)
        self.progress.update()


def _stride(size: int) -> int:
    """About 0.62 of the size, and prime to it: multiples of it cover all places, evenly."""
    stride = max(1, round(0.618 * size))
    while math.gcd(stride, size) > 1:
        stride += 1
    return stride
