"""Kill programs at random times, let the same command resume, and compare all bytes at the end.

    python -m trials.torture [KILLS] [--seed SEED] [--only KIND ...] [--folder FOLDER]

The victims are runs and ensembles with checkpoints, drivers of sweeps, their worker processes, and
driver, worker and scheduler of a Dask cluster. Most kills are SIGKILL, some SIGTERM, SIGINT, or two
signals in a row. A table shows the number of kills, what was lost (present before a kill but not
after it) or changed (different bytes than without kills), and how often a command failed otherwise.

Programs are forks of this process, which has imported and compiled everything, so a kill costs
milliseconds. Workers start as usual.
"""

import argparse
import faulthandler
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{name}_NUM_THREADS"] = "1"  # a process with threads is not forked

import numpy as np  # noqa: E402
import tqdm  # noqa: E402

import magmotor as mm  # noqa: E402
from magmotor.device import checkpoint as checkpoints  # noqa: E402
from magmotor.device import job as jobs  # noqa: E402
from magmotor.devices.disk.ensemble import run as ensembles  # noqa: E402
from magmotor.sweep.compute import netcdf  # noqa: E402
from trials.checkpoint_files import parsed  # noqa: E402

tqdm.tqdm.monitor_interval = 0  # which would be a thread

ENDED_BY_INTERRUPT = 130
PATIENCE = 100.0
"""Seconds after which a command counts as hung."""

NUMERICS: dict[str, Any] = {"method": "variational/baoab", "timestep": 0.05}


def simulate(folder: Path) -> None:
    """Run the motor with a checkpoint after each chunk."""
    folder.mkdir(parents=True, exist_ok=True)
    run = mm.simulate(
        mm.Motor(), method="variational/baoab", timestep=0.1, duration=4000.0, record_interval=20,
        replicas=2, seed=3, checkpoint=folder / "run.checkpoint",
    )  # fmt: skip
    (folder / "run.nc").write_bytes(netcdf(run))


def ensemble(folder: Path) -> None:
    """Run an ensemble of disks with a checkpoint at each opportunity."""
    folder.mkdir(parents=True, exist_ok=True)
    run = mm.ensemble(
        mm.Disk(), **NUMERICS, duration=4000.0, replicas=200, sample_interval=20, seed=4,
        checkpoint=folder / "run.checkpoint", threads=1,
    )  # fmt: skip
    (folder / "run.nc").write_bytes(netcdf(run))


def sweep_of(measure: str, cases: int, duration: float) -> mm.sweep.Sweep:
    """A sweep over the noise of the disk."""
    return mm.sweep.Sweep(
        scene=mm.Disk(), vary={"noise": np.linspace(1, 4, cases)}, measure=[measure],
        duration=duration, **NUMERICS,
    )  # fmt: skip


def driver(folder: Path) -> None:
    """Drive sweeps with threads as workers."""
    with ThreadPoolExecutor(2) as executor:
        ran(folder / "numbers", "temperature", 40, executor=executor, workers=2)
        ran(folder / "runs", "trajectory", 12, executor=executor, workers=2)


def workers(folder: Path) -> None:
    """Drive a sweep with two worker processes."""
    ran(folder / "numbers", "temperature", 24, workers=2, duration=5000.0)


def cluster(folder: Path, address: str) -> None:
    """Drive a sweep on a Dask cluster."""
    with mm.sweep.dask_workers(address) as (executor, threads):
        ran(folder / "numbers", "temperature", 60, executor=executor, workers=threads)


def ran(folder: Path, measure: str, cases: int, duration: float = 200.0, **by: Any) -> None:
    """Run a sweep, and repeat cases that died twice with their workers."""
    sweep = sweep_of(measure, cases, duration)
    for _ in range(2):
        if not mm.sweep.run(sweep, folder, retry=True, **by).failed:
            return
    raise AssertionError(mm.sweep.status(folder).errors)


@dataclass
class Row:
    """Results for one kind of victim."""

    kills: int = 0
    whole: int = 0
    lost: list[str] = field(default_factory=list)
    changed: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)


def forked(command: Callable[..., None], *arguments: Any) -> int:
    """Start a command in a fork of this process; return its process id."""
    sys.stdout.flush()
    if pid := os.fork():
        return pid
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        faulthandler.enable()
        tqdm.tqdm.set_lock(threading.RLock())  # its own outlives a process that was killed with it
        jobs.CHUNK, checkpoints.SECONDS_BETWEEN, ensembles.SECONDS_BETWEEN_CHECKS = 2000, 0.0, 0.005
        command(*arguments)
        code = 0
    except KeyboardInterrupt:
        code = ENDED_BY_INTERRUPT
    except mm.sweep.NoWorkers as error:
        print(f"  {error}", file=sys.stderr)
        code = ENDED_BY_INTERRUPT
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def waited(pid: int, seconds: float) -> int | None:
    """Return the exit code of a process, negative for a signal; None if it has not ended."""
    deadline = time.monotonic() + seconds
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if (left := deadline - time.monotonic()) <= 0:
            return None
        time.sleep(min(0.002, left))


def results(folder: Path) -> dict[str, bytes]:
    """Return the permanent files in a folder."""
    ours = (p for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))
    files = {str(p.relative_to(folder)): p for p in ours}
    return {k: p.read_bytes() for k, p in files.items() if not {"parts", "claims"} & {*p.parts}}


def children(pid: int) -> list[int]:
    """Return the worker processes that a process has started."""
    found = []
    for thread in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            found += thread.read_text().split()
    return [int(child) for child in found if _is_worker(child)]


def _is_worker(pid: str) -> bool:
    try:
        return "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return False


class Torture:
    """Kills of one kind of victim, at times that follow from a seed.

    Parameters
    ----------
    kind : str
    command : callable
        Takes a folder, and resumes its work there when it is called again.
    folder : Path
        Working folder.
    seed : int
    """

    def __init__(self, kind: str, command: Callable[..., None], folder: Path, seed: int):
        self.kind, self.command, self.folder = kind, command, folder
        self.random = random.Random(f"{kind} {seed}")
        self.row = Row()
        begin = time.monotonic()
        if waited(forked(command, folder / "truth"), PATIENCE) != 0:
            raise SystemExit(f"{kind} fails without any kill")
        self.lasting = time.monotonic() - begin
        self.truth = results(folder / "truth")

    def kill(self, kills: int) -> Row:
        """Kill victims a number of times, and let each resume until it has finished."""
        while self.row.kills < kills:
            self._round(self.folder / f"{self.row.whole}", kills)
            self.row.whole += 1
        return self.row

    def _round(self, place: Path, kills: int) -> None:
        while True:
            pid = forked(self.command, place)
            disturbed = self.row.kills < kills
            before = self.row.kills
            code = self._disturb(pid, place) if disturbed else waited(pid, PATIENCE)
            if disturbed and self.row.kills == before:
                self.lasting *= 0.7  # it had finished: kill the next one earlier
            if code is None:
                os.kill(pid, signal.SIGABRT)  # faulthandler prints where it hangs
                os.waitpid(pid, 0)
                self.row.failed.append(f"{place}: it hangs")
            elif code > 0 and code != ENDED_BY_INTERRUPT:
                self.row.failed.append(f"{place}: exit code {code}")
            elif code == 0:
                break
            if len(self.row.failed) > 10:
                raise SystemExit("\n".join(self.row.failed))
        left = results(place)
        names = {name for name in {*left, *self.truth} if not name.endswith(".checkpoint")}
        self.row.lost += [f"{place}/{name}" for name in sorted(names - left.keys())]
        both = names & left.keys()
        self.row.changed += [f"{place}/{n}" for n in sorted(both) if left[n] != self.truth.get(n)]
        shutil.rmtree(place)

    def _disturb(self, pid: int, place: Path) -> int | None:
        """Kill a process after a while; return its exit code."""
        code = waited(pid, self.random.uniform(0, self.lasting / 2))
        if code is not None:
            return code
        self._signal(pid)
        before = results(place) if place.exists() else {}
        code = waited(pid, PATIENCE)
        self._check_files(place, before)
        return code

    def _signal(self, pid: int) -> None:
        deadly, soft = signal.SIGKILL, (signal.SIGTERM, signal.SIGINT)
        first = self.random.choices((deadly, *soft), (6, 1, 2))[0]
        os.kill(pid, first)
        self.row.kills += 1
        if first != deadly and self.random.random() < 0.5:
            time.sleep(self.random.uniform(0, 0.02))
            os.kill(pid, self.random.choice((deadly, *soft)))
            self.row.kills += 1

    def _check_files(self, place: Path, before: dict[str, bytes]) -> None:
        """Record files that are lost, and checkpoints that are unreadable or went back."""
        after = results(place) if place.exists() else {}
        self.row.lost += [f"{place}/{name}" for name in before if name not in after]
        for name, content in after.items():
            if name.endswith(".checkpoint"):
                try:
                    done = parsed(content)[0]["done"]
                    if name in before and done < parsed(before[name])[0]["done"]:
                        self.row.lost.append(f"{place}/{name}: it went back to record {done}")
                except (ValueError, AssertionError) as error:
                    self.row.lost.append(f"{place}/{name}: {error!r}")
            elif name != "run.nc" and content != self.truth.get(name):
                self.row.changed.append(f"{place}/{name}")


class WorkerTorture(Torture):
    """Kills of worker processes, one or two at a time, while the driver continues."""

    def _disturb(self, pid: int, place: Path) -> int | None:
        for _ in range(3):
            code = waited(pid, self.random.uniform(0, self.lasting / 2))
            if code is not None:
                return code
            for child in self.random.sample(found := children(pid), min(len(found), 2)):
                if self.random.random() < 0.7:
                    with suppress(ProcessLookupError):
                        os.kill(child, signal.SIGKILL)
                        self.row.kills += 1
        return waited(pid, PATIENCE)


class ClusterTorture(Torture):
    """Kills of a cluster's driver, workers and scheduler, which are restarted."""

    def __init__(self, kind: str, command: Callable[..., None], folder: Path, seed: int):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.parts: dict[str, subprocess.Popen] = {}
        self._start()
        try:
            super().__init__(kind, lambda place: command(place, self.address), folder, seed)
        except BaseException:
            self.close()
            raise

    def _start(self) -> None:
        """Start the parts that do not run, and wait for the workers."""
        programs = {
            "scheduler": ("scheduler", "--host", "127.0.0.1", "--port", str(self.port)),
            **dict.fromkeys(("one", "other"), ("worker", self.address, "--no-nanny")),
        }
        for name, (program, *rest) in programs.items():
            if name not in self.parts or self.parts[name].poll() is not None:
                more = () if program == "scheduler" else ("--nthreads", "1")
                line = [sys.executable, "-m", f"distributed.cli.dask_{program}", *rest, *more]
                self.parts[name] = subprocess.Popen(
                    [*line, "--no-dashboard"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
        deadline = time.monotonic() + PATIENCE
        while waited(forked(self._found), PATIENCE) != 0:
            if time.monotonic() > deadline:
                raise SystemExit("the cluster does not start")
            time.sleep(0.1)

    def _found(self) -> None:
        with suppress(ValueError), mm.sweep.dask_workers(self.address) as (_, threads):
            os._exit(0 if threads == 2 else ENDED_BY_INTERRUPT)
        os._exit(ENDED_BY_INTERRUPT)

    def _disturb(self, pid: int, place: Path) -> int | None:
        code = waited(pid, self.random.uniform(0, self.lasting))
        if code is not None:
            return code
        victim = self.random.choices(("driver", "one", "both", "scheduler"), (4, 3, 1, 1))[0]
        if victim == "driver":
            self._signal(pid)
            return waited(pid, PATIENCE)
        for name in ("one", "other") if victim == "both" else (victim,):
            self.parts[name].kill()
            self.parts[name].wait()
            self.row.kills += 1
        if victim == "scheduler":
            for name in ("one", "other"):
                self.parts[name].kill()  # they would wait for it
                self.parts[name].wait()
        self._start()
        return waited(pid, PATIENCE)

    def close(self) -> None:
        """End the cluster."""
        for part in self.parts.values():
            part.kill()
            part.wait()


SCENES: dict[str, tuple[type[Torture], Callable[..., None], float]] = {
    "simulate": (Torture, simulate, 0.25),
    "ensemble": (Torture, ensemble, 0.2),
    "driver": (Torture, driver, 0.25),
    "workers": (WorkerTorture, workers, 0.2),
    "cluster": (ClusterTorture, cluster, 0.1),
}
"""How each kind of victim is killed, what it does, and its share of the kills."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("kills", type=int, nargs="?", default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=SCENES, default=[*SCENES])
    parser.add_argument("--folder", type=Path, help="working folder; by default a temporary one")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    total = sum(SCENES[kind][2] for kind in options.only)
    rows = {}
    with ExitStack() as stack:
        folder = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        _warm(folder / "warm")
        for kind in options.only:
            begin = time.monotonic()
            cls, command, part = SCENES[kind]
            torture = cls(kind, command, folder / kind, options.seed)
            if isinstance(torture, ClusterTorture):
                stack.enter_context(closing(torture))
            rows[kind] = row = torture.kill(max(1, round(options.kills * part / total)))
            print(f"{kind}: {row.kills} kills in {time.monotonic() - begin:.0f} s", flush=True)
    print(f"\n{'':10}{'kills':>8}{'done':>8}{'lost':>8}{'changed':>8}{'failed':>8}")
    for kind, row in [*rows.items(), ("all", _sum(rows))]:
        numbers = (row.kills, row.whole, *map(len, (row.lost, row.changed, row.failed)))
        print(f"{kind:10}" + "".join(f"{number:8}" for number in numbers))
    wrong = [line for row in rows.values() for line in (*row.lost, *row.changed, *row.failed)]
    if wrong:
        print("\n".join(wrong[:50]))
        raise SystemExit(1)


def _sum(rows: dict[str, Row]) -> Row:
    whole = Row()
    for row in rows.values():
        for name, value in vars(row).items():
            setattr(whole, name, getattr(whole, name) + value)
    return whole


def _warm(folder: Path) -> None:
    """Import and compile what the forks of this process use."""
    simulate_warm = {"duration": 10.0, "method": "variational/baoab", "timestep": 0.1}
    run = mm.simulate(mm.Motor(), replicas=2, **simulate_warm)
    netcdf(run)
    mm.ensemble(mm.Disk(), **NUMERICS, duration=10.0, replicas=4, sample_interval=20, threads=1)
    sweep_of("temperature", 2, 5.0)
    mm.simulate(mm.Disk(), duration=5.0, **NUMERICS)


if __name__ == "__main__":
    main()
