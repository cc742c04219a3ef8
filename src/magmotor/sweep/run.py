"""A sweep under way: which cases are to be run, by whom, and what becomes of them."""

import math
import os
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from tqdm import tqdm

from magmotor.checks import check_integer
from magmotor.interrupts import deferred
from magmotor.sweep.case import Case
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory
from magmotor.sweep.work import Outcome, compute
from magmotor.sweep.workers import Pool

AHEAD = 2
"""Cases under way for each worker: one is computed, one waits."""

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


class NoWorkers(RuntimeError):
    """Nobody takes the cases: processes die whatever they are given, or a cluster is gone."""


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
    many, may work on one directory.

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
        The directory holds another sweep.
    OSError
        A result cannot be written; those before it are there.
    SweepInterrupted
        Ctrl-C.
    NoWorkers
        Worker processes die as soon as they start, or the executor drops cases.
    OtherVersions
        The workers compute with other versions than this process.
    """
    workers = (os.cpu_count() or 1) if workers is None else workers
    check_integer("workers", workers, at_least=1)
    store = Directory(Path(directory), sweep)
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
        while not exhausted or self.running:
            while not (exhausted or self.suspects) and len(self.running) < self.window:
                case = next(cases, None)
                exhausted = case is None
                if case is not None:
                    self._submit(case)
            if self.running:
                self._take(self.ended.get())
            if self.suspects and not self.running:
                self._try_alone()

    def stop(self) -> None:
        """Drop the cases that are under way."""
        if isinstance(self.workers, Pool):
            self.workers.kill()
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
        if self.store.found(case):
            self.tally.done += 1
        elif not self.retry and self.store.error(case) is not None:
            self.tally.failed += 1
        else:
            return False
        return True

    def _skip(self) -> None:
        """Count a case that costs nothing: it is no measure of the rate."""
        if not self.progress.disable:
            self.progress.initial += 1
            self.progress.n += 1

    def _submit(self, case: Case) -> None:
        try:
            future = self.workers.submit(compute, case, self.sweep.measure)
        except BrokenExecutor as error:
            future = Future()
            future.set_exception(error)
        self.running[future] = case
        future.add_done_callback(self.ended.put)

    def _take(self, future: Future) -> None:
        """Keep what came of a case."""
        case = self.running.pop(future)
        if future.cancelled():
            raise NoWorkers("a case was dropped by those who had it: is the cluster gone?")
        error = future.exception()
        if isinstance(error, BrokenExecutor) and isinstance(self.workers, Pool):
            self.suspects.append(case)
        elif error is None:
            self._keep(case, future.result())
        elif type(error).__name__ == "KilledWorker":  # Dask's, which has tried it several times
            self._keep(case, Outcome(None, DIED, 0.0))
        else:
            raise error

    def _keep(self, case: Case, outcome: Outcome) -> None:
        self.store.keep(case, outcome)
        self.tally.computed += 1
        self.tally.seconds += outcome.seconds
        if outcome.error is None:
            self.tally.done += 1
        else:
            self.tally.failed += 1
            self.progress.set_postfix(failed=self.tally.failed, refresh=False)
        self.progress.update()

    def _try_alone(self) -> None:
        """After a process died, give each case that was under way a pool of its own.

        Which of them it was is then known, and it does not take others with it.
        """
        suspects, self.suspects = self.suspects, []
        self._restart()
        for case in suspects:
            self._submit(case)
            self._take(self.ended.get())
            if self.suspects:
                self.suspects = []
                self._restart()
                self._keep(case, Outcome(None, DIED, 0.0))

    def _restart(self) -> None:
        self.workers.restart()
        try:
            self.workers.submit(os.getpid).result()
        except BrokenExecutor:
            raise NoWorkers(
                "worker processes die as soon as they start; a script that runs a sweep must do so"
                ' below `if __name__ == "__main__":`'
            ) from None


def _stride(size: int) -> int:
    """About 0.62 of the size, and prime to it: multiples of it cover all places, evenly."""
    stride = max(1, round(0.618 * size))
    while math.gcd(stride, size) > 1:
        stride += 1
    return stride
