"""`magmotor sweep` and scripts/study.py: output, interrupts, and errors."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from sweep_driver import contents

import magmotor as mm
from magmotor import theory

SCRIPTS = Path(__file__).parents[2] / "scripts"
TOP = ("top", "--vary", "tilt=0:0.2:3", "--vary", "height=0.2:0.4:2", "--duration", "2")
QUICK = ("--method", "variational/verlet", "--timestep", "0.02")


@pytest.fixture
def script(run_script, monkeypatch):
    """Return a function that runs a script with a thread as its worker."""
    execute = mm.sweep.run

    def run(sweep, folder, *, workers=None, executor=None, retry=False):
        with ThreadPoolExecutor(1) as thread:
            return execute(sweep, folder, executor=executor or thread, workers=1, retry=retry)

    monkeypatch.setattr(mm.sweep, "run", run)
    return run_script


def test_a_sweep_its_dataset_and_its_picture(script, tmp_path):
    out = tmp_path / "s"
    code, said, errors = script("sweep", *TOP, *QUICK, "--seeds", "0:8", "--out", out)
    assert (code, errors) == (0, "")
    assert said.splitlines()[0] == "a top has no noise, so only the first seed is used"
    assert said.splitlines()[1] == "6 cases by variational/verlet, h = 0.02, T = 2"
    assert said.splitlines()[2].startswith("6 cases: 6 done, 0 failed; 6 computed in ")
    data = xr.load_dataset(tmp_path / "s.nc")
    assert dict(data.sizes) == {"tilt": 3, "ring_height": 2, "seed": 1}
    assert {*data.data_vars} == {"max_spin", "settling_radius"}
    assert data.max_spin.notnull().all()
    assert 5_000 < (tmp_path / "s.png").stat().st_size < 200_000
    before = contents(tmp_path)
    code, said, errors = script("sweep", *TOP, *QUICK, "--out", out)
    assert (code, errors) == (0, "")
    assert "6 done, 0 failed; 0 computed" in said
    assert contents(out) == {k[2:]: v for k, v in before.items() if k.startswith("s/")}
    code, said, _ = script("sweep", "status", out)
    assert (code, said) == (0, "6 cases: 6 done, 0 failed, 0 missing\n")


@pytest.mark.parametrize("out", [".", "../here"])
def test_a_sweep_in_the_current_folder_has_its_dataset_beside_it(
    script, tmp_path, monkeypatch, out
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert script("sweep", *TOP, *QUICK, "--out", out)[0] == 0
    assert (tmp_path / "here.nc").exists()
    assert (tmp_path / "here" / "sweep.json").exists()


def test_missing_cases_are_reported_and_left_blank(script, tmp_path):
    out = tmp_path / "s"
    script("sweep", *TOP, *QUICK, "--out", out)
    next((out / "done").rglob("*.json")).unlink()
    code, said, _ = script("sweep", "status", out)
    assert (code, said) == (0, "6 cases: 5 done, 0 failed, 1 missing\n")
    code, said, _ = script("sweep", "combine", out)
    assert code == 0
    assert said.startswith("6 cases: 5 done, 0 failed, 1 missing\n")
    assert int(xr.load_dataset(tmp_path / "s.nc").max_spin.isnull().sum()) == 1


@pytest.mark.filterwarnings("default:.*is damaged:UserWarning")
def test_a_damaged_result_is_reported_and_left_out_or_repaired(script, tmp_path):
    out = tmp_path / "s"
    script("sweep", *TOP, *QUICK, "--out", out)
    file = next((out / "done").rglob("*.json"))
    file.write_bytes(file.read_bytes().replace(b"max_spin", b"max_spun"))
    name = file.relative_to(out)
    code, said, _ = script("sweep", "status", out)
    assert (code, said.splitlines()[0]) == (0, "6 cases: 5 done, 0 failed, 1 missing")
    assert said.splitlines()[1].startswith(f"  {name} is damaged: its checksum differs; running")
    code, _, errors = script("sweep", "combine", out)
    assert (code, errors.count("\n")) == (2, 1)
    assert errors.startswith(f"magmotor sweep: {name} is damaged: ")
    assert script("sweep", "combine", out, "--skip-damaged")[0] == 0
    assert int(xr.load_dataset(tmp_path / "s.nc").max_spin.isnull().sum()) == 1
    code, said, errors = script("sweep", *TOP, *QUICK, "--out", out)
    line = f"{name} is damaged: its checksum differs; the case is recomputed"
    assert (code, errors) == (0, f"magmotor sweep: {line}\n")
    assert "6 done, 0 failed; 1 computed" in said


def test_a_sweep_is_run_again_from_its_dataset(script, tmp_path):
    out, file = tmp_path / "s", tmp_path / "s.nc"
    script("sweep", *TOP, *QUICK, "--out", out)
    assert script("rerun", file) == (0, "identical: 2 variables, 6 cases\n", "")
    data = xr.load_dataset(file)
    data.max_spin[1, 0] = np.nan
    data.to_netcdf(file)
    assert script("rerun", file) == (0, "identical: 2 variables, 6 cases\n", "")
    data.max_spin[1, 1] += 0.5
    spec = json.loads(data.attrs["sweep"])
    spec["versions"]["numpy"] = "1.0"
    data.assign_attrs(sweep=json.dumps(spec)).to_netcdf(file)
    code, said, _ = script("rerun", file)
    assert code == 1
    assert said.startswith("different: max_spin by at most 0.5; numpy was 1.0, is ")


def test_failed_cases_are_reported_and_the_code_is_1(script, tmp_path):
    out = tmp_path / "s"
    vary = ("top", "--vary", "height=0.05:0.3:8", "--duration", "1", *QUICK)
    code, said, errors = script("sweep", *vary, "--out", out)
    assert code == 1
    assert errors == "magmotor sweep: 1 case failed; run again with --retry to repeat\n"
    assert "  ring_height = 0.05: timestep = 0.02: must be less than 0.0" in said
    code, again, _ = script("sweep", *vary, "--out", out)
    assert "0 computed" in again
    code, again, _ = script("sweep", *vary, "--retry", "--out", out)
    assert "1 computed" in again
    assert (tmp_path / "s.png").exists()


@pytest.mark.parametrize(
    ("flags", "changes"),
    [
        (("--vary", "noise=1:4:3:log"), [{"noise": n} for n in (1, 2, 4)]),
        (("--vary", "noise=1:3:3"), [{"noise": n} for n in (1, 2, 3)]),
        (("--vary", "noise=1,3.5"), [{"noise": n} for n in (1, 3.5)]),
        (("--vary", "x,v=0,0.5"), [{"x": x, "v": x} for x in (0, 0.5)]),
        (("--vary", "v=-0.5:0.5:2"), [{"v": v} for v in (-0.5, 0.5)]),
        (
            ("--vary", "v=0,1", "--vary", "noise=2,3"),
            [{"v": v, "noise": n} for v in (0, 1) for n in (2, 3)],
        ),
    ],
)
def test_what_vary_means(script, tmp_path, flags, changes):
    quick = ("--duration", "1", "--timestep", "0.1", "--method", "variational/baoab")
    script("sweep", "disk", *flags, *quick, "--out", tmp_path / "s")
    sweep = mm.sweep.sweep_of(tmp_path / "s")
    found = [sweep.changes(i) for i in range(len(sweep))]
    assert [f.keys() for f in found] == [c.keys() for c in changes]
    for one, other in zip(found, changes, strict=True):
        np.testing.assert_allclose([*one.values()], [*other.values()], rtol=1e-15)  # 0


def test_a_design_with_seeds_and_replicas(script, tmp_path):
    design = ("--design", "sobol:4:7", "--vary", "noise=1:3", "--vary", "friction=0.05:0.5:log")
    runs = ("--seeds", "3:5", "--replicas", "2", "--duration", "1", "--timestep", "0.05")
    numerics = ("--method", "variational/baoab", "--measure", "displacement,temperature")
    code, *_ = script("sweep", "disk", *design, *runs, *numerics, "--out", tmp_path / "s")
    assert code == 0
    data = xr.load_dataset(tmp_path / "s.nc")
    assert data.displacement.sizes == {"sample": 4, "seed": 2, "replica": 2}
    assert data.noise.dims == ("sample",)
    samples = mm.sweep.Samples({"noise": (1, 3), "friction": (0.05, 0.5, True)}, 4, "sobol", 7)
    np.testing.assert_array_equal(data.friction, samples.columns()["friction"])
    assert (tmp_path / "s.png").exists()


def test_more_than_two_dimensions_have_no_picture(script, tmp_path):
    vary = [flag for name in ("x", "v", "theta") for flag in ("--vary", f"{name}=0,1")]
    quick = ("--duration", "1", "--timestep", "0.05", "--method", "variational/baoab")
    code, said, _ = script("sweep", "disk", *vary, *quick, "--out", tmp_path / "s")
    assert code == 0
    assert "no picture: axes = " in said
    assert not (tmp_path / "s.png").exists()


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        ((), "--vary is missing: it must be FIELD=START:STOP:COUNT or FIELD=VALUE,"),
        (("--vary", "hight=0.1,0.2"), "field = 'hight': must be one of ball_mass, "),
        (("--vary", "tilt"), "vary = 'tilt': must be FIELD=START:STOP:COUNT"),
        (("--vary", "tilt=0:0.2"), "vary = 'tilt=0:0.2': must be FIELD=START:STOP:COUNT without"),
        (("--vary", "tilt=0:0.2:99999999999"), "COUNT must be at most 1048576"),
        (("--vary", "tilt=0:inf:3"), "vary = 'tilt=0:inf:3': START and STOP must be finite"),
        (("--vary", "tilt=0,0.1", "--seeds", "0:99999999999"), "must be at most 1048576 seeds"),
        (("--vary", "tilt=0,0.1", "--replicas", "1000000000000"), "replicas = 2000000000000: must"),
        (
            ("--vary", "tilt=0,0.1", "--vary", "tilt=1"),
            "vary = 'tilt=1': must vary each field only",
        ),
        (("--vary", "tilt=0:0.2:0"), "vary = 'tilt=0:0.2:0': COUNT must be at least 1"),
        (
            ("--vary", "tilt=0:0.2:1.5"),
            "vary = 'tilt=0:0.2:1.5': must be FIELD=START:STOP:COUNT or",
        ),
        (("--vary", "tilt=0:0.2:3:log"), "START and STOP must be positive in a log"),
        (("--vary", "tilt=a,b"), "vary = 'tilt=a,b': 'a' is not a number"),
        (
            ("--vary", "tilt=0,0.1", "--seeds", "3:3"),
            "seeds = '3:3': must be at least one seed",
        ),
        (("--vary", "tilt=0,0.1", "--seeds", "x"), "seeds = 'x': must be FIRST:LAST, or numbers"),
        (
            ("--vary", "tilt=0,0.1", "--measure", "spin"),
            "measure = 'spin': must be one of max_spin",
        ),
        (("--vary", "tilt=0:0.1", "--design", "sobol"), "design = 'sobol': must be KIND:SIZE"),
        (("--vary", "tilt=0,0.1", "--design", "sobol:8"), "vary = []: must be FIELD=LOW:HIGH"),
        (("--vary", "tilt=0:0.1", "--design", "grid:8"), "design = 'grid': must be one of random"),
        (
            ("--vary", "tilt,spin=0:0.1", "--design", "latin:8"),
            "must name a single field with --design",
        ),
        (
            ("--vary", "tilt=0,0.1", "--scheduler", "nowhere:"),
            "scheduler = 'nowhere:': must be the a",
        ),
    ],
)
def test_a_mistake_is_one_line_and_code_2(script, tmp_path, flags, line):
    code, _, error = script("sweep", "top", *flags, *QUICK, "--out", tmp_path / "s")
    assert code == 2
    assert error.startswith("magmotor sweep: ")
    assert line in error
    assert error.count("\n") == 1
    assert not (tmp_path / "s").exists()


def test_mistakes_about_folders(script, tmp_path):
    out = tmp_path / "s"
    script("sweep", *TOP, *QUICK, "--out", out)
    for arguments, line in {
        ("status", tmp_path): "must be the folder of a sweep: it has no sweep.json",
        ("combine", tmp_path / "no"): "must be the folder of a sweep: it has no sweep.json",
        ("movie", tmp_path / "no"): "must be the folder of a sweep: it has no sweep.json",
        (*TOP, *QUICK, "--friction", "0.2", "--out", out): "holds one that differs in scene_fields",
        (*TOP, *QUICK, "--out", tmp_path): "must be empty or hold this sweep; it holds s",
    }.items():
        code, _, error = script("sweep", *arguments)
        assert code == 2
        assert line in error
        assert error.count("\n") == 1


def test_a_movie_of_a_sweep(script, tmp_path, monkeypatch):
    drawn = {}

    def contact_sheet(runs, scenes, labels, path, **options):
        drawn.update(options, runs=runs, scenes=scenes, labels=labels)
        path.write_bytes(b"movie")

    monkeypatch.setattr(mm.render, "contact_sheet", contact_sheet)
    vary = ("top", "--vary", "tilt=0:0.2:9", "--vary", "height=0.2:0.4:3", "--duration", "2")
    script("sweep", *vary, *QUICK, "--out", tmp_path / "s")
    code, said, errors = script("sweep", "movie", tmp_path / "s")
    assert (code, said, errors) == (0, f"wrote {tmp_path / 's.mp4'}\n", "")
    assert (drawn["columns"], drawn["speed"]) == (6, 1)
    tilts = np.array([scene.tilt for scene in drawn["scenes"]]).reshape(3, 6)
    heights = np.array([scene.ring_height for scene in drawn["scenes"]]).reshape(3, 6)
    assert (tilts == tilts[0]).all()
    np.testing.assert_allclose(tilts[0, [0, -1]], [0, 0.2], rtol=1e-15)  # 0
    np.testing.assert_allclose(
        heights, np.repeat([[0.4], [0.3], [0.2]], 6, axis=1), rtol=2e-15
    )  # 1.9e-16
    assert drawn["labels"][0] == "tilt 0, ring_height 0.4"
    assert drawn["runs"][0].sizes["time"] == 1 + 2 / 0.04  # every second step: 1/20 s at most
    code, _, error = script("sweep", "disk", "--vary", "v=0,1", "--out", tmp_path / "d")
    code, _, error = script("sweep", "movie", tmp_path / "d")
    assert (code, error) == (
        2,
        "magmotor sweep: scene = 'Disk': movies show only a Top or a Motor\n",
    )


def program(*arguments):
    command = [sys.executable, "-m", "magmotor", "sweep", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def test_after_an_interrupt_the_same_command_resumes(script, tmp_path):
    """Ctrl-C reaches the driver and its workers, as from a terminal."""
    out = tmp_path / "s"
    vary = ("disk", "--vary", "noise=1:4:24", "--duration", "1000", "--timestep", "0.01")
    command = (*vary, "--method", "variational/euler", "--workers", "2", "--out", out)
    running = program(*command)
    deadline = time.monotonic() + 120
    while len([*out.glob("done/*/*")]) < 3:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.killpg(running.pid, signal.SIGINT)
    _, errors = running.communicate(timeout=60)
    assert running.returncode == 130
    assert errors.startswith("magmotor sweep: sweep interrupted; 24 cases: ")
    assert errors.endswith(" missing; the same command resumes it\n")
    assert errors.count("\n") == 1
    done = len([*out.glob("done/*/*")])
    assert done < 24
    code, said, errors = script("sweep", *command)
    assert (code, errors) == (0, "")
    assert f"24 cases: 24 done, 0 failed; {24 - done} computed in" in said
    assert (tmp_path / "s.png").exists()


@pytest.mark.parametrize("seconds", [0.2, 1.5])
def test_an_interrupt_while_workers_start_is_one_line(tmp_path, seconds):
    """In its first seconds a worker imports its modules."""
    running = program("disk", "--vary", "noise=1:4:40", "--workers", "2", "--out", tmp_path / "s")
    try:
        assert running.stdout is not None
        assert running.stdout.readline().startswith("40 cases by ")
        time.sleep(seconds)
        os.killpg(running.pid, signal.SIGINT)
        _, errors = running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == 130
    recommended, said = errors.splitlines()
    assert recommended.startswith("mujoco/baoab at a timestep of ")
    assert said.startswith("magmotor sweep: sweep interrupted; 40 cases: ")


def test_a_started_cluster_computes_a_sweep(run_script, tmp_path):
    cluster = program("cluster", "--workers", "1")
    try:
        assert cluster.stdout is not None
        line = cluster.stdout.readline()
        assert line.startswith("--scheduler tcp://127.0.0.1:")
        address = line.split()[1].rstrip(";")
        vary = ("disk", "--vary", "noise=1,2", "--duration", "1", "--timestep", "0.05")
        out = ("--scheduler", address, "--out", tmp_path / "s")
        code, said, errors = run_script("sweep", *vary, "--method", "variational/euler", *out)
        assert code == 0, errors
        assert "2 cases: 2 done, 0 failed; 2 computed" in said
    finally:
        os.killpg(cluster.pid, signal.SIGINT)
        _, errors = cluster.communicate(timeout=60)
    assert cluster.returncode == 130
    assert errors == "magmotor sweep: interrupted; all files reported as written are complete\n"


@pytest.mark.parametrize(
    ("host", "warns"),
    [
        *((host, 1) for host in ("0.0.0.0", "192.0.2.1", "::", "box")),
        *((host, 0) for host in ("127.0.0.1", "127.1.2.3", "localhost", "::1", "[::1]")),
    ],
)
def test_a_cluster_that_others_can_reach_warns(run_script, monkeypatch, host, warns):
    monkeypatch.setattr(mm.sweep, "local_cluster", lambda *_: nullcontext("tcp://x:1"))
    monkeypatch.setattr("magmotor.commands.sweep.wait", lambda: None)
    code, said, errors = run_script("sweep", "cluster", "--host", host)
    assert (code, said) == (0, "--scheduler tcp://x:1; Ctrl-C ends it\n")
    assert errors.count("\n") == warns
    assert ("can run any code here" in errors) == bool(warns)


def test_a_cluster_on_another_interface_is_a_mistake():
    running = program("cluster", "--workers", "1", "--host", "203.0.113.7")
    _, errors = running.communicate(timeout=60)
    assert running.returncode == 2
    assert errors.startswith(
        "magmotor sweep: host = '203.0.113.7': must be an interface of this machine"
    )
    assert errors.count("\n") == 1


def test_no_workers_is_a_mistake(run_script, tmp_path):
    vary = ("disk", "--vary", "noise=1,2", "--duration", "1", "--timestep", "0.05")
    code, _, errors = run_script("sweep", *vary, "--workers", "0", "--out", tmp_path / "s")
    assert (code, errors) == (2, "magmotor sweep: workers = 0: must be at least 1\n")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("spin", "--points", "-1", "2"), "points = -1: must be at least 1"),
        (("spin", "--points", "1", "0"), "points = 0: must be at least 1"),
        (("flights", "--points", "0"), "points = 0: must be at least 1"),
        (("flights", "--duration", "-5"), "duration = -5.0: must be greater than 0 s"),
        (("geometry", "--points", "0", "2"), "points = 0: must be at least 1"),
        (("geometry", "--duration", "0"), "duration = 0.0: must be greater than 0 s"),
    ],
)
def test_an_impossible_study_is_one_line_and_code_2(script, tmp_path, arguments, line):
    code, _, error = script("study", *arguments, "--out", tmp_path)
    assert (code, error) == (2, f"study.py: {line}\n")


def test_where_the_top_spins(script, tmp_path):
    code, said, _ = script("study", "spin", "--points", "3", "4", "--out", tmp_path)
    assert code == 0
    assert "12 cases: " in said
    data = xr.load_dataset(tmp_path / "study_spin.nc").isel(seed=0)
    assert 5_000 < (tmp_path / "study_spin.png").stat().st_size < 200_000
    low = data.sel(ring_height=slice(0.2, 0.3))
    assert float(low.max_spin.isel(tilt=0).max()) < 0.05  # 0.012 rad/s without tilt
    assert float(low.max_spin.isel(tilt=1).min()) > 1  # 5.1
    limit = theory.highest_valley(mm.Top())
    settled = data.settling_radius.isel(tilt=0)
    assert (settled.where(settled.ring_height > limit, drop=True) < 0.02).all()  # 0.011
    assert (settled.where(settled.ring_height < limit, drop=True) > 0.05).all()  # 0.083


def test_how_often_the_motor_flies(script, tmp_path):
    few = ("--points", "3", "--seeds", "2", "--duration", "2000")
    code, said, errors = script("study", "flights", *few, "--out", tmp_path)
    assert (code, errors) == (0, "")
    assert "6 cases: 6 done" in said
    assert (tmp_path / "study_flights.png").stat().st_size < 200_000
    data = xr.load_dataset(tmp_path / "study_flights.nc")
    spec = json.loads(data.attrs["sweep"])
    assert spec["vary"][0][0] == ["alpha_ball", "alpha_ring"]
    kT = data.alpha_ball**2 / (2 * 0.15)
    relative = (data.slip_temperature / kT).mean("seed")
    np.testing.assert_allclose(relative, 1, atol=0.1)  # 0.02; 2000 s: 1/sqrt(4000) each


def test_where_the_motor_flies(script, tmp_path):
    """At the farthest outer ring, nothing holds the inner ring level above the nearest floor."""
    few = ("--points", "2", "2", "--seeds", "1", "--duration", "2000")
    code, said, errors = script("study", "geometry", *few, "--out", tmp_path)
    assert (code, errors) == (0, "")
    assert "4 cases: 3 done, 1 failed" in said
    assert "outer_radius = 1.2, inner_height = 0.36" in said
    assert "the inner ring is lost" in said
    assert said.count("longest flight: ") == 2
    assert (tmp_path / "study_geometry.png").stat().st_size < 200_000  # 50 kB
    rings = xr.load_dataset(tmp_path / "study_geometry.nc").isel(seed=0)
    assert rings.longest_flight.dims == ("outer_radius", "inner_height")
    assert np.isnan(rings.longest_flight.values).tolist() == [[False, False], [True, False]]
    dipoles = xr.load_dataset(tmp_path / "study_geometry_dipoles.nc").isel(seed=0)
    assert dipoles.flying.dims == ("inner_dipoles", "outer_dipoles")
    assert (dipoles.flying.fillna(0) >= 0).all()
    assert (dipoles.transitions > 0).any()
