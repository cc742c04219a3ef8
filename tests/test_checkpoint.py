"""Runs that were stopped go on from their checkpoint, the same to the bit."""

from typing import Any

import numpy as np
import pytest

import magmotor as mm
from magmotor import checkpoint as checkpoints
from magmotor.devices import DEVICES
from magmotor.engines import job as jobs

DISK: dict[str, Any] = {"timestep": 0.05, "duration": 100.0, "record_interval": 7, "seed": 3}
RUNS = {
    "disk, variational": (mm.Disk(), {"method": "variational/baoab", "replicas": 3, **DISK}),
    "disk, mujoco": (mm.Disk(), {"method": "mujoco/euler", "replicas": 3, **DISK}),
    "disk, mujoco/rk4": (mm.Disk(), {"method": "mujoco/rk4", **DISK}),
    "particle": (mm.LangevinParticle(), {"method": "variational/euler", **DISK}),
    "top": (mm.Top(), {"method": "mujoco/rk4", "timestep": 0.025, "duration": 30.0}),
    "top, scripted": (
        mm.Top.experiment(),
        {"method": "mujoco/euler", "timestep": 0.02, "duration": 20.0},
    ),
    "top, dop853": (mm.Top(), {"method": "scipy/dop853", "timestep": 0.02, "duration": 20.0}),
    "motor, variational": (
        mm.Motor(),
        {"method": "variational/baoab", "replicas": 2, **DISK},
    ),
    "motor, euler": (mm.Motor(), {"method": "mujoco/euler", "replicas": 2, **DISK}),
    "motor, baoab": (mm.Motor(), {"method": "mujoco/baoab", **DISK}),
}


@pytest.fixture(autouse=True)
def short_chunks(monkeypatch):
    monkeypatch.setattr(jobs, "CHUNK", 300)


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


@pytest.mark.parametrize("name", RUNS)
def test_a_stopped_run_goes_on_to_the_bit(name, tmp_path, monkeypatch):
    scene, arguments = RUNS[name]
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
    scene, arguments = RUNS["disk, variational"]
    path = tmp_path / "run.npz"
    monkeypatch.setattr(checkpoints, "SECONDS_BETWEEN", 0.0)
    with monkeypatch.context() as patch:
        stop_in_third_chunk(patch, scene, MemoryError)
        with pytest.raises(MemoryError):
            mm.simulate(scene, checkpoint=path, **arguments)
    with np.load(path) as saved:
        assert len(saved["time"]) > 1
    assert mm.simulate(scene, checkpoint=path, **arguments).identical(
        mm.simulate(scene, **arguments)
    )


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"seed": 4}, "seed = 4; it has 3"),
        ({"timestep": 0.04}, "timestep = 0.04; it has 0.05"),
        ({"duration": 200.0}, "duration = 200.0; it has 100.0"),
        ({"initial": {"x": 1.0}}, "initial = "),
        ({"replicas": 4}, "replicas = 4; it has 3"),
    ],
)
def test_a_checkpoint_of_another_task_is_refused(changes, named, tmp_path):
    scene, arguments = RUNS["disk, variational"]
    path = tmp_path / "run.npz"
    mm.simulate(scene, checkpoint=path, **arguments)
    with pytest.raises(ValueError, match=f"checkpoint = .*one of {named}"):
        mm.simulate(scene, checkpoint=path, **{**arguments, **changes})
    with pytest.raises(ValueError, match=r"checkpoint = .*scene_fields"):
        mm.simulate(scene.replace(x=0.5), checkpoint=path, **arguments)


def test_a_file_that_is_no_checkpoint_is_refused_and_left(tmp_path):
    scene, arguments = RUNS["disk, variational"]
    path = tmp_path / "notes.txt"
    path.write_text("not mine")
    with pytest.raises(ValueError, match="must be a checkpoint, or no file"):
        mm.simulate(scene, checkpoint=path, **arguments)
    assert path.read_text() == "not mine"


def test_without_room_the_run_goes_on_with_a_warning(tmp_path):
    scene, arguments = RUNS["disk, variational"]
    with pytest.warns(UserWarning, match="no checkpoint .*; the one before it stays"):
        run = mm.simulate(scene, checkpoint=tmp_path / "missing" / "run.npz", **arguments)
    assert run.identical(mm.simulate(scene, **arguments))
