"""`scripts/motor.py`: its output, runs that lose their ring, and its errors."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor.devices.motor.scene import PAPER
from paper.motor import program
from paper.motor.pictures import FIGURES

SCRIPTS = Path(__file__).parents[2] / "scripts"
SHORT = ("--duration", "1500", "--out")
PICTURES = {"motor.png", *(f"motor_{name}.png" for name in FIGURES)}


@pytest.fixture
def motor(run_script):
    return partial(run_script, "motor")


def test_all_runs_figures_and_numbers(motor, tmp_path):
    code, said, errors = motor(*SHORT, tmp_path, "--ball-ring-factor", "1")
    assert (code, errors) == (0, "")
    runs = {f"motor_{name}.nc" for name in PAPER}
    assert {path.name for path in tmp_path.iterdir()} == PICTURES | runs
    for name in PICTURES:
        assert (tmp_path / name).stat().st_size < 200_000
    for name, (kind, alpha, seed) in PAPER.items():
        run = xr.load_dataset(tmp_path / f"motor_{name}.nc")
        scene = mm.scene_of(run)
        assert scene == mm.Motor.paper(name, ball_ring_factor=1)
        assert (run.sizes["time"], run.attrs["seed"]) == (1501, seed)
        assert f"{name}: alpha = {alpha:g}" in said
        assert (f"kT = {alpha**2 / 0.3:.3g} J" in said) == (kind == "uniform")
    assert said.count("temperatures over kT") == 4
    slips = re.findall(r"slip ([\d.]+) ± ([\d.]+)", said)
    assert all(abs(float(t) - 1) < 5 * float(error) for t, error in slips)
    residuals = re.findall(r"residual (\S+) of the mean work", said)
    assert all(float(residual) < 1e-3 for residual in residuals)  # 1e-4
    assert len(residuals) == 7


@pytest.fixture
def no_pictures(monkeypatch):
    monkeypatch.setattr(program, "draw", lambda *_: None)


def test_the_file_reproduces_its_run(motor, tmp_path, no_pictures):
    motor(*SHORT, tmp_path, "--runs", "uniform-c", "--seed", "2")
    kept = xr.load_dataset(tmp_path / "motor_uniform-c.nc")
    numerics = {name: kept.attrs[name] for name in ("method", "timestep", "duration", "seed")}
    assert numerics["seed"] == 3 + 2 * 7
    again = mm.simulate(
        mm.scene_of(kept), **numerics, record_interval=kept.attrs["record_interval"]
    )
    np.testing.assert_array_equal(kept.energy, again.energy)
    np.testing.assert_array_equal(kept.position, again.position.astype("float32"))


def test_a_run_that_loses_its_ring_is_kept_and_drawn_without_an_error(motor, tmp_path, monkeypatch):
    monkeypatch.setitem(PAPER, "nonuniform-a", ("nonuniform", 2e-3, 1))
    runs = ("--runs", "nonuniform-a", "uniform-a")
    code, said, errors = motor(*SHORT, tmp_path, *runs)
    assert (code, errors) == (0, "")
    ended = re.search(r"  ended (at t = (\d+) s: the inner ring is lost: .*)\n", said)
    assert ended, said
    run = xr.load_dataset(tmp_path / "motor_nonuniform-a.nc")
    assert run.attrs["stopped"] == ended[1]
    assert float(run.time[-1]) == float(ended[2]) - 1
    assert {path.name for path in tmp_path.iterdir()} >= PICTURES | {"motor_uniform-a.nc"}


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (("--runs", "uniform-e"), "runs = 'uniform-e': must be one of nonuniform-a"),
        (("--duration", "5"), "duration = 5.0: must be at least 100 s, 100 records"),
        (("--timestep", "0"), "timestep = 0.0: must be greater than 0"),
        (("--seed", "-1"), "seed = -1: must be at least 0"),
        (("--coupling", "0"), "coupling = 0.0: must be greater than 0"),
        (("--method", "baoab"), "method = 'baoab': must be one of variational/euler"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(motor, tmp_path, flags, line):
    code, _, error = motor(*SHORT, tmp_path / "out", *flags)
    assert code == 2
    assert error.startswith(f"motor.py: {line}")
    assert error.count("\n") == 1
    assert not [*tmp_path.glob("out/*")]


def test_a_run_that_diverges_otherwise_is_code_1(motor, tmp_path, monkeypatch):
    def diverge(scene, *, checkpoint, **numerics):
        raise mm.SimulationDiverged("its energy grew", 3.0, whole(scene, **numerics))

    whole = mm.simulate
    monkeypatch.setattr("paper.motor.runs.simulate", diverge)
    code, _, error = motor(*SHORT, tmp_path, "--runs", "uniform-a")
    assert code == 1
    assert error.startswith("motor.py: uniform-a: mujoco/baoab with timestep 0.1 s stopped at")
    assert error.count("\n") == 1


def test_an_interrupted_run_resumes_to_the_same_end(motor, tmp_path, monkeypatch, no_pictures):
    runs = ("--runs", "uniform-a", "uniform-b")
    motor(*SHORT, tmp_path / "whole", *runs)
    whole, scenes = mm.simulate, []

    def simulate(scene, **arguments):
        scenes.append(scene)
        run = whole(scene, **arguments)
        if len(scenes) == 2:
            raise mm.SimulationInterrupted(run)
        return run

    monkeypatch.setattr("paper.motor.runs.simulate", simulate)
    code, _, error = motor(*SHORT, tmp_path / "out", *runs)
    assert code == 130
    assert error.count("\n") == 1
    assert f"resumes from {tmp_path / 'out' / 'motor_uniform-b.checkpoint'}" in error
    assert error.endswith("written: motor_uniform-a.nc\n")
    code, _, error = motor(*SHORT, tmp_path / "out", *runs, "--seed", "1")  # not the same command
    assert code == 2
    assert "seed was 1 there and is 8 here; finish that run, or delete the file" in error
    code, *_ = motor(*SHORT, tmp_path / "out", *runs)
    assert code == 0
    assert not [*tmp_path.glob("out/*.checkpoint")]
    for name in ("motor_uniform-a.nc", "motor_uniform-b.nc"):
        ends = (xr.load_dataset(tmp_path / folder / name) for folder in ("whole", "out"))
        xr.testing.assert_identical(*ends)
