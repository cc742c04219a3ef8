"""`magmotor export` writes scenes and tables; every command takes a scene from a file."""

import pandas as pd
import pytest

import magmotor as mm


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "top.nc"
    scene = mm.Top(tilt=0.1, friction=0.2)
    run = mm.simulate(scene, method="variational/euler", timestep=0.01, duration=0.2)
    run.to_netcdf(path)
    return path, run


def test_a_scene_from_flags_and_back(run_script, tmp_path):
    path, again = tmp_path / "my.toml", tmp_path / "again.toml"
    code, said, _ = run_script("export", "top", path, "--preset", "experiment", "--tilt", "0.1")
    assert (code, said) == (0, f"wrote {path}\n")
    assert mm.read_scene(path) == mm.Top.experiment(tilt=0.1)
    code, *_ = run_script("export", "top", again, "--scene", path, "--friction", "0.2")
    assert code == 0
    assert mm.read_scene(again) == mm.Top.experiment(tilt=0.1, friction=0.2)


@pytest.mark.parametrize("scene", [mm.Motor.paper("nonuniform-b"), mm.Disk(potential="flat")])
def test_other_scenes_from_files(run_script, tmp_path, scene):
    kind = type(scene).__name__.lower()
    mm.write_scene(scene, tmp_path / "a.toml")
    assert run_script("export", kind, tmp_path / "b.toml", "--scene", tmp_path / "a.toml")[0] == 0
    assert mm.read_scene(tmp_path / "b.toml") == scene


def test_a_sweep_of_a_scene_from_a_file(run_script, tmp_path):
    mm.write_scene(mm.Disk(noise=2.0, sigma=0.7), tmp_path / "disk.toml")
    flags = ["--method", "variational/baoab", "--timestep", "0.05", "--duration", "5"]
    out = tmp_path / "sweep"
    run_script(
        "sweep", "disk", "--scene", tmp_path / "disk.toml", "--vary", "noise=1,2", *flags,
        "--out", out, "--workers", "1",
    )  # fmt: skip
    assert mm.sweep.sweep_of(out).scene == mm.Disk(noise=2.0, sigma=0.7)


def test_a_dataset_as_a_table_and_as_its_scene(run_script, tmp_path, recorded):
    path, run = recorded
    code, said, errors = run_script("export", "run", path, tmp_path / "top.csv")
    assert (code, said, errors) == (0, f"wrote {tmp_path / 'top.csv'}\n", "")
    table = pd.read_csv(tmp_path / "top.csv", comment="#")
    pd.testing.assert_frame_equal(table, mm.to_table(run), check_exact=True)
    assert run_script("export", "run", path, tmp_path / "top.toml")[0] == 0
    assert mm.read_scene(tmp_path / "top.toml") == mm.scene_of(run)


def test_what_a_table_has_no_room_for_is_named(run_script, tmp_path):
    many = mm.ensemble(
        mm.Disk(), method="variational/baoab", timestep=0.05, duration=10.0, replicas=4
    )
    many.to_netcdf(tmp_path / "many.nc")
    _, said, _ = run_script("export", "run", tmp_path / "many.nc", tmp_path / "many.csv")
    assert "left out: x (replica)\n" in said
    names = [line.split()[2] for line in said.splitlines() if line.startswith("left out: ")]
    assert names == mm.to_table(many).attrs["left_out"]


MISTAKES = {
    ("run", "{run}", "{out}/a.txt"): "must end in .csv or .parquet for a table, in .xml or .toml",
    ("run", "{run}", "{out}/a.csv", "--rows", "space"): "rows = 'space': must be one of time",
    ("run", "{run}", "{out}/a.toml", "--rows", "time"): "a scene is not a table",
    ("run", "{out}/none.nc", "{out}/a.csv"): "cannot read",
    ("top", "{out}/a.pdf"): "must end in .xml or .toml",
    ("top", "{out}/a.toml", "--scene", "{out}/none.toml"): "No such file or directory",
    ("top", "{out}/a.toml", "--scene", "{run}"): "top.nc: it is not TOML: it is not text in UTF-8",
    ("motor", "{out}/a.toml", "--scene", "{scene}"): "has a Top: must have a Motor",
    ("top", "{out}/a.toml", "--scene", "{scene}", "--preset", "si"): "cannot be given with --scene",
}


@pytest.mark.parametrize("arguments", MISTAKES)
def test_mistakes_are_said_in_one_line(run_script, tmp_path, recorded, arguments):
    scene, out = tmp_path / "top.toml", tmp_path / "out"
    mm.write_scene(mm.Top(), scene)
    out.mkdir()
    words = [word.format(run=recorded[0], out=out, scene=scene) for word in arguments]
    code, said, errors = run_script("export", *words)
    assert (code, said, errors.count("\n")) == (2, "", 1)
    assert any(part in errors for part in MISTAKES[arguments].split("|"))
    assert not [*out.iterdir()]
