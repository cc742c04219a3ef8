"""Analyses of runs: parts of a run, the scene of a run, and invalid input."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import magmotor as mm
from magmotor.device.overview import draw_variables
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


OF_A_DISK = mm.simulate(DISK, method="variational/euler", timestep=0.01, duration=0.01).attrs

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


def test_an_energy_balance_requires_the_noise_of_every_step(disk_run):
    refused = {
        "steps between two records = 10: must be 1": disk_run.isel(time=slice(None, None, 10)),
        "coordinates = .*: must include step": disk_run.drop_vars("step"),
        "run.replica = None: must be a coordinate": disk_run.drop_vars("replica"),
        "number of records in run = 1": disk_run.isel(time=[0]),
        "the dataset must also have omega": disk_run.drop_vars("omega"),
    }
    for message, run in refused.items():
        with pytest.raises(ValueError, match=message):
            mm.observables.energy_balance(run)


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


def test_a_ring_that_rotates_too_far_between_records_has_no_yaw(motor_run):
    half = motor_run.ring_orientation.values.copy()
    half[:, 1::2] = [0.0, 0.0, 0.0, 1.0]  # upside down, and back
    turned = motor_run.assign(ring_orientation=(motor_run.ring_orientation.dims, half))
    with pytest.raises(ValueError, match=r"largest rotation between two records = 3\.1\d: must be"):
        mm.observables.ring_attitude(turned)


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


def test_modes_need_records_for_their_errors(motor_run):
    with pytest.raises(ValueError, match=r"burn_in = 59\.5: must leave at least 16 records"):
        mm.observables.mode_temperatures(motor_run, burn_in=59.5)


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
    with pytest.raises(ValueError, match=rf"^scene\.{field} = 0\.5: must be .*, as in the run$"):
        analyze(run, scene.replace(**{field: 0.5}))
    with pytest.raises(ValueError, match=r"^scene = None: must be given, since the run"):
        analyze(bare)


@pytest.mark.parametrize("made", ["top_run", "disk_run", "motor_run"])
def test_every_run_has_an_overview(made, request, tmp_path):
    run, drawn = request.getfixturevalue(made), tmp_path / "drawn.png"
    if made == "motor_run":
        with pytest.raises(ValueError, match=r"replicas = 3: select one: run.isel\(replica=0\)"):
            mm.plots.overview(run, None, drawn)
        run = run.isel(replica=0)
    mm.plots.overview(run, None, drawn)
    with Image.open(drawn) as picture:
        assert picture.size[0] >= 1200
        assert len(picture.getcolors(2**24) or ()) > 50


def test_invalid_datasets_are_refused(top_run):
    position = top_run.position
    wrong = {
        "the dataset must also have slip_velocity": top_run.drop_vars("slip_velocity"),
        "dtype of run.axis = 'complex128'": top_run.assign(axis=top_run.axis + 0j),
        "run.axis holds values that are not finite": top_run.assign(axis=top_run.axis * np.nan),
        "dimensions of run.axis": top_run.isel(space=0),
        "run.space = .*: must be x, y, z": top_run.isel(space=[1, 0, 2]),
        "length of space in run.axis = 2: must be 3": top_run.isel(space=[0, 1]),
        "shape of run.axis": top_run.isel(time=[]),
        "dimensions of run.axis = ..space": top_run.isel(time=0),
        "run.time must hold finite times that increase": top_run.isel(time=slice(None, None, -1)),
        r"replicas = 2: select one: run\.isel": xr.concat([top_run, top_run], "replica"),
        "of a Disk'?: must be of a Top": top_run.assign_attrs(OF_A_DISK),
        "run.time = None: must be a coordinate": top_run.drop_vars("time"),
        "an instance of xarray.Dataset": position,
    }  # fmt: skip
    for message, run in wrong.items():
        with pytest.raises(ValueError, match=message):
            mm.observables.momentum_balance(run)


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
    with pytest.raises(ValueError, match=r"first time in run = .*: must be 0"):
        mm.observables.local_slope(ensemble.isel(time=slice(5, None)))
    with pytest.raises(ValueError, match=r"factor = 1000.0: must be at most"):
        mm.observables.local_slope(ensemble, 1000)


def test_a_survival_requires_all_bins(ensemble):
    whole = mm.observables.flight_survival(ensemble)
    assert whole.survival[0] == 1
    with pytest.raises(
        ValueError, match=r"flight_duration = .*: must have all bins of the ensemble"
    ):
        mm.observables.flight_survival(ensemble.isel(flight_duration=slice(None, None, 2)))


def test_joined_or_averaged_runs_are_refused(disk_run):
    balance = mm.observables.energy_balance
    other = mm.simulate(DISK, timestep=0.01, duration=30, replicas=3, seed=6, **BAOAB)
    again: Any = xr.concat([disk_run, disk_run.assign_coords(time=disk_run.time + 31)], "time")
    for run, message in (
        (xr.concat([disk_run, other], "replica"), "run.replica = .*: must be distinct numbers"),
        (disk_run.assign_coords(replica=[0, 1, 7]), "run.replica = .*: must be distinct numbers"),
        (disk_run.mean("replica", keep_attrs=True), "run.replica = None: must be a coordinate"),
        (disk_run.isel(time=slice(-1)).coarsen(time=2).mean(keep_attrs=True), "run.step = 'float"),
        (again, "run.step must increase"),
    ):
        with pytest.raises(ValueError, match=message):
            balance(run)


def test_a_survival_requires_the_first_and_the_last_bin(ensemble):
    survival = mm.observables.flight_survival
    assert survival(ensemble).sizes["flight_duration"] > 8
    for part in (slice(1, None), slice(-1)):
        with pytest.raises(ValueError, match=r"flight_duration = .* must have all bins"):
            survival(ensemble.isel(flight_duration=part))


def test_a_continued_path_follows_its_steps_in_all_replicas(disk_run):
    half = disk_run.isel(time=slice(1001))
    rest = {"timestep": 0.01, "duration": 20, "seed": 5, **BAOAB}
    shifted = mm.simulate(DISK, **rest, replicas=3, initial=half.assign_coords(time=half.time + 9))
    assert shifted.attrs["first_step"] == 1000
    whole = disk_run.x.isel(time=slice(1000, None))
    np.testing.assert_allclose(shifted.x, whole, rtol=5e-15)  # 3e-16: x is kept in turns
    with pytest.raises(ValueError, match=r"initial.replica = \[1, 2\]: must be 0, 1, 2"):
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


def test_what_datasets_lack_is_named(motor_run, top_run, tmp_path):
    with pytest.raises(ValueError, match=r"run.position.space = None: must be a coordinate"):
        mm.observables.azimuth(motor_run.drop_vars("space"))
    with pytest.raises(ValueError, match=r"scene = array.* must be one of"):
        mm.observables.momentum_balance(top_run.assign_attrs(scene=np.array(["Top", "Disk"])))
    many = mm.ensemble(
        mm.Disk(), method="variational/baoab", timestep=0.05, duration=10.0, replicas=8
    )
    with pytest.raises(ValueError, match=r"run = .*: must have variables over time"):
        draw_variables(many.isel(time=-1), tmp_path / "overview.png")
    del many.attrs["burn_in"]
    with pytest.raises(ValueError, match=r"attributes = .*: must include burn_in"):
        mm.observables.flight_survival(many)


def test_an_ensemble_of_a_scene_without_noise_is_refused():
    with pytest.raises(ValueError, match="a Top has no noise, and all replicas would be the same"):
        mm.ensemble(mm.Top(), method="variational/euler", timestep=0.01, duration=1.0, replicas=2)


def test_an_ensemble_whose_initial_state_was_not_kept_is_not_rerun():
    many = mm.ensemble(
        mm.Motor(), method="variational/baoab", timestep=0.1, duration=2.0, replicas=2,
        initial={"velocity": (0.01, 0.0)},
    )  # fmt: skip
    with pytest.raises(ValueError, match="cannot be rerun without its initial state"):
        mm.rerun(many)
