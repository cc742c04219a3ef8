"""Sweeps on a Dask cluster with two worker processes on the loopback interface."""

import gc
import os
import signal
import socket

import pytest
from sweep_driver import FEW, SWEEP, contents, drive, environment
from test_sweep_resume import drive_until_few, results, start, wait_for_results, whole

import magmotor as mm
from magmotor.sweep import dask_cluster
from magmotor.sweep.process_pool import ONE_THREAD

__all__ = ["whole"]

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def scheduler():
    with mm.sweep.local_cluster(2) as address:
        yield address


def test_the_same_files_as_without_it(scheduler, tmp_path, whole):
    assert scheduler.startswith("tcp://127.0.0.1:")
    with mm.sweep.dask_workers(scheduler) as (executor, workers):
        assert workers == 2
        assert executor.submit(environment).result() == ONE_THREAD
    tally = drive(tmp_path / "s", scheduler=scheduler)
    assert tally.computed == len(SWEEP)
    assert contents(tmp_path / "s") == whole


def test_a_killed_driver_leaves_whole_results_and_the_same_call_resumes(scheduler, tmp_path, whole):
    driver = start(tmp_path / "s", scheduler=scheduler, until=str(tmp_path / "never"))
    wait_for_results(tmp_path / "s")
    driver.kill()
    driver.communicate()
    kept = contents(tmp_path / "s")
    assert len([*(tmp_path / "s").glob("done/*/*")]) == FEW
    assert results(kept).items() <= whole.items()
    drive(tmp_path / "s", scheduler=scheduler)
    assert contents(tmp_path / "s") == whole


def test_a_killed_worker_costs_nothing_but_time(scheduler, tmp_path, whole, monkeypatch):
    killed = []

    def kill():
        with mm.sweep.dask_workers(scheduler) as (executor, _):
            killed.append(executor.submit(os.getpid).result())
            os.kill(killed[-1], signal.SIGKILL)

    tally = drive_until_few(tmp_path / "s", monkeypatch, kill, scheduler=scheduler)
    assert (tally.done, tally.computed, len(killed)) == (24, 24, 1)
    assert contents(tmp_path / "s") == whole


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr(dask_cluster, "CONNECT_SECONDS", 1.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with (
        pytest.raises(ValueError, match=r"scheduler = 'tcp.*: must be the address of a "),
        mm.sweep.dask_workers(address),
    ):
        pass
    with (
        pytest.raises(ValueError, match="scheduler = 'nonsense:'"),
        mm.sweep.dask_workers("nonsense:"),
    ):
        pass
    # Collected later, while a lock of Dask's is held, one that failed would wait for it for ever.
    assert not [found for found in gc.get_objects() if type(found) is distributed.Client]


def test_two_clusters_run_side_by_side(scheduler):
    with mm.sweep.local_cluster(1) as other:  # without a warning that a port is taken
        assert other.startswith("tcp://127.0.0.1:")
        assert other != scheduler
