"""Stopped runs continue from their checkpoints, the same bit for bit."""

import errno
import os
from typing import Any

import numpy as np
import pytest
from every_method import EVERY_METHOD, short
from refusals import refused

import magmotor as mm
from magmotor.device import checkpoint as checkpoints
from magmotor.device import job as jobs
from magmotor.run import simulate as simulation
from trials import checkpoint_files

QUIET = mm.Disk(noise=0.0)
ENGINES = [
    pytest.param(mm.Disk(), "variational/baoab", id="lanes"),
    pytest.param(mm.LangevinParticle(), "variational/euler", id="lanes of the particle"),
    pytest.param(mm.Top(), "variational/verlet", id="rigid"),
    pytest.param(mm.Motor(), "variational/baoab", id="rigid, replicas"),
    pytest.param(QUIET, "mujoco/rk4", id="mujoco, disk"),
    pytest.param(mm.Top(), "mujoco/euler", id="mujoco, top"),
    pytest.param(mm.Motor(), "mujoco/baoab", id="mujoco, motor"),
    pytest.param(QUIET, "scipy/dop853", id="scipy, disk"),
    pytest.param(mm.Top(), "scipy/dop853", id="scipy, top"),
]
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
    """Make the device's guard raise an exception at the third chunk."""
    device = scene.device
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


def done(path):
    """Return the number of records in a checkpoint after the first."""
    return checkpoint_files.read(path)[0]["done"]


class _Interrupted(list):
    """Records that are interrupted by Ctrl-C at the third addition."""

    def append(self, item):
        super().append(item)
        if len(self) == 4:
            raise KeyboardInterrupt


def test_ctrl_c_between_records_and_state_loses_nothing(tmp_path, monkeypatch):
    path = tmp_path / "run.checkpoint"
    whole = mm.simulate(mm.Disk(), **DISK)
    resume = simulation._resume

    def resumed(job, saved):
        kept, rest = resume(job, saved)
        return _Interrupted(kept), rest

    with monkeypatch.context() as patch:
        patch.setattr(simulation, "_resume", resumed)
        with pytest.raises(mm.SimulationInterrupted) as stop:
            mm.simulate(mm.Disk(), **DISK, checkpoint=path)
    assert 0 < done(path) < stop.value.dataset.sizes["time"] - 1
    assert mm.simulate(mm.Disk(), **DISK, checkpoint=path).identical(whole)


@pytest.mark.parametrize(("scene", "method"), EVERY_METHOD)
def test_a_stopped_run_continues_to_the_bit(scene, method, tmp_path, monkeypatch):
    arguments = short(scene, method)
    whole = mm.simulate(scene, **arguments)
    path = tmp_path / "run.checkpoint"
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


def test_checkpoints_are_saved_periodically(tmp_path, monkeypatch):
    """After a crash, unlike after an interrupt, only earlier checkpoints exist."""
    path = tmp_path / "run.checkpoint"
    monkeypatch.setattr(checkpoints, "SECONDS_BETWEEN", 0.0)
    with monkeypatch.context() as patch:
        stop_in_third_chunk(patch, mm.Disk(), MemoryError)
        with pytest.raises(MemoryError):
            mm.simulate(mm.Disk(), checkpoint=path, **DISK)
    assert done(path) > 0
    assert mm.simulate(mm.Disk(), checkpoint=path, **DISK).identical(mm.simulate(mm.Disk(), **DISK))


def test_a_file_that_is_not_a_checkpoint_is_refused_and_kept(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("not mine")
    with refused("checkpoint"):
        mm.simulate(mm.Disk(), checkpoint=path, **DISK)
    assert path.read_text() == "not mine"


def test_a_checkpoint_that_cannot_be_saved_gives_a_warning(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(checkpoints, "save", full)
    with pytest.warns(UserWarning, match="checkpoint is kept"):
        run = mm.simulate(mm.Disk(), checkpoint=tmp_path / "run.checkpoint", **DISK)
    assert run.identical(mm.simulate(mm.Disk(), **DISK))


def cut(array):
    return array[..., :-1].copy()


def with_first(value):
    def spoiled(array):
        array = array.copy()
        array.flat[0] = value
        return array

    return spoiled


DAMAGES: dict[str, Any] = {
    "cut": cut,
    "an axis more": lambda array: array[np.newaxis],
    "empty": lambda array: array[..., :0],
    "a row more": lambda array: np.concatenate([array, array[-1:]]),
    "flat": lambda array: array.ravel() if array.ndim > 1 else array[:, np.newaxis],
    "single": lambda array: array.astype("f4"),
    "swapped": lambda array: array.astype(">f8"),
    "integers": lambda array: array.astype("i8"),
    "complex": lambda array: array.astype("c16"),
    "nan": with_first(np.nan),
    "inf": with_first(-np.inf),
}


@pytest.mark.parametrize(("scene", "method"), ENGINES)
def test_wrong_arrays_of_a_run_are_refused(scene, method, tmp_path):
    """The checksums are correct, so that the arrays themselves are checked."""
    path, arguments = tmp_path / "run", short(scene, method)
    whole = mm.simulate(scene, checkpoint=path, **arguments)
    head, arrays = checkpoint_files.read(path)

    def rejected(new, words="must have the arrays|finite and in bounds", **told):
        checkpoint_files.write(path, head | told, new)
        with pytest.raises(mm.ArgumentError, match=f"^checkpoint = .*run': .*({words})"):
            mm.simulate(scene, checkpoint=path, **arguments)

    for name, array in arrays.items():
        for change in DAMAGES.values():
            rejected(arrays | {name: change(array)})
        rejected({k: v for k, v in arrays.items() if k != name})
    rejected(arrays | {"extra": np.zeros(1)})
    rejected({f"my_{name}": array for name, array in arrays.items()})
    rejected(dict(reversed(arrays.items())))
    rejected(arrays | {"engine_state": np.zeros((1, 3))})
    rejected(arrays, done=head["done"] - 1)
    for number in (-1, head["done"] + 1, 2**70, True, 3.0, "3", None, [3]):
        rejected(arrays, "number of finished records", done=number)
    checkpoint_files.write(path, head, arrays)
    assert mm.simulate(scene, checkpoint=path, **arguments).identical(whole)


MANY: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 10.0,
    "replicas": 10,
    "trajectories": 2,
}


def changed(arrays, name, index, value):
    array = arrays[name].copy()
    array[index] = value
    return arrays | {name: array}


def test_wrong_arrays_of_an_ensemble_are_refused(tmp_path):
    """Some of these arrays once crashed the process."""
    path = tmp_path / "run"
    whole = mm.ensemble(mm.Disk(), checkpoint=path, **MANY)
    head, arrays = checkpoint_files.read(path)
    assert head["done"] == 10

    def rejected(new, words="must have the arrays|finite and in bounds", **told):
        checkpoint_files.write(path, head | told, new)
        with pytest.raises(mm.ArgumentError, match=f"^checkpoint = .*run': .*({words})"):
            mm.ensemble(mm.Disk(), checkpoint=path, **MANY)

    for name, array in arrays.items():
        for kind, change in DAMAGES.items():
            integers = array.dtype == np.int64
            if not (integers and kind in ("nan", "inf", "integers")):
                rejected(arrays | {name: change(array)})
        rejected({k: v for k, v in arrays.items() if k != name})
    rejected(arrays | {"last": np.zeros((50, 8))}, done=0)
    rejected(arrays | {"sums": np.zeros((0, 0, 6))})
    for number in (-1, 11, 2**70, True, 3.0, "3", None):
        rejected(arrays, "number of finished records", done=number)
    bounds = "its {} must be finite and in bounds, and has the value {}"
    for name, index, value in [
        ("counts", (0, 2, 119), -1),
        ("counts", (0, 0, 0), 2**40),
        ("flights", (0, 159), -1),
        ("direction", 3, 2),
        ("direction", 3, -2),
        ("departure", 0, -1),
        ("departure", 0, 11),
        ("departure", 0, 2**63 - 1),
        ("sums", (0, 0, 0), -1.0),
        ("sums", (0, 1, 4), -1e-9),
    ]:
        rejected(changed(arrays, name, index, value), bounds.format(name, value))
    rejected(changed(arrays, "departure", 0, 6), "its departure must be", done=5)
    checkpoint_files.write(path, head, arrays)
    assert mm.ensemble(mm.Disk(), checkpoint=path, **MANY).identical(whole)


def test_huge_states_do_not_crash_the_process(tmp_path):
    """The statistics must survive numbers that overflow in the first step."""
    path = tmp_path / "run"
    mm.ensemble(mm.Disk(), checkpoint=path, **MANY)
    head, arrays = checkpoint_files.read(path)
    arrays = {name: np.zeros_like(array) for name, array in arrays.items()}
    arrays["states"][:] = 1e308
    checkpoint_files.write(path, head | {"done": 0}, arrays)
    with np.errstate(all="ignore"), pytest.raises(mm.SimulationDiverged):
        mm.ensemble(mm.Disk(), checkpoint=path, **MANY)


@pytest.fixture
def small(tmp_path):
    """Return a saved checkpoint of two arrays."""
    like = {"x": np.arange(6.0).reshape(2, 3), "n": np.array([1, 2])}
    wanted = {"x": checkpoints.Expected(like["x"]), "n": checkpoints.Expected(like["n"], 0, 9)}
    path = tmp_path / "small"
    mine = checkpoints.Checkpoint(path, {"seed": 1}, 5, lambda done: wanted)
    mine.save(4, like)
    done, found = mine.load() or pytest.fail("nothing is there")
    assert done == 4
    np.testing.assert_equal(found, like)
    return mine


def test_any_changed_byte_is_detected(small):
    content = small.path.read_bytes()
    for place in range(len(content)):
        for other in (content[place] ^ 1, content[place] ^ 32):
            spoiled = bytearray(content)
            spoiled[place] = other
            if spoiled != content:
                small.path.write_bytes(spoiled)
                with refused("checkpoint") as told:
                    small.load()
                assert "another run" not in told.value.allowed


def test_any_changed_length_is_detected(small):
    content = small.path.read_bytes()
    for length in range(len(content)):
        small.path.write_bytes(content[:length])
        with refused("checkpoint") as told:
            small.load()
        assert "another run" not in told.value.allowed
    small.path.write_bytes(content + b"\0")
    with refused("checkpoint"):
        small.load()


def _crafted(**told):
    def write(path):
        checkpoint_files.write(path, *checkpoint_files.read(path), **told)

    return write


def _archive(path):
    with path.open("wb") as file:
        np.savez(file, x=np.zeros((2, 3)), n=np.array([1, 2]), task=np.array({"seed": 1}))


def _deep(path):
    path.write_bytes(b"[" * 100_000 + b"\n")


@pytest.mark.parametrize(
    "craft",
    [
        _crafted(arrays=[["x", "<f8", 10**6, 10**6], ["n", "<i8", 2]]),
        _crafted(arrays=[["x", "<f8", 2, 3], ["n", "<i8", -2]]),
        _crafted(arrays=[["x", "|O", 2, 3], ["n", "<i8", 2]]),
        _crafted(arrays=None),
        _crafted(task=[1]),
        _crafted(done=10**400),
        _archive,
        _deep,
    ],
)
def test_crafted_files_are_refused_with_a_message(small, craft):
    craft(small.path)
    with refused("checkpoint"):
        small.load()


def test_a_pipe_is_refused_as_checkpoint(tmp_path):
    """Opening a pipe would block forever."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with refused("checkpoint"):
        mm.simulate(mm.Disk(), checkpoint=path, **DISK)
