"""Analyses of runs: parts of a run, and the scene of a run."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from refusals import refused

import magmotor as mm
from magmotor.numerics.batch_means import mean_and_error

DISK = mm.Disk(v=1.0)
BAOAB: dict[str, Any] = {"method": "variational/baoab"}


@pytest.fixture(scope="module")
def disk_run():
    return mm.simulate(DISK, timestep=0.01, duration=30, replicas=3, seed=5, **BAOAB)


@pytest.fixture(scope="module")
def motor_run():
    return mm.simulate(mm.Motor(), timestep=0.1, duration=60, replicas=3, seed=5, **BAOAB)


@pytest.fixture(scope="module")
def top_run():
    """A ball that spins from the start: J(0) is three quarters of the largest J."""
    return mm.simulate(mm.Top.paper(4, spin=3.0), timestep=0.01, duration=20.0, **BAOAB)


def residual(balance, scale):
    return float(abs(balance.residual).max() / abs(balance[scale]).max())


PARTS = {
    "one replica": {"replica": 2},
    "two replicas": {"replica": [2, 0]},
    "a late slice": {"time": slice(1000, None)},
    "a slice of one replica": {"replica": 1, "time": slice(700, 2500)},
}


@pytest.mark.parametrize("part", PARTS)
def test_the_energy_balance_of_a_part_of_a_disk_run(disk_run, part):
    whole = residual(mm.observables.energy_balance(disk_run), "injected")
    found = mm.observables.energy_balance(disk_run.isel(PARTS[part]))
    assert whole < 1e-4  # 5.9e-6
    assert (
        residual(found, "injected") < 30 * whole
    )  # at most 1.2; 1.4 with the noise of another seed


def test_the_energy_balance_of_the_disk_is_additive(disk_run):
    whole = mm.observables.energy_balance(disk_run)
    turned = mm.observables.energy_balance(disk_run.transpose("time", "replica"))
    assert turned.identical(whole)
    late = mm.observables.energy_balance(disk_run.isel(time=slice(500, None)))
    for name in ("heat", "injected", "martingale"):
        expected = whole[name].values[:, 500:] - whole[name].values[:, 500:501]
        np.testing.assert_allclose(late[name], expected, rtol=0, atol=5e-11)  # 2.2e-12


@pytest.mark.parametrize(("scene", "bound"), [
    (DISK.replace(friction_ratio=0.5), 1e-4),  # 3.9e-6; 0.1 without the second noise
    (mm.LangevinParticle(v=1.0), 4e-4),  # 1.4e-5
])  # fmt: skip
def test_the_energy_balance_includes_the_noise_of_each_slip(scene, bound):
    run = mm.simulate(scene, timestep=0.01, duration=30, replicas=2, **BAOAB)
    found = mm.observables.energy_balance(run)
    assert residual(found, "injected") < bound


def test_a_continued_run_continues_the_step_numbers():
    first = mm.simulate(DISK, timestep=0.01, duration=3, **BAOAB)
    second = mm.simulate(DISK, timestep=0.01, duration=3, initial=first, record_interval=7, **BAOAB)
    assert second.step.values.tolist() == [300 + 7 * i for i in range(43)]
    assert "replica" not in second.coords


def test_heat_and_work_of_a_part_of_a_motor_run(motor_run):
    for analysis, names in (
        (mm.observables.energy_balance, ("gain", "heat", "work", "injected", "residual")),
        (mm.observables.efficiency, ("kicks", "transferred", "reached")),
    ):
        whole = analysis(motor_run)
        part = analysis(motor_run.isel(replica=1, time=slice(100, None, 10)))
        for name in names:
            expected = whole[name].isel(replica=1, time=slice(100, None, 10))
            expected = expected - expected.isel(time=0)
            np.testing.assert_allclose(part[name], expected, rtol=0, atol=1e-18)  # J; 5e-20


def test_flights_record_their_replica():
    """A ball that goes around in replica 3 of a run of which only replicas 3 and 7 are kept."""
    theta = np.stack([np.zeros(200), np.linspace(0, 15, 200)])
    position = np.stack([0.6 * np.cos(theta), 0.6 * np.sin(theta), 0.04 + 0 * theta], axis=-1)
    run = xr.Dataset(
        {"position": (("replica", "time", "space"), position)},
        {"replica": [7, 3], "time": np.arange(200.0), "space": ["x", "y", "z"]},
    )
    scene = mm.Motor()
    assert mm.observables.flights(run, scene).replica.values.tolist() == [3]
    assert mm.observables.dwell_times(run, scene).replica.values.tolist() == [7]
    alone = run.isel(replica=1)
    assert {*mm.observables.transitions(alone, scene).replica.values} == {3}


def test_the_momentum_balance_starts_from_the_first_record(top_run):
    """J(0) enters the integral, also for a late slice, which begins with another J."""
    largest = float(abs(top_run.momentum_map).max())
    start = float(top_run.momentum_map[0])
    assert start > 0.3 * largest  # 0.79
    for run in (top_run, top_run.isel(time=slice(700, None))):
        balance = mm.observables.momentum_balance(run)
        assert float(balance.integral[0]) == float(run.momentum_map[0])
        assert abs(balance.residual).max() < 5e-3 * largest  # 1.7e-4, 4.9e-5
        energy = mm.observables.energy_balance(run)
        assert residual(energy, "heat") < 5e-3  # 2.1e-4


def test_the_error_of_a_mean_uses_n_minus_1():
    """Batches 0, 1 ... 7 have the variance 42/7 = 6, and their mean has 6/8."""
    mean, error = mean_and_error(np.arange(8.0))
    assert mean == 3.5
    assert error == pytest.approx(np.sqrt(6 / 8), rel=1e-15, abs=0)  # 0, or rounding


OWN = [
    ("momentum_balance", "top_run"),
    ("energy_balance", "top_run"),
    ("energy_balance", "disk_run"),
    ("energy_balance", "motor_run"),
    ("efficiency", "motor_run"),
    ("flights", "motor_run"),
    ("dwell_times", "motor_run"),
    ("transitions", "motor_run"),
    ("mode_temperatures", "motor_run"),
]


@pytest.mark.parametrize(("name", "made"), OWN)
def test_the_scene_defaults_to_the_runs_own(name, made, request):
    analyze, run = getattr(mm.observables, name), request.getfixturevalue(made)
    scene = mm.scene_of(run)
    expected = analyze(run)
    assert analyze(run, scene).identical(expected)
    assert analyze(run=run, scene=scene).identical(expected)
    bare = run.copy()
    bare.attrs = {k: v for k, v in run.attrs.items() if not k.startswith("scene")}
    assert analyze(bare, scene).identical(expected)
    field = "gravity" if hasattr(scene, "gravity") else "x"
    with refused(f"scene.{field}"):
        analyze(run, scene.replace(**{field: 0.5}))
    with refused("scene"):
        analyze(bare)


@pytest.mark.parametrize("made", ["top_run", "disk_run", "motor_run"])
def test_every_run_has_an_overview(made, request, tmp_path):
    run, drawn = request.getfixturevalue(made), tmp_path / "drawn.png"
    if made == "motor_run":
        with refused("replicas"):
            mm.plots.overview(run, None, drawn)
        run = run.isel(replica=0)
    mm.plots.overview(run, None, drawn)
    with Image.open(drawn) as picture:
        assert picture.size[0] >= 1200
        assert len(picture.getcolors(2**24) or ()) > 50


@pytest.fixture(scope="module")
def ensemble():
    return mm.ensemble(
        mm.Disk(), timestep=0.02, duration=200, replicas=64, trajectories=64, **BAOAB
    )


def test_local_slopes_require_the_start_of_the_run(ensemble):
    slope = mm.observables.local_slope(ensemble)
    some = mm.observables.local_slope(ensemble.isel(time=slice(None, None, 2)))
    shared = np.isin(some.begin, slope.begin)
    assert shared.all()
    with refused("first time in run"):
        mm.observables.local_slope(ensemble.isel(time=slice(5, None)))


def test_a_survival_begins_at_one_and_has_bins(ensemble):
    survival = mm.observables.flight_survival(ensemble)
    assert survival.survival[0] == 1
    assert survival.sizes["flight_duration"] > 8


def test_a_continued_path_follows_its_steps_in_all_replicas(disk_run):
    half = disk_run.isel(time=slice(1001))
    rest = {"timestep": 0.01, "duration": 20, "seed": 5, **BAOAB}
    shifted = mm.simulate(DISK, **rest, replicas=3, initial=half.assign_coords(time=half.time + 9))
    assert shifted.attrs["first_step"] == 1000
    whole = disk_run.x.isel(time=slice(1000, None))
    np.testing.assert_allclose(shifted.x, whole, rtol=5e-15)  # 3e-16: x is kept in turns
    with refused("initial.replica"):
        mm.simulate(DISK, **rest, replicas=2, initial=half.isel(replica=[1, 2]))


def test_a_fresh_process_knows_the_scenes_of_files(top_run, tmp_path):
    """Although it has imported no device by itself."""
    path = tmp_path / "top.nc"
    top_run.to_netcdf(path)
    program = (
        "import sys, xarray, magmotor; print(magmotor.scene_of(xarray.load_dataset(sys.argv[1])))"
    )
    command = [sys.executable, "-c", program, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Top(ball_mass=")
