"""`scripts/disk.py`: its output, its errors, and its theory of the mean."""

import re
import resource
import subprocess
import sys
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor.common import style
from magmotor.observables import d_diffusion, flight_survival, local_slope
from magmotor.theory import DiskTheory
from paper.disk.pictures import FIGURES
from paper.disk.statistics import DRAWN

SCRIPTS = Path(__file__).parents[2] / "scripts"
SYSTEMS = ("symmetric", "asymmetric", "flat", "control")
SHORT = ("--duration", "30", "--replicas", "256", "--timestep", "0.05", "--out")


@pytest.fixture
def disk(run_script):
    """Return a function that runs the script and returns its exit code and stderr."""

    def run(*arguments):
        code, _, errors = run_script("disk", *arguments)
        return code, errors

    return run


def interrupt(monkeypatch, number):
    """Make the ensemble of a number, counted from 1, end as if interrupted."""
    whole = mm.ensemble
    scenes = []

    def ensemble(scene, **arguments):
        run = whole(scene, **arguments)
        scenes.append(scene)
        if len(scenes) == number:
            raise mm.SimulationInterrupted(run)
        return run

    monkeypatch.setattr(mm, "ensemble", ensemble)


@pytest.fixture
def first_picture(monkeypatch):
    """Make all figures, but write only the first as pixels.

    Those of `DRAWN` are written by tests/paper/test_figures.py; the others are laid out here.
    """
    save, saved, elsewhere = style.save, [], {f"disk_{name}" for name in DRAWN}

    def brief(figure, path, *arguments, **options):
        saved.append(figure)
        if len(saved) == 1:
            save(figure, path, *arguments, **options)
        else:
            if Path(path).stem not in elsewhere:
                figure.draw_without_rendering()
            Path(path).touch()

    monkeypatch.setattr(style, "save", brief)


@pytest.mark.slow
@pytest.mark.usefixtures("first_picture")
def test_all_figures_datasets_and_numbers(run_script, tmp_path):
    code, said, errors = run_script("disk", *SHORT, tmp_path)
    assert (code, errors) == (0, "")
    pictures = {"disk.png", *(f"disk_{name}.png" for name in FIGURES)}
    names = [*SYSTEMS, *(f"mujoco_{name}" for name in SYSTEMS if name != "control")]
    ensembles = {f"disk_{name}{kind}.nc" for name in names for kind in ("", "_stationary")}
    assert {path.name for path in tmp_path.iterdir()} == pictures | ensembles
    flat = xr.load_dataset(tmp_path / "disk_flat.nc")
    assert mm.scene_of(flat) == mm.Disk(potential="flat")
    assert flat.sizes["replica"] == flat.sizes["path_replica"] == 256
    assert (tmp_path / "disk.png").stat().st_size > 10_000
    for text in ("in the limit 2500)", "in the limit 277.8)"):
        assert text in said
    number = r"([\d.e+]+)"
    square = rf"\): E x² = {number} ± {number} \(theory: {number}\)"
    for name in SYSTEMS:
        for method in ("variational/euler", "mujoco/baoab")[: 1 + (name != "control")]:
            found = re.search(rf"{name} \({method}{square}", said)
            assert found, said
            measured, error, theory = map(float, found.groups())
            assert abs(measured - theory) < 4 * error  # 1.5


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (("--duration", "5"), "duration = 5.0: must be at least 20"),
        (("--replicas", "1"), "replicas = 1: must be at least 2"),
        (("--timestep", "0"), "timestep = 0.0: must be greater than 0"),
        (("--seed", "-1"), "seed = -1: must be at least 0"),
        (("--threads", "-1"), "threads = -1: must be at least 1"),
        (("--sigma", "-1"), "sigma = -1.0: must be greater than 0"),
        (("--method", "euler"), "method = 'euler': must be one of variational/euler"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(disk, tmp_path, flags, line):
    code, error = disk(*SHORT, tmp_path / "out", *flags)
    assert code == 2
    assert error.startswith(f"disk.py: {line}")
    assert error.count("\n") == 1
    assert not [*tmp_path.glob("out/*")]


def test_an_interrupted_run_reports_its_files_and_how_to_resume(disk, tmp_path, monkeypatch):
    interrupt(monkeypatch, 2)
    code, error = disk(*SHORT, tmp_path)
    assert code == 130
    assert error.count("\n") == 1
    assert f"resumes from {tmp_path / 'disk_symmetric_stationary.checkpoint'}" in error
    assert error.endswith("written: disk_symmetric.nc\n")
    assert {path.name for path in tmp_path.iterdir()} == {
        "disk_symmetric.nc",
        "disk_symmetric.checkpoint",
        "disk_symmetric_stationary.checkpoint",
    }
    code, error = disk(*SHORT, tmp_path, "--seed", "1")  # not the same command
    assert code == 2
    assert "seed was 0 there and is 16 here; finish that run, or delete the file" in error


def test_a_full_disk_is_one_line(tmp_path):
    """No file may grow beyond 512 kB: neither the checkpoint nor the dataset fits."""
    limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (1 << 19, 1 << 19))
    command = [sys.executable, SCRIPTS / "disk.py", *SHORT, tmp_path, "--replicas", "4096"]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, preexec_fn=limit
    )
    assert done.returncode == 4, done.stderr
    assert "Traceback" not in done.stderr
    first, *_, last = done.stderr.splitlines()
    assert f"cannot save {tmp_path / 'disk_symmetric.checkpoint'}: File too large" in first
    assert f"cannot write {tmp_path / 'disk_symmetric.nc'}" in last
    assert not [*tmp_path.iterdir()]


def test_a_long_timestep_causes_one_warning(disk, tmp_path, monkeypatch):
    interrupt(monkeypatch, 3)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        _, error = disk(*SHORT, tmp_path, "--timestep", "0.1")
    assert error.count("disk.py: timestep = 0.1: above 0.0574") == 1
    assert error.count("\n") == 2


@pytest.mark.parametrize("potential", ["symmetric", "asymmetric"])
def test_mean_from_rest_is_the_first_impulse(potential):
    scene = mm.Disk(potential=potential)
    run = mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=30, replicas=32768, seed=5
    )
    x = run.sel(quantity="x").isel(time=run.time >= 10)
    ratio = x["mean"].values / DiskTheory(scene).mean(x.time.values)
    assert np.abs(ratio - 1).max() < 0.2  # 0.08; in 24 other seeds up to 0.135


def test_local_slope_of_a_power_and_of_brownian_motion():
    times = np.arange(9.0)
    steps = np.random.default_rng(1).standard_normal((40000, 8))
    path = np.concatenate([np.zeros((40000, 1)), steps.cumsum(axis=1)], axis=1)
    run = xr.Dataset({"path": (("path_replica", "time"), path)}, {"time": times})
    found = local_slope(run)
    np.testing.assert_array_equal(found.end, 2 * found.begin)
    # The variance of x(2t)^2/2t - x(t)^2/t is 2 + 2 - 2.
    np.testing.assert_allclose(found.slope_error, np.sqrt(2 / 40000) / np.log(2), rtol=0.03)
    assert (np.abs(found.slope - 1) < 4 * found.slope_error).all()
    ballistic = run.assign(path=run.path * 0 + run.time)
    np.testing.assert_allclose(local_slope(ballistic).slope, 2, rtol=1e-15)  # 0


def test_d_diffusion_of_brownian_motion():
    """D of d is 3, while the slip v + omega of each replica is constant."""
    scene, random = mm.Disk(sigma=0.7), np.random.default_rng(1)
    steps = random.normal(0, np.sqrt(6), (40000, 5))
    d, slip = 40 + steps.cumsum(axis=1), 10 * random.standard_normal((40000, 1))
    columns = {"v": (scene.sigma * slip - d) / 1.7, "omega": (slip + d) / 1.7}
    run = xr.Dataset({name: (("replica", "time"), v) for name, v in columns.items()})
    found = d_diffusion(run.assign_coords(time=np.arange(5.0)), scene)
    # Of d(4)^2 - d(0)^2, for variances 30 and 6, the variance is 2 (30^2 + 6^2 - 2 6^2).
    expected = np.sqrt(2 * (30**2 - 6**2) / 40000) / 8
    np.testing.assert_allclose(found.diffusion_error, expected, rtol=0.03)  # 0.006
    assert abs(float(found.diffusion) - 3) < 3 * expected  # 1.2 of them
    with pytest.raises(ValueError, match="replicas = 1: must be at least 2"):
        d_diffusion(run.assign_coords(time=np.arange(5.0)).isel(replica=0), scene)


def test_flight_survival_with_unfinished_flights():
    """A worked example, and exponential durations that are observed for exponential times."""
    columns = {"flights": [2, 0, 3, 1], "unfinished_flights": [0, 2, 0, 2]}
    run = xr.Dataset({name: ("flight_duration", np.array(v)) for name, v in columns.items()})
    run = run.assign_coords(flight_duration=[1.0, 2.0, 4.0, 8.0])
    np.testing.assert_allclose(flight_survival(run).survival, [1, 0.8, 0.8, 0.4], rtol=1e-15)  # 0
    random = np.random.default_rng(2)
    duration, seen = random.exponential(10, 20000), random.exponential(20, 20000)
    edges = np.append(np.arange(0, 30, 0.5), 1000)
    over = duration < seen
    counts = [np.histogram(part, edges)[0] for part in (duration[over], seen[~over])]
    run = xr.Dataset(
        {n: ("flight_duration", c) for n, c in zip(columns, counts, strict=True)},
        {"flight_duration": edges[:-1]},
    )
    found = flight_survival(run)
    wrong = found.survival - np.exp(-found.flight_duration / 10)
    assert (np.abs(wrong) < 4 * found.survival_error)[1:].all()
    assert float(found.survival_error.max()) < 0.006  # 0.0040


def test_unfinished_flights_count_for_half_of_their_last_bin():
    """Expected counts of exponential durations, mean 10, observed for such times, mean 20."""
    edges = np.arange(0.0, 200.0, 2.0)
    left = 1e9 * np.exp(-(1 / 10 + 1 / 20) * edges)
    gone = -np.diff(left, append=0.0)
    columns = {"flights": 2 / 3 * gone, "unfinished_flights": gone / 3}
    run = xr.Dataset(
        {name: ("flight_duration", np.rint(v)) for name, v in columns.items()},
        {"flight_duration": edges},
    )
    survival = flight_survival(run).survival.values[:11]
    np.testing.assert_allclose(survival, np.exp(-edges[:11] / 10), rtol=0.02)  # 0.008
