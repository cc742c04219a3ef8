"""Sweeps that are killed, shared, or out of disk space: what they leave, and how they resume."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
import sweep_measures
from refusals import refused
from sweep_driver import FEW, SWEEP, contents, drive, environment

import magmotor as mm
from magmotor.common import files as whole_files
from magmotor.sweep import Sweep
from magmotor.sweep import directory as directory_module
from magmotor.sweep import process_pool as pool_module
from magmotor.sweep.dask_cluster import Cluster
from magmotor.sweep.directory import Directory
from magmotor.sweep.driver import DIED
from magmotor.sweep.process_pool import ONE_THREAD, Pool, WorkerDied

TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the files of an undisturbed sweep, computed one case after another."""
    directory = tmp_path_factory.mktemp("whole") / "sweep"
    with ThreadPoolExecutor(8) as executor:
        mm.sweep.run(SWEEP, directory, workers=8, executor=executor)
    files = contents(directory)
    assert len(files) == 1 + len(SWEEP)
    return files


def results(files):
    """Return the permanent files of a killed driver."""
    return {k: v for k, v in files.items() if not k.startswith(("parts/", "claims/"))}


def start(directory, **options):
    """Start a driver as a program; with `until` it waits after `FEW` results for that file."""
    command = [sys.executable, str(TESTS / "sweep_driver.py"), str(directory), json.dumps(options)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_results(directory, number=FEW):
    deadline = time.monotonic() + 120
    while len([*directory.glob("done/*/*")]) < number:
        assert time.monotonic() < deadline
        time.sleep(0.01)


def children(pid):
    """Return the worker processes that a process has started."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    found = [child for thread in threads for child in thread.read_text().split()]
    lines = {int(child): Path(f"/proc/{child}/cmdline").read_text() for child in found}
    return [child for child, line in lines.items() if "spawn_main" in line]


def alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_workers_take_one_thread_each_and_leave_nothing_behind():
    before = dict(os.environ)
    pool = Pool(1)
    assert pool.submit(environment).result() == ONE_THREAD
    worker = pool.submit(os.getpid).result()
    assert dict(os.environ) == before
    pool.close()
    assert not alive(worker)


def test_a_killed_driver_leaves_whole_results_and_the_same_call_resumes(tmp_path, whole):
    """Partial files are removed and never read."""
    directory = tmp_path / "s"
    driver = start(directory, workers=2, until=str(tmp_path / "never"))
    wait_for_results(directory)
    workers = children(driver.pid)
    assert len(workers) == 2
    driver.kill()
    driver.wait()
    deadline = time.monotonic() + 60
    while any(map(alive, workers)):  # they end with the driver
        assert time.monotonic() < deadline
        time.sleep(0.01)
    driver.communicate()
    kept = results(contents(directory))
    assert len(kept) == 1 + FEW
    assert kept.items() <= whole.items()
    name = next(name for name in whole if name not in kept)
    killed = f"{os.uname().nodename}.{driver.pid}"
    assert killed in {claim.read_text() for claim in directory.glob("claims/*")}
    (directory / "parts" / f"{Path(name).name}.1@{killed}").write_bytes(whole[name][:100])
    assert mm.sweep.status(directory).done == FEW
    tally = drive(directory, threads=8)
    assert tally.computed == len(SWEEP) - FEW
    assert contents(directory) == whole


def test_a_killed_worker_costs_nothing_but_time(tmp_path, whole):
    """It is killed at work; the driver, and Python at its end, print nothing about it."""
    directory = tmp_path / "s"
    driver = start(directory, workers=1, until=str(tmp_path / "killed"))
    wait_for_results(directory)
    (worker,) = children(driver.pid)
    os.kill(worker, signal.SIGKILL)
    (tmp_path / "killed").touch()
    said, errors = driver.communicate(timeout=120)
    assert (driver.returncode, said, errors) == (0, "24 24\n", "")
    assert contents(directory) == whole


class Fragile(ThreadPoolExecutor):
    """Two workers that die once, each with a case."""

    def __init__(self):
        super().__init__(2)
        self.given, self.lost, self.retried = [], {}, []

    def submit(self, fn, /, *args, **kwargs):
        key = args[0].key
        if key in self.lost:
            self.retried.append((key, sum(not future.done() for future in self.given)))
        if len(self.lost) == 2:
            self.given.append(super().submit(fn, *args, **kwargs))
            return self.given[-1]
        self.lost[key] = Future()
        if len(self.lost) == 2:
            for future in self.lost.values():
                future.set_exception(WorkerDied("its process died"))
        return self.lost[key]


def test_cases_whose_workers_die_together_are_retried_one_after_another(tmp_path, whole):
    """Neither beside another case, which would be lost if one killed its process."""
    with Fragile() as executor:
        tally = mm.sweep.run(SWEEP, tmp_path / "s", workers=2, executor=executor)
    assert executor.retried == [(key, 0) for key in executor.lost]
    assert (tally.computed, tally.failed) == (len(SWEEP), 0)
    assert contents(tmp_path / "s") == whole


def _spawned(monkeypatch, act):
    """Call a function for each worker process that has started but is not ready."""
    make = pool_module._Worker.__init__

    def made(self):
        make(self)
        act(self._process)

    monkeypatch.setattr(pool_module._Worker, "__init__", made)


def test_processes_killed_while_they_start_are_started_again(monkeypatch):
    """As often as a pool allows before a call ends, and as often again afterwards."""
    killed, spared = [], []

    def kill(process):
        if len(killed) < pool_module.RESTARTS * (1 + len(spared)):
            killed.append(process.pid)
            process.kill()

    _spawned(monkeypatch, kill)
    with closing(Pool(1)) as pool:
        for _ in range(2):
            spared.append(pool.submit(os.getpid).result(timeout=120))
            with pytest.raises(WorkerDied):
                pool.submit(os._exit, 0).result(timeout=120)
    assert not {*spared} & {*killed}
    assert len(killed) == 2 * pool_module.RESTARTS


def test_processes_that_are_always_killed_end_the_pool(monkeypatch):
    _spawned(monkeypatch, lambda process: process.kill())
    with (
        closing(Pool(1)) as pool,
        pytest.raises(mm.sweep.NoWorkers, match=r"processes are killed as soon as they start$"),
    ):
        pool.submit(os.getpid).result(timeout=120)


def test_a_case_that_kills_its_process_fails_alone(tmp_path):
    sweep = Sweep(
        scene=mm.Disk(),
        vary={"noise": (1.0, 2.0, 3.0, 4.0)},
        measure=["sweep_measures:fatal"],
        method="variational/baoab",
        timestep=0.05,
        duration=5.0,
    )
    tally = mm.sweep.run(sweep, tmp_path / "s", workers=1)  # has the next case behind it
    assert (tally.done, tally.failed) == (3, 1)
    assert mm.sweep.status(tmp_path / "s").errors == {DIED: ["noise = 3"]}


def test_two_drivers_share_a_directory(tmp_path, whole):
    """A program and this process; a worker of each takes one case at a time."""
    directory = tmp_path / "s"
    driver = start(directory, threads=1)
    wait_for_results(directory, 1)
    tally = drive(directory, threads=1)
    said, errors = driver.communicate(timeout=120)
    assert driver.returncode == 0, errors
    assert contents(directory) == whole
    done, computed = map(int, said.split())
    assert done == tally.done == len(SWEEP)
    # At the end each may take what the other has under way, 2 cases. Without claims it would be 47.
    assert len(SWEEP) <= computed + tally.computed <= len(SWEEP) + 4  # 24 to 27
    assert min(computed, tally.computed) > FEW  # 11, 12


def test_drivers_may_begin_a_directory_at_once(tmp_path, monkeypatch):
    """Another driver begins while the first writes, then while the first reads the directory."""
    writes, looks = directory_module.write_whole, Path.iterdir

    def written_meanwhile(path, content, part):
        monkeypatch.setattr(directory_module, "write_whole", writes)
        part.touch()
        monkeypatch.setattr(directory_module, "this_driver", lambda: "another.1")
        Directory(tmp_path / "first", SWEEP)
        assert part.exists()
        writes(path, content, part)

    def begun_meanwhile(path):
        monkeypatch.setattr(Path, "iterdir", looks)
        path.mkdir()
        (path / "claims").mkdir()
        there = [*path.iterdir()]
        (path / "sweep.json").write_bytes((tmp_path / "first" / "sweep.json").read_bytes())
        return there

    monkeypatch.setattr(directory_module, "write_whole", written_meanwhile)
    Directory(tmp_path / "first", SWEEP)
    monkeypatch.setattr(Path, "iterdir", begun_meanwhile)
    Directory(tmp_path / "second", SWEEP)
    assert {*contents(tmp_path / "second")} == {"sweep.json"}


def test_a_driver_killed_at_the_beginning_leaves_a_directory_to_begin_in(tmp_path, whole):
    directory = tmp_path / "s"
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    (directory / "parts").mkdir(parents=True)
    part = directory / "parts" / f"sweep.json.1@{os.uname().nodename}.{gone.pid}"
    part.write_bytes(whole["sweep.json"][:10])
    with ThreadPoolExecutor(8) as executor:
        mm.sweep.run(SWEEP, directory, workers=8, executor=executor)
    assert contents(directory) == whole


def test_files_of_drivers_on_other_machines_are_kept(tmp_path):
    """Including one whose name ends with the name of this machine."""
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    store = Directory(tmp_path, SWEEP)
    (tmp_path / "claims").mkdir()
    names = [f"{host}{os.uname().nodename}.{gone.pid}" for host in ("gpu-", "a.", "")]
    for name in names:
        (tmp_path / "claims" / name).write_text(name)
        (tmp_path / "parts" / f"1.json.1@{name}").touch()
    store.remove_leftovers()
    assert {path.name for path in tmp_path.glob("claims/*")} == {*names[:2]}
    assert {path.name for path in tmp_path.glob("parts/*")} == {f"1.json.1@{n}" for n in names[:2]}


def test_threads_of_a_driver_may_write_the_same_results(tmp_path, whole):
    def work(_):
        with ThreadPoolExecutor(4) as executor:
            return mm.sweep.run(SWEEP, tmp_path / "s", workers=4, executor=executor)

    with ThreadPoolExecutor(2) as drivers:
        tallies = [*drivers.map(work, range(2))]
    assert [tally.done for tally in tallies] == [len(SWEEP)] * 2
    assert contents(tmp_path / "s") == whole


def test_unrelated_files_in_parts_are_kept(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mine.txt").touch()
    with refused("directory"):
        Directory(tmp_path, SWEEP)


NO_MAIN = """
import sys
import magmotor as mm
from magmotor.sweep import Sweep
sweep = Sweep(scene=mm.Disk(), vary={"noise": (1, 2)}, measure=["displacement"], duration=1.0,
              method="variational/baoab", timestep=0.05)
try:
    mm.sweep.run(sweep, sys.argv[1], workers=1)
except mm.sweep.NoWorkers as error:
    raise SystemExit(f"cannot: {error}")
"""


def test_a_script_without_a_main_guard_gets_an_explanation(tmp_path):
    (tmp_path / "script.py").write_text(NO_MAIN)
    command = [sys.executable, str(tmp_path / "script.py"), str(tmp_path / "s")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("cannot: worker processes end as soon as they")
    assert 'below `if __name__ == "__main__":`' in ended.stderr
    assert mm.sweep.status(tmp_path / "s").missing == 2  # none is blamed


def test_a_full_disk_stops_the_sweep_and_loses_nothing(tmp_path, whole, monkeypatch):
    directory, fsync, calls = tmp_path / "s", os.fsync, []

    def full(descriptor):
        calls.append(descriptor)
        if len(calls) > 1 + FEW:
            raise OSError(errno.ENOSPC, "No space left on device")
        fsync(descriptor)

    with monkeypatch.context() as patch, ThreadPoolExecutor(2) as executor:
        patch.setattr(whole_files.os, "fsync", full)
        with pytest.raises(OSError, match="No space left on device"):
            mm.sweep.run(SWEEP, directory, workers=2, executor=executor)
    left = contents(directory)
    assert len(left) == 1 + FEW
    assert left.items() <= whole.items()
    with ThreadPoolExecutor(8) as executor:
        mm.sweep.run(SWEEP, directory, workers=8, executor=executor)
    assert contents(directory) == whole


def test_a_full_disk_of_a_worker_fails_no_case(tmp_path, monkeypatch):
    sweep = Sweep(
        scene=mm.Disk(), vary={"noise": (1.0, 2.0, 3.0)}, measure=["sweep_measures:saved"],
        method="variational/baoab", timestep=0.05, duration=5.0,
    )  # fmt: skip
    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(OSError, match="No space left on device") as stop:
            mm.sweep.run(sweep, tmp_path / "s", workers=1, executor=executor)
        assert stop.value.filename == "disk/file"
        found = mm.sweep.status(tmp_path / "s")
        assert (found.done, found.failed, found.missing) == (1, 0, 2)
        monkeypatch.setattr(sweep_measures, "full", False)
        assert mm.sweep.run(sweep, tmp_path / "s", workers=1, executor=executor).done == 3


def test_whole_runs_need_no_temporary_folder(tmp_path, monkeypatch):
    sweep = Sweep(
        scene=mm.Disk(), vary={"noise": (1.0, 2.0)}, measure=["trajectory"],
        method="variational/baoab", timestep=0.05, duration=5.0,
    )  # fmt: skip
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "no such folder"))
    with ThreadPoolExecutor(1) as executor:
        tally = mm.sweep.run(sweep, tmp_path / "s", workers=1, executor=executor)
    assert (tally.done, tally.failed) == (2, 0)


def drive_until_few(directory, monkeypatch, intervene, **by):
    """Run the sweep, by threads unless something else is given; intervene after `FEW` results."""
    keep, kept = Directory.keep, []

    def counted(self, case, outcome):
        keep(self, case, outcome)
        kept.append(case)
        if len(kept) == FEW:
            intervene()

    with monkeypatch.context() as patch:
        patch.setattr(Directory, "keep", counted)
        return drive(directory, **by or {"threads": 8})


def test_a_directory_that_is_moved_ends_the_sweep_which_can_be_resumed(
    tmp_path, whole, monkeypatch
):
    directory, moved = tmp_path / "s", tmp_path / "moved"
    with pytest.raises(FileNotFoundError, match="moved or removed while the sweep ran"):
        drive_until_few(directory, monkeypatch, lambda: directory.rename(moved))
    assert not directory.exists()
    with ThreadPoolExecutor(8) as executor:
        mm.sweep.run(SWEEP, moved, workers=8, executor=executor)
    assert results(contents(moved)) == whole


def test_another_directory_in_its_place_ends_the_sweep(tmp_path, monkeypatch):
    directory = tmp_path / "s"

    def replace():
        shutil.rmtree(directory)
        directory.mkdir()

    with pytest.raises(FileNotFoundError, match="moved or removed while the sweep ran"):
        drive_until_few(directory, monkeypatch, replace)
    assert not contents(directory)


def test_results_that_are_removed_during_the_sweep_do_not_count(tmp_path, whole, monkeypatch):
    directory = tmp_path / "s"
    with pytest.raises(FileNotFoundError, match=f"{FEW} of {len(SWEEP)} results are missing"):
        drive_until_few(directory, monkeypatch, lambda: shutil.rmtree(directory / "done"))
    with ThreadPoolExecutor(8) as executor:
        mm.sweep.run(SWEEP, directory, workers=8, executor=executor)
    assert results(contents(directory)) == whole


SMALL_DISK = """
import shutil, subprocess, sys
disk, tests, copies = sys.argv[1:]
sys.path.append(tests)
from sweep_driver import drive

for size, name in ("size=64k", "full"), ("remount,size=8m", "whole"):
    if subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", disk]).returncode:
        raise SystemExit("cannot mount")
    try:
        print(drive(f"{disk}/s", threads=2).computed)
    except OSError as error:
        print(error.strerror)
    shutil.copytree(f"{disk}/s", f"{copies}/{name}")
"""


def test_a_small_disk_fills_up(tmp_path, whole):
    """A tmpfs of 64 kB in a separate mount namespace."""
    own = ["unshare", "--mount", "--map-root-user"]
    probe = [*own, "mount", "-t", "tmpfs", "tmpfs", str(tmp_path)]
    if shutil.which("unshare") is None or subprocess.run(probe, capture_output=True).returncode:
        pytest.skip("mount namespaces are not for this user here")
    (tmp_path / "disk").mkdir()
    command = [*own, sys.executable, "-c", SMALL_DISK, tmp_path / "disk", TESTS, tmp_path]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert (ended.returncode, ended.stderr) == (0, "")
    first, second = ended.stdout.splitlines()
    assert first == "No space left on device"
    left = contents(tmp_path / "full")
    assert 1 < len(left) < 1 + len(SWEEP)
    assert left.items() <= whole.items()
    assert int(second) == len(SWEEP) - (len(left) - 1)
    assert contents(tmp_path / "whole") == whole


def test_cases_claimed_by_a_lost_machine_come_last(tmp_path, whole):
    directory = tmp_path / "s"
    Directory(directory, SWEEP)
    lost = [case.key for case in [*SWEEP][:5]]
    for key in lost:
        (directory / "claims").mkdir(exist_ok=True)
        (directory / "claims" / key).write_text("another-machine.1")
    kept = []

    class Watched(Directory):
        def keep(self, case, outcome):
            kept.append(case.key)
            super().keep(case, outcome)

    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as executor:
        patch.setattr(sys.modules["magmotor.sweep.driver"], "Directory", Watched)
        mm.sweep.run(SWEEP, directory, workers=1, executor=executor)
    assert {*kept[-5:]} == {*lost}
    assert contents(directory) == whole


def test_an_interrupted_driver_releases_its_claims(tmp_path):
    class Interrupted(ThreadPoolExecutor):
        def submit(self, fn, /, *args, **kwargs):
            raise KeyboardInterrupt

    with pytest.raises(mm.sweep.SweepInterrupted), Interrupted(1) as executor:
        mm.sweep.run(SWEEP, tmp_path / "s", executor=executor)
    assert {*contents(tmp_path / "s")} == {"sweep.json"}


class Lost(Cluster):
    """A cluster with the numbers of threads in a list; its cases end once it has some again."""

    def __init__(self, threads):
        self._threads, self._given = threads, []

    def submit(self, fn, /, *args, **kwargs):
        self._given.append((future := Future(), fn, args))
        if self._threads[0]:
            self._work()
        return future

    def threads(self):
        if len(self._threads) > 1:
            self._threads.pop(0)
        if self._threads[0]:
            self._work()
        return self._threads[0]

    def _work(self):
        while self._given:
            future, fn, args = self._given.pop()
            future.set_result(fn(*args))


def test_a_cluster_without_workers_ends_the_sweep_or_comes_back(tmp_path, monkeypatch, capsys):
    driver = sys.modules["magmotor.sweep.driver"]
    monkeypatch.setattr(driver, "POLL_SECONDS", 0.02)
    monkeypatch.setattr(driver, "LOST_SECONDS", 0.1)
    sweep = Sweep(
        scene=mm.Disk(), vary={"noise": (1.0, 2.0)}, measure=["temperature"], duration=1.0,
        method="variational/baoab", timestep=0.05,
    )  # fmt: skip
    with pytest.raises(mm.sweep.NoWorkers):
        mm.sweep.run(sweep, tmp_path / "s", executor=Lost([0]))
    said = "the cluster has no workers left; the sweep ends unless one returns within 0.1 s\n"
    assert capsys.readouterr().err.split("\r")[-1] == said
    assert {*contents(tmp_path / "s")} == {"sweep.json"}
    monkeypatch.setattr(driver, "LOST_SECONDS", 60.0)
    assert mm.sweep.run(sweep, tmp_path / "s", executor=Lost([0, 0, 0, 2])).done == 2


TORTURE = [
    sys.executable,
    "-m",
    "trials.torture",
    "9",
    "--only",
    "simulate",
    "ensemble",
    "driver",
]


def test_an_error_of_the_cluster_is_not_an_error_of_a_case(tmp_path):
    class Confused(Lost):
        def submit(self, fn, /, *args, **kwargs):
            future = Future()
            future.set_exception(AttributeError("'NoneType' object has no attribute"))
            return future

    with pytest.raises(mm.sweep.NoWorkers):
        mm.sweep.run(SWEEP, tmp_path / "s", executor=Confused([1]))
    assert mm.sweep.status(tmp_path / "s").missing == len(SWEEP)


def test_a_few_rounds_of_torture():
    ended = subprocess.run(TORTURE, cwd=TESTS.parent, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    name, kills, _, lost, changed, failed = ended.stdout.splitlines()[-1].split()
    assert (name, lost, changed, failed) == ("all", "0", "0", "0")
    assert int(kills) >= 9
