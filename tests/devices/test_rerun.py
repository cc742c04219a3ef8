"""Datasets make themselves again, bit for bit; `magmotor rerun` says whether they do."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from every_method import EVERY_METHOD, SCENES, short

import magmotor as mm
from paper.motor.program import save

SCRIPTS = Path(__file__).parents[2] / "scripts"
BALL = {"axis": (0.3, -0.2, 0.8), "angular_velocity": (1.0, 0.2, -3.0), "velocity": (0.01, 0.02)}
GIVEN: dict[type, dict[str, Any]] = {
    mm.Top: BALL,
    mm.Motor: {**BALL, "ring_orientation": (0.98, 0.01, 0.02, 0.3)},
    mm.Disk: {"x": 0.1, "v": 0.3, "theta": 7.7},
    mm.LangevinParticle: {"x": 0.1, "v": 0.3},
}
DISK: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 5.0,
    "record_interval": 3,
}
MOTOR = {**DISK, "timestep": 0.1}
UNSTABLE = {"method": "variational/euler", "timestep": 8.0, "duration": 400.0}
ENSEMBLE: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 10.0,
    "replicas": 70,
    "trajectories": 2,
    "seed": 5,
}


def assert_made_again(run):
    xr.testing.assert_identical(mm.rerun(run), run)


@pytest.mark.parametrize(("scene", "method"), EVERY_METHOD)
def test_every_method_from_its_own_state_and_from_where_a_run_ended(scene, method):
    own = mm.simulate(scene, **short(scene, method))
    following = mm.simulate(scene, initial=own, **short(scene, method))
    assert not own.equals(following)
    assert_made_again(own)
    assert_made_again(following)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_every_scene_from_a_given_state(scene):
    arguments = short(scene, mm.methods(scene)[0])
    run = mm.simulate(scene, initial=GIVEN[type(scene)], **arguments)
    assert not run.equals(mm.simulate(scene, **arguments))
    assert_made_again(run)


@pytest.mark.parametrize("name", ["axis", "orientation"])
@pytest.mark.parametrize("method", ["scipy/dop853", "variational/verlet"])
def test_directions_of_any_length(method, name):
    numerics = {"method": method, "timestep": 0.001, "duration": 0.001}
    for vector in np.random.default_rng(1).normal(size=(8, 3 if name == "axis" else 4)):
        assert_made_again(mm.simulate(mm.Top(), initial={name: vector}, **numerics))


def test_each_replica_s_own_state():
    velocity = np.random.default_rng(2).normal(scale=0.01, size=(3, 2))
    run = mm.simulate(mm.Motor(), replicas=3, initial={"velocity": velocity}, **MOTOR)
    assert_made_again(run)
    assert_made_again(mm.simulate(mm.Motor(), replicas=3, initial=run, **MOTOR))


def test_paths_go_on_where_they_did():
    path = mm.noise.BrownianPath(seed=4, timestep=0.0125).coarsened(4)
    first = mm.simulate(mm.Disk(), path=path, **DISK)
    second = mm.simulate(mm.Disk(), path=path, initial=first, **DISK)
    other = mm.simulate(mm.Disk(), seed=9, initial=first, **DISK)
    assert second.attrs["first_step"] == 99
    assert "first_step" not in other.attrs
    for run in (first, second, other):
        assert_made_again(run)


def test_a_run_that_diverges_gives_what_was_recorded():
    with pytest.raises(mm.SimulationDiverged) as stop:
        mm.simulate(mm.Disk(), **{**DISK, **UNSTABLE}, allow_unstable=True)
    assert 1 < stop.value.dataset.sizes["time"] < 20
    assert_made_again(stop.value.dataset)


def test_a_run_that_was_interrupted_is_the_beginning():
    whole = mm.simulate(mm.Disk(), **DISK)
    xr.testing.assert_identical(mm.rerun(whole.isel(time=slice(9))), whole)


@pytest.mark.parametrize("scene", [mm.Disk(), mm.LangevinParticle()], ids=["disk", "particle"])
def test_ensembles(scene):
    own = mm.ensemble(scene, burn_in=2.0, **ENSEMBLE)
    warm = mm.ensemble(scene, initial=mm.theory.gibbs(scene, 70), threads=1, **ENSEMBLE)
    assert not own.equals(warm)
    assert "initial_x" not in own
    np.testing.assert_array_equal(warm.initial_x, mm.theory.gibbs(scene, 70)["x"])
    for run in (own, warm):
        assert_made_again(run)


@pytest.mark.filterwarnings("ignore:timestep = 1.5. above:UserWarning")
def test_an_ensemble_that_diverges_has_whole_records_only():
    with pytest.raises(mm.SimulationDiverged) as stop:
        mm.ensemble(
            mm.Disk(), method="variational/euler", timestep=1.5, duration=1e6, replicas=100,
            sample_interval=100,
        )  # fmt: skip
    run = stop.value.dataset
    assert run.sizes["time"] > 3
    assert (run.mean_square.sel(quantity="v").isel(time=slice(1, None)) > 0).all()
    # Where threads look at the states, and so see the end, depends on the clock.
    again, run = xr.align(mm.rerun(run), run, join="inner")
    np.testing.assert_array_equal(again["mean"], run["mean"])


@pytest.fixture
def disk_run():
    return mm.simulate(mm.Disk(), initial={"v": np.array([0.5, 0.6])}, replicas=2, **DISK)


@pytest.fixture
def rerun(run_script):
    return partial(run_script, "rerun")


@pytest.fixture
def single(rerun, tmp_path):
    """A file in single precision, as `scripts/motor.py` saves it."""
    run = mm.simulate(mm.Motor(), **MOTOR).assign_attrs(stopped="early")
    path = tmp_path / "motor.nc"
    save(run, path)
    return path


def test_a_file_in_single_precision(rerun, single, tmp_path):
    kept = xr.load_dataset(single)
    assert kept.position.dtype == np.float32
    again = tmp_path / "again.nc"
    assert rerun(single, "--out", again) == (0, "identical: 16 variables, 17 records\n", "")
    made = xr.load_dataset(again)
    assert made.position.dtype == np.float64
    np.testing.assert_array_equal(made.position.astype("f4"), kept.position)


def test_differences_are_reported(rerun, single):
    kept = xr.load_dataset(single)
    kept.position[5, 1] += 2e-4
    kept.position[6, 0] -= 1e-4
    kept.heat[7] += 1e-3
    versions = json.loads(kept.attrs["versions"]) | {"numpy": "2.1.0"}
    kept.assign_attrs(versions=json.dumps(versions)).to_netcdf(single)
    code, said, errors = rerun(single)
    assert (code, errors) == (1, "")
    assert said == (
        "different: position by at most 0.0002 from t = 1.5 on; heat by at most 0.001"
        f" from t = 2.1 on; numpy was 2.1.0, is {np.__version__}\n"
    )


def test_a_nan_and_an_extra_variable_are_reported(rerun, disk_run, tmp_path):
    run = disk_run.assign(wind=disk_run.v)
    run.energy[1, 4] = np.nan
    run.x[0, 2] += 0.5
    run.x[1, 3] = np.inf
    run.to_netcdf(tmp_path / "run.nc")
    code, said, _ = rerun(tmp_path / "run.nc")
    assert (code, said) == (1, (
        "different: x by at most 0.5 (NaN or infinite in one of them) from t = 0.3 on; energy"
        " (NaN or infinite in one of them) from t = 0.6 on; wind (missing)\n"
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (lambda run: run.drop_vars(list(run.data_vars)), 2, ": it has no values to compare\n"),
        (
            lambda run: run.assign(energy=run.energy.astype(int)),
            1,
            "different: energy (not in floating point)\n",
        ),
    ],
)
def test_what_does_not_hold_the_values_is_not_identical(rerun, tmp_path, change, code, words):
    change(mm.simulate(mm.Disk(), **DISK)).to_netcdf(tmp_path / "run.nc")
    found, said, error = rerun(tmp_path / "run.nc")
    assert found == code
    assert (error or said).endswith(words)


def test_a_run_now_ends_earlier(rerun, disk_run, tmp_path, monkeypatch):
    disk_run.to_netcdf(tmp_path / "run.nc")
    monkeypatch.setattr(mm, "rerun", lambda run, **_: run.isel(time=slice(4)))
    code, said, _ = rerun(tmp_path / "run.nc")
    assert (code, said) == (1, "different: it ends at t = 0.45, not 4.95\n")


def test_ensembles_whole_and_interrupted(rerun, tmp_path):
    path = tmp_path / "ensemble.nc"
    whole = mm.ensemble(mm.Disk(), initial=mm.theory.gibbs(mm.Disk(), 70), **ENSEMBLE)
    whole.to_netcdf(path)
    assert rerun(path) == (0, "identical: 22 variables, 11 records\n", "")
    partial = whole.copy(deep=True).isel(time=slice(4)).assign_attrs(time_reached=3.0)
    partial.v[:] = 0.0  # the final velocities were others then
    partial.to_netcdf(path)
    assert rerun(path) == (0, "identical: 5 variables, 4 records\n", "")
    whole.density_x[3] += 1.0
    whole.to_netcdf(path)
    code, said, _ = rerun(path)
    assert (code, said) == (1, "different: density_x by at most 1\n")


@pytest.mark.parametrize(
    ("break_it", "line"),
    [
        (lambda path: path.unlink(), "cannot read {}: No such file or directory"),
        (lambda path: path.write_text("not mine"), "cannot read {}: NetCDF: Unknown file format"),
        (lambda path: path.write_bytes(path.read_bytes()[:9000]), "cannot read {}: NetCDF: HDF"),
        (lambda path: xr.Dataset({"x": 1.0}).to_netcdf(path), "{}: attributes = []: must be"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(rerun, disk_run, tmp_path, break_it, line):
    path = tmp_path / "run.nc"
    disk_run.to_netcdf(path)
    break_it(path)
    code, said, errors = rerun(path)
    assert (code, said) == (2, "")
    assert errors.startswith(f"magmotor rerun: {line.format(path)}")
    assert errors.count("\n") == 1


def test_a_duration_that_is_a_whole_number_of_steps_but_for_rounding():
    run = mm.simulate(mm.Disk(), method="variational/baoab", timestep=0.01, duration=0.29)
    assert run.sizes["time"] == 30  # 0.29/0.01 is less than 29
    assert_made_again(run)
