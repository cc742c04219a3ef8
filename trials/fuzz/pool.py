"""Worker processes that judge inputs; one that crashes or hangs is reported and replaced."""

import faulthandler
import multiprocessing
import os
import re
import resource
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryDirectory

from .calls import Call
from .judge import Verdict

LIMITS = (20.0, 120.0, 20.0)
"""Seconds that a call may take. A slower one gets a second try, since the first may have compiled
kernels, and then a third."""
MEMORY = 12 << 30
"""Bytes of address space of a worker, so that a huge array is an error and the machine survives."""

CONTEXT = multiprocessing.get_context("forkserver")  # workers import nothing themselves
CONTEXT.set_forkserver_preload(["trials.fuzz.judge", "trials.fuzz.binaries"])

Judge = Callable[[Call], Verdict]


def serve(connection: Connection, folder: str, make: Callable[[], Judge]) -> None:
    """Judge incoming calls in a folder, with printed output redirected to a file."""
    os.chdir(folder)
    words = os.open("../words", os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(words, stream)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.enable(2, all_threads=False)
    faulthandler.register(signal.SIGUSR1, 2, all_threads=False)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
    judge = make()
    connection.send("ready")
    while (call := connection.recv()) is not None:
        connection.send(judge(call))


class Worker:
    """A process and its current call."""

    def __init__(self, make: Callable[[], Judge], limits: Sequence[float]):
        self.make, self.limits = make, limits
        self.call: Call | None = None
        self._start()

    def _start(self) -> None:
        self.folder = TemporaryDirectory(prefix="fuzz-", ignore_cleanup_errors=True)
        inner = Path(self.folder.name) / "here"
        inner.mkdir()
        self.connection, theirs = CONTEXT.Pipe()
        self.process = CONTEXT.Process(
            target=serve, args=(theirs, str(inner), self.make), daemon=True
        )
        self.process.start()
        theirs.close()
        assert self.connection.recv() == "ready"

    def give(self, call: Call | None, attempt: int = 0) -> None:
        """Start a call, if there is one."""
        self.call, self.attempt, self.since = call, attempt, time.monotonic()
        if call is not None:
            self.connection.send(call)

    def verdict(self, ended: bool) -> Verdict | None:
        """Return the verdict on the call; None while it is running or tried again."""
        late = time.monotonic() - self.since > self.limits[self.attempt]
        if not ended:
            return self._killed() if late else None
        verdict = self._taken()
        if self.attempt == 1 and verdict.kind != "crash":
            self.give(self.call, 2)
            return None
        return verdict

    def _taken(self) -> Verdict:
        """Return the process's verdict, or how it died."""
        try:
            return self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            code = self.process.exitcode or 0
            how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            return self._again(Verdict("crash", how, *self._place()))

    def _killed(self) -> Verdict | None:
        """End a call that takes too long."""
        os.kill(self.process.pid or 0, signal.SIGUSR1)
        time.sleep(0.5)
        self.process.kill()
        self.process.join()
        verdict = Verdict("hang", f"more than {self.limits[0]:g} s", *self._place())
        self._again(verdict)
        if self.attempt == 0:
            return self.give(self.call, 1)
        return verdict

    def _again(self, verdict: Verdict) -> Verdict:
        self.folder.cleanup()
        self._start()
        return verdict

    def _place(self) -> tuple[str, str]:
        """Return where the process was, as written by `faulthandler`, and its last output."""
        words = (Path(self.folder.name) / "words").read_text(errors="replace")
        frames = re.findall(r'File "(.*?)", line (\d+)', words)
        ours = [f"{f.split('magmotor/')[-1]}:{n}" for f, n in frames if "/magmotor/" in f]
        other = [f"{f}:{n}" for f, n in frames]
        said = [line for line in words.splitlines() if not line.startswith(("  File", "Current"))]
        return (ours or other or [""])[0], " ".join(said)[-300:]

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.folder.cleanup()


def judged(
    calls: Iterable[Call],
    make: Callable[[], Judge],
    processes: int = 2,
    limits: Sequence[float] = LIMITS,
) -> Iterator[tuple[Call, Verdict]]:
    """Yield the verdicts on calls as they arrive."""
    waiting = iter(calls)
    workers = [Worker(make, limits) for _ in range(processes)]
    try:
        for worker in workers:
            worker.give(next(waiting, None))
        while busy := [worker for worker in workers if worker.call]:
            ended = wait([worker.connection for worker in busy], timeout=1.0)
            for worker in busy:
                call, verdict = worker.call, worker.verdict(worker.connection in ended)
                if call is not None and verdict is not None:
                    yield call, verdict
                    worker.give(next(waiting, None))
    finally:
        for worker in workers:
            worker.end()
