"""Runs that were stopped go on from their checkpoint, the same to the bit."""

import json
from typing import Any

import pytest
from every_method import EVERY_METHOD, short

import magmotor as mm
from magmotor import checkpoint as checkpoints
from magmotor import simulation
from magmotor.devices import DEVICES
from magmotor.engines import job as jobs

DISK: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 10.0,
    "record_interval": 7,
    "seed": 3,
    "replicas": 3,
}


@pytest.fixture(autouse=True)
def short_chunks(monkeypatch):
    monkeypatch.setattr(jobs, "CHUNK", 20)


def stop_in_third_chunk(monkeypatch, scene, exception):
    """Have the device's guard raise while it looks at the third chunk."""
    device = DEVICES[type(scene)]
    real = device.guard

    def guard(scene, first):
        watched = real(scene, first)
        find, seen = watched.first_wrong, []

        def first_wrong(states):
            seen.append(states)
            if len(seen) == 3:
                raise exception
            return find(states)

        watched.first_wrong = first_wrong
        return watched

    monkeypatch.setattr(device, "guard", guard)


def head(path):
    """What the first line of a checkpoint tells."""
    line = path.read_bytes().split(b"\n")[0]
    return json.loads(line[len(checkpoints.MARK) + 10 :])


class _Interrupted(list):
    """Records during whose third addition Ctrl-C comes."""

    def append(self, item):
        super().append(item)
        if len(self) == 4:
            raise KeyboardInterrupt


def test_ctrl_c_after_the_records_and_before_the_state_is_kept(tmp_path, monkeypatch):
    path = tmp_path / "run.npz"
    whole = mm.simulate(mm.Disk(), **DISK)
    resume = simulation._resume

    def resumed(job, saved):
        kept, rest = resume(job, saved)
        return _Interrupted(kept), rest

    with monkeypatch.context() as patch:
        patch.setattr(simulation, "_resume", resumed)
        with pytest.raises(mm.SimulationInterrupted) as stop:
            mm.simulate(mm.Disk(), **DISK, checkpoint=path)
    assert 0 < head(path)["done"] < stop.value.dataset.sizes["time"] - 1
    assert mm.simulate(mm.Disk(), **DISK, checkpoint=path).identical(whole)


@pytest.mark.parametrize(("scene", "method"), EVERY_METHOD)
def test_a_stopped_run_goes_on_to_the_bit(scene, method, tmp_path, monkeypatch):
    arguments = short(scene, method)
    whole = mm.simulate(scene, **arguments)
    path = tmp_path / "run.npz"
    with monkeypatch.context() as patch:
        stop_in_third_chunk(patch, scene, KeyboardInterrupt)
        with pytest.raises(mm.SimulationInterrupted) as stop:
            mm.simulate(scene, checkpoint=path, **arguments)
    reached = stop.value.dataset.sizes["time"]
    assert 1 < reached < whole.sizes["time"]
    assert mm.simulate(scene, checkpoint=path, **arguments).identical(whole)
    finished = path.read_bytes()
    assert mm.simulate(scene, checkpoint=path, **arguments).identical(whole)  # nothing left to do
    assert path.read_bytes() == finished


def test_checkpoints_are_written_now_and_then(tmp_path, monkeypatch):
    """A crash is no interrupt: what was saved before it is there."""
    path = tmp_path / "run.npz"
    monkeypatch.setattr(checkpoints, "SECONDS_BETWEEN", 0.0)
    with monkeypatch.context() as patch:
        stop_in_third_chunk(patch, mm.Disk(), MemoryError)
        with pytest.raises(MemoryError):
            mm.simulate(mm.Disk(), checkpoint=path, **DISK)
    assert head(path)["done"] > 0
    assert mm.simulate(mm.Disk(), checkpoint=path, **DISK).identical(mm.simulate(mm.Disk(), **DISK))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"seed": 4}, "seed = 4; it has 3"),
        ({"timestep": 0.04}, "timestep = 0.04; it has 0.05"),
        ({"duration": 20.0}, "duration = 20.0; it has 10.0"),
        ({"initial": {"x": 1.0}}, "initial = "),
        ({"replicas": 4}, "replicas = 4; it has 3"),
    ],
)
def test_a_checkpoint_of_another_task_is_refused(changes, named, tmp_path):
    path = tmp_path / "run.npz"
    mm.simulate(mm.Disk(), checkpoint=path, **DISK)
    with pytest.raises(ValueError, match=f"checkpoint = .*one of {named}"):
        mm.simulate(mm.Disk(), checkpoint=path, **{**DISK, **changes})
    with pytest.raises(ValueError, match=r"checkpoint = .*scene_fields"):
        mm.simulate(mm.Disk(x=0.5), checkpoint=path, **DISK)


def test_a_file_that_is_no_checkpoint_is_refused_and_left(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("not mine")
    with pytest.raises(ValueError, match="must be a checkpoint, or no file"):
        mm.simulate(mm.Disk(), checkpoint=path, **DISK)
    assert path.read_text() == "not mine"


def test_without_room_the_run_goes_on_with_a_warning(tmp_path):
    with pytest.warns(UserWarning, match="no checkpoint .*; the one before it stays"):
        run = mm.simulate(mm.Disk(), checkpoint=tmp_path / "missing" / "run.npz", **DISK)
    assert run.identical(mm.simulate(mm.Disk(), **DISK))


def test_a_checkpoint_that_is_a_folder_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^checkpoint = .*: must be a file, or no file$"):
        mm.simulate(mm.Disk(), **DISK, checkpoint=tmp_path)
    below_a_file = tmp_path / "file" / "run.npz"
    below_a_file.parent.touch()
    with pytest.raises(ValueError, match=r"must be a file \(Not a directory\)$"):
        mm.simulate(mm.Disk(), **DISK, checkpoint=below_a_file)
