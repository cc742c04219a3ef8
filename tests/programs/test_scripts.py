"""The scripts: their files, one-line errors, and exit codes."""

import importlib
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest
import xarray as xr

import magmotor as mm

SCRIPTS = Path(__file__).parents[2] / "scripts"
SHORT = ("--duration", "1", "--timestep", "0.025")


def test_without_opengl_everything_but_the_movie_is_written(tmp_path):
    done = subprocess.run(
        [
            sys.executable,
            "-W",
            "error",
            "-m",
            "magmotor",
            "movie",
            "top",
            *SHORT,
            "--out",
            tmp_path,
        ],
        capture_output=True,
        text=True,
        env=os.environ | {"MUJOCO_GL": "disable"},
        timeout=300,
        check=False,
    )
    assert done.returncode == 3, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["top.nc", "top.png"]
    for package in ("libegl1", "mesa-libEGL"):
        assert package in done.stderr
    assert "Traceback" not in done.stderr
    run = xr.load_dataset(tmp_path / "top.nc")
    assert mm.scene_of(run) == mm.Top()
    assert run.sizes["time"] == 41


@pytest.fixture
def films():
    """The arguments with which the commands of a test have rendered."""
    return []


@pytest.fixture
def movie(run_script, monkeypatch, films):
    """Return a function that runs `magmotor movie` in this process, without rendering."""
    command = importlib.import_module("magmotor.commands.movie")
    monkeypatch.setattr(command, "render", lambda *arguments: films.append(arguments))
    return partial(run_script, "movie")


def test_presets_and_fields_make_the_scene(movie, tmp_path):
    flags = ("--preset", "experiment", "--friction", "0.2", "--position", "0.03", "0.01")
    assert movie("top", *flags, *SHORT, "--out", tmp_path)[0] == 0
    scene = mm.scene_of(xr.load_dataset(tmp_path / "top.nc"))
    assert scene == mm.Top.experiment(friction=0.2, position=(0.03, 0.01))


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (("--ball-mass", "-1"), "magmotor movie: ball_mass = -1.0: must be greater than 0 kg"),
        (("--timestep", "0"), "magmotor movie: timestep = 0.0: must be greater than 0 s"),
        (
            ("--method", "euler"),
            "magmotor movie: method = 'euler': must be one of variational/euler",
        ),
        (("--preset", "paper5"), "magmotor movie: preset = 'paper5': must be one of paper1"),
        (("--speed", "0"), "magmotor movie: speed = 0.0: must be greater than"),
        (("--speed", "nan"), "magmotor movie: speed = nan: must be a finite"),
        (("--fps", "0"), "magmotor movie: fps = 0: must be at least 1"),
        (
            ("--size", "640", "361"),
            "magmotor movie: size = (640, 361): must be (width, height), ev",
        ),
        (
            ("--still", "2", "x.png"),
            "magmotor movie: still = 2.0: must be within the run: 0 to 1 s",
        ),
        (("--still", "1", "x.foo"), "magmotor movie: still = 'x.foo': must end in .eps or .jpeg"),
        (("--still", "1", "x.psd"), "magmotor movie: still = 'x.psd': must end in .eps or .jpeg"),
        (("--gif", "--speed", "1e-3"), "magmotor movie: path = "),
    ],
)
def test_a_mistake_is_one_line_and_code_2(movie, tmp_path, flags, line):
    code, _, error = movie("top", *SHORT, *flags, "--out", tmp_path)
    assert code == 2
    assert error.startswith(line)
    assert error.count("\n") == 1
    assert not any(tmp_path.iterdir())


def test_a_diverged_run_is_kept_and_code_1(movie, tmp_path):
    flags = ("--preset", "si", "--timestep", "0.001", "--duration", "1")
    code, _, error = movie("top", *flags, "--out", tmp_path)
    assert code == 1
    assert error.startswith("magmotor movie: mujoco/rk4 with timestep 0.001 s stopped at t = 0.277")
    assert error.count("\n") == 1
    assert float(xr.load_dataset(tmp_path / "top.nc").time[-1]) == pytest.approx(
        0.276, rel=1e-15, abs=0
    )  # 0


@pytest.mark.parametrize("records", [1, 3])
def test_an_interrupted_run_is_kept_and_replaces_no_whole_one(
    movie, tmp_path, monkeypatch, records
):
    assert movie("top", *SHORT, "--out", tmp_path)[0] == 0
    whole = (tmp_path / "top.nc").read_bytes()
    part = xr.load_dataset(tmp_path / "top.nc").isel(time=slice(records))

    def interrupted(*_, **__):
        raise mm.SimulationInterrupted(part)

    monkeypatch.setattr(mm, "simulate", interrupted)
    code, _, error = movie("top", *SHORT, "--out", tmp_path)
    assert (code, error) == (130, f"magmotor movie: interrupted at t = {part.time[-1]:g} s\n")
    assert (tmp_path / "top.nc").read_bytes() == whole
    kept = {path.name for path in tmp_path.iterdir()} - {"top.nc", "top.png"}
    names = {"top_interrupted.nc", "top_interrupted.png"}
    assert kept == (names if records > 1 else set())


def test_help_names_fields_with_units(movie):
    code, said, _ = movie("top", "--help")
    assert code == 0
    for text in (
        "--ring-height",
        "height H of the ring",
        "(m)",
        "--preset",
        "--speed",
    ):
        assert text in said


def test_the_film_of_a_flight_has_the_times_of_the_run(movie, films, monkeypatch, tmp_path):
    command = importlib.import_module("magmotor.commands.movie")
    monkeypatch.setattr(command, "window", lambda _: (100.0, 227.0))
    flags = ("--preset", "uniform-c", "--velocity", "0", "0.05", "--duration", "300")
    assert movie("motor", *flags, "--out", tmp_path)[0] == 0
    ((film, _, _, _, speed),) = films
    assert (film.time[0], film.time[-1], speed) == (100, 227, 5)


def test_a_flight_of_the_motor_is_found_and_replayed(movie, films, tmp_path):
    flags = ("--preset", "uniform-c", "--velocity", "0", "0.05", "--duration", "400", "--seed", "3")
    code, said, error = movie("motor", *flags, "--out", tmp_path)
    assert (code, error) == (0, "")
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["motor_flight.nc", "motor_flight.png"]
    replay = xr.load_dataset(tmp_path / "motor_flight.nc")
    scene = mm.Motor.paper("uniform-c", velocity=(0.0, 0.05))
    assert mm.scene_of(replay) == scene
    found = re.match(r".* revolutions in .* filmed from t = (\d+) to (\d+) s\n", said)
    assert found, said
    assert replay.attrs["found"] == found[0].strip()
    begin, end = map(int, found.groups())
    assert replay.time[-1] == end - begin
    ((film, filmed_scene, path, _, speed),) = films
    assert (filmed_scene, path) == (scene, tmp_path / "motor_flight.mp4")
    assert (film.time[0], film.time[-1]) == (begin, end)
    assert (end - begin) / speed <= 27 < (end - begin) / (speed - 1)
    numerics = {"method": "mujoco/baoab", "timestep": 0.1, "seed": 3}
    run = mm.simulate(scene, duration=end, record_interval=5, **numerics)
    same = run.position.sel(time=slice(begin, end))
    np.testing.assert_allclose(replay.position, same, rtol=1e-15)  # measured: 0
    whole, filmed = (mm.observables.flights(part).squeeze() for part in (run, replay))
    assert 0 <= filmed.begin < filmed.end <= end - begin
    for moment in ("begin", "end"):
        assert filmed[moment] + begin == pytest.approx(float(whole[moment]), abs=1e-9)  # 0
    turns = [mm.observables.azimuth(part).values / (2 * np.pi) for part in (replay, run)]
    before = turns[1][run.time.values == begin] - turns[0][0]
    assert replay.attrs["revolutions_before"] == pytest.approx(before[0], abs=1e-12)


def test_formats_and_size_of_movies(run_script, tmp_path, monkeypatch):
    written = {}

    def film(run, scene, path, **options):
        written[path.suffix] = options
        path.write_bytes(b"movie")

    monkeypatch.setattr(mm.render, "movie", film)
    flags = ("--gif", "--webm", "--size", "640", "360", "--fps", "10", "--speed", "2")
    code, said, error = run_script("movie", "top", *SHORT, *flags, "--out", tmp_path)
    assert (code, error) == (0, "")
    options = {"speed": 2.0, "fps": 10, "size": (640, 360)}
    assert written == {".gif": options, ".webm": options}
    for name in ("top.gif", "top.webm"):
        assert f"wrote {tmp_path / name}\n" in said
    assert not (tmp_path / "top.mp4").exists()


def test_no_flight_no_movie(movie, tmp_path):
    code, _, error = movie("motor", "--duration", "100", "--out", tmp_path)
    assert code == 4
    assert (
        error == "magmotor movie: no movie: no flight in 100 s; try another seed or a longer run\n"
    )
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_exported_mjcf_is_standalone_and_moves_alike(run_script, tmp_path, surface):
    path = tmp_path / "sub" / "top.xml"
    code, *_ = run_script("export", "top", path, "--surface", surface, "--tilt", "0.1")
    assert code == 0
    assert [*path.parent.iterdir()] == [path]
    exported = mujoco.MjModel.from_xml_path(str(path))
    names = {
        mujoco.mj_id2name(exported, mujoco.mjtObj.mjOBJ_CAMERA, i) for i in range(exported.ncam)
    }
    assert names == {"front", "top", "ball"}
    ends = []
    for model in (exported, mm.build(mm.Top(surface=surface, tilt=0.1))):
        model.opt.timestep = 0.01
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=300)
        ends.append(np.concatenate([data.qpos, data.qvel]))
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-14)  # measured: 6.5e-16


def test_exported_disk_has_its_noise_and_potential(run_script, tmp_path):
    path = tmp_path / "disk.xml"
    flags = ("--potential", "asymmetric", "--noise", "2")
    assert run_script("export", "disk", path, *flags)[0] == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    assert model.body("disk").user[0] == 2
    np.testing.assert_array_equal(model.joint("x").user, [1, 0, 0.4, 0])
    code, _, error = run_script("export", "disk", path, "--potential", "symetric")
    assert code == 2
    assert error.count("\n") == 1
    assert "did you mean 'symmetric'" in error


def test_exported_motor_is_that_of_the_preset(run_script, tmp_path):
    path = tmp_path / "motor.xml"
    flags = ("--preset", "nonuniform-c", "--inner-mass", "5")
    assert run_script("export", "motor", path, *flags)[0] == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    np.testing.assert_array_equal(model.body("inner_ring").user[:6], [0, 0, 0, 2.5e-4, 0, 0])
    assert not model.body("ball").user.any()
    assert model.body("inner_ring").mass == 5
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=10)
    assert np.isfinite(data.qpos).all()
    assert data.joint("inner_ring").qvel.any()
    code, _, error = run_script("export", "motor", path, "--preset", "paper4")
    assert code == 2
    assert error.startswith("magmotor export: preset = 'paper4': must be one of nonuniform-a")


def test_a_file_that_cannot_be_written_is_one_line(run_script, tmp_path):
    (tmp_path / "file").touch()
    code, _, error = run_script("export", "top", tmp_path / "file" / "top.xml")
    assert code == 4
    assert error.startswith("magmotor export: cannot write")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "program"),
    [("movie", "magmotor movie"), ("disk", "disk.py"), ("motor", "motor.py")],
)
def test_an_impossible_folder_is_one_line_before_the_work(run_script, tmp_path, name, program):
    file = tmp_path / "file"
    file.touch()
    arguments = ["top"] if name == "movie" else []
    code, said, error = run_script(name, *arguments, "--out", file)
    assert (code, said) == (4, "")
    assert error == f"{program}: cannot write to {file}: it is a file, not a folder\n"


WRITER = """
import sys
from pathlib import Path
import numpy as np, xarray as xr
sys.argv = ["writer.py"]
from magmotor.commands.output import run_program, write_netcdf
noise = np.random.default_rng(0).random((4, 1000000))
data = xr.Dataset({{f"x{{i}}": ("n", row) for i, row in enumerate(noise)}})
encoding = {{name: {{"zlib": True, "complevel": 9}} for name in data}}
run_program(lambda: write_netcdf(data, Path({path!r}), encoding))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM")
def test_a_terminated_program_removes_what_it_has_begun(tmp_path):
    code = f"""
import sys, time
from pathlib import Path
from magmotor.commands.output import run_program, written_whole
def main():
    with written_whole(Path({str(tmp_path / "a.csv")!r})) as part:
        part.write_text("half")
        print("begun", flush=True)
        time.sleep(60)
run_program(main)
"""
    writer = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    assert writer.stdout.readline() == "begun\n"
    writer.terminate()
    _, error = writer.communicate(timeout=60)
    assert writer.returncode == 130
    assert error.endswith("interrupted; all files reported as written are complete\n")
    assert not [*tmp_path.iterdir()]


def test_an_interrupted_write_is_finished_and_leaves_no_other_file(tmp_path):
    path = tmp_path / "run.nc"
    code = WRITER.format(path=str(path))
    writer = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    try:
        deadline = time.monotonic() + 60
        while not any(tmp_path.iterdir()):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(0.1)
        writer.send_signal(signal.SIGINT)
        _, error = writer.communicate(timeout=60)
    finally:
        writer.kill()
    assert writer.returncode == 130
    assert error == "writer.py: interrupted; all files reported as written are complete\n"
    assert [*tmp_path.iterdir()] == [path]
    assert len(xr.load_dataset(path)) == 4
