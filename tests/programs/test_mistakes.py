"""Mistakes that new users make: what is said beside the sentences in tests/messages."""

import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import mujoco
import pytest

import magmotor as mm
from magmotor.common import environment
from magmotor.common.checks import did_you_mean


@pytest.mark.parametrize(
    ("name", "choices", "hint"),
    [
        ("euler", ("variational/euler", "mujoco/euler"), "'variational/euler' or 'mujoco/euler'"),
        ("RK4", ("mujoco/euler", "mujoco/rk4"), "'mujoco/rk4'"),
        ("verlett", ("variational/verlet", "mujoco/rk4"), "'variational/verlet'"),
        ("mujoco/implicit", ("mujoco/implicitfast", "mujoco/rk4"), "'mujoco/implicitfast'"),
        ("leapfrog", ("variational/verlet", "mujoco/rk4"), ""),
    ],
)
def test_what_a_wrong_name_may_mean(name, choices, hint):
    assert did_you_mean(name, choices) == (f" (did you mean {hint}?)" if hint else "")


def test_magnetism_without_a_block_is_a_warning():
    with pytest.warns(UserWarning, match="write `with magmotor.magnetism") as caught:
        mm.magnetism()
    assert caught[0].filename == __file__


def test_magnetism_as_a_block_or_a_decorator_gives_no_warning():
    before = mujoco.get_mjcb_control()

    @mm.magnetism()
    def installed():
        return mujoco.get_mjcb_control()

    block = mm.magnetism()
    for _ in range(2):
        with block, block:
            assert mujoco.get_mjcb_control() != before
        assert mujoco.get_mjcb_control() == before
    assert installed() != before
    assert mujoco.get_mjcb_control() == before


NEEDLE = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site name="earth" pos="0 1 0" zaxis="0 1 0" user="7.8e22"/>
    <body>
      <joint type="hinge" axis="0 0 1"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="{}"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(("moment", "huge"), [("2e5", {"needle": 2e5}), ("0.2", {})])
def test_a_moment_that_no_magnet_has_is_named(moment, huge):
    found = mm.describe(mujoco.MjModel.from_xml_string(NEEDLE.format(moment)))
    assert found.huge == huge
    line = "site needle has 200000 A m^2, the moment of 1.4e+03 kg of neodymium magnets"
    assert (line in str(found)) == bool(huge)


def test_mujoco_before_magmotor_is_named_where_opengl_is_missing(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert environment.gl_setting().startswith("mujoco was imported first: import magmotor before")
    monkeypatch.setenv("MUJOCO_GL", "disable")
    assert environment.gl_setting() == "MUJOCO_GL=disable"
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    assert environment.gl_setting().startswith("MUJOCO_GL=glfw needs a display: set it to egl")


@pytest.mark.parametrize(
    ("checkpoint", "how"),
    [
        (None, "the attribute `dataset` has the records; with a checkpoint, runs can be resumed"),
        (Path("a.checkpoint"), "the same call resumes from the checkpoint a.checkpoint"),
    ],
)
def test_an_interrupt_says_when_and_how_to_go_on(checkpoint, how):
    run = mm.simulate(mm.Top(), duration=1.0, method="mujoco/euler", timestep=0.05)
    stop = mm.SimulationInterrupted(run, checkpoint)
    assert str(stop) == f"interrupted at t = 1 s: {how}"
    assert (stop.time, stop.checkpoint) == (1.0, checkpoint)


@pytest.fixture
def sweep(run_script, monkeypatch, tmp_path):
    """Return a function that runs `magmotor sweep` in a folder, with a thread as its worker."""
    from concurrent.futures import ThreadPoolExecutor

    monkeypatch.chdir(tmp_path)
    execute = mm.sweep.run

    def run(plan, folder, **options):
        options.pop("workers")
        with ThreadPoolExecutor(1) as thread:
            return execute(plan, folder, executor=thread, workers=1, **options)

    monkeypatch.setattr(mm.sweep, "run", run)
    numerics = ("--method", "mujoco/euler", "--timestep", "0.02", "--duration", "1")
    return lambda *arguments: run_script("sweep", "top", *arguments, *numerics)


def test_every_sweep_has_a_folder_of_its_own(sweep, tmp_path):
    for vary, folder in {
        ("--vary", "tilt=0,0.1"): "sweep_top_tilt",
        ("--vary", "tilt=0,0.1", "--vary", "height=0.2,0.3"): "sweep_top_tilt_ring_height",
    }.items():
        code, _, errors = sweep(*vary)
        assert (code, errors) == (0, "")
        assert (tmp_path / "out" / folder / "sweep.json").exists()
        assert (tmp_path / "out" / f"{folder}.nc").exists()
    code, _, errors = sweep("--vary", "tilt=0,0.2")
    assert code == 2
    assert "it holds one that differs in vary: give this sweep another folder (on the" in errors
    assert "--out" in errors


def test_a_sweep_of_which_every_case_fails_says_why(sweep, tmp_path):
    vary = ("--vary", "height=0.05,0.051", "--tilt", "0.001")
    code, said, errors = sweep(*vary, "--out", tmp_path / "s")
    assert code == 1
    assert errors == "magmotor sweep: every case failed; run again with --retry to repeat\n"
    assert re.search(r"  ring_height = 0\.05: timestep = 0\.02: must be less than", said)
    assert not (tmp_path / "s.nc").exists()


def test_an_interrupt_after_the_last_case_says_how_to_go_on(sweep, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("magmotor.commands.sweep.combined", interrupted)
    code, _, errors = sweep("--vary", "tilt=0,0.1", "--out", tmp_path / "s")
    assert code == 130
    again = f"magmotor sweep combine {tmp_path / 's'}"
    assert errors == (
        f"magmotor sweep: interrupted after the last case; {again} writes its dataset\n"
    )


@pytest.mark.parametrize(
    ("kT", "doubted"), [(300, True), (293.15, True), (2e-4, False), (1, False)]
)
def test_a_temperature_in_kelvin_is_doubted(kT, doubted):
    model = mujoco.MjModel.from_xml_string(NEEDLE.format("0.2"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mm.Langevin(model, kT=kT, friction=1.0)
    found = [str(warning.message) for warning in said]
    assert (
        found
        == [f"kT = {kT:g} J is an energy: {kT:g} K would be kT = {1.380649e-23 * kT:.3g} J"]
        * doubted
    )


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ('<mujoco><worldbody><site name="\xfc" user="1"/></worldbody></mujoco>', 0, "acting:"),
        ('<mujoco><worldbody><site user="\xfc"/></worldbody></mujoco>', 2, "cannot load"),
        ('<mujoco><worldbody><geom mesh="\xfc" type="mesh"/></worldbody></mujoco>', 2, "\xfc"),
        (None, 2, "No such file"),
    ],
)
def test_paths_and_names_that_are_not_utf_8(text, code, said, tmp_path):
    folder = os.fsencode(tmp_path) + b"/m\xfcll"
    os.mkdir(folder)  # noqa: PTH102 - a path of bytes
    path = folder + b"/\xfc.xml"
    if text is not None:
        Path(os.fsdecode(path)).write_bytes(text.encode("latin-1"))
    command = [sys.executable, "-m", "magmotor", "describe", path]
    done = subprocess.run(command, capture_output=True, env=os.environ | {"PYTHONUTF8": "1"})
    lines = (done.stdout + done.stderr).decode(errors="surrogateescape")
    assert (done.returncode, said in lines, "Traceback" in lines) == (code, True, False), lines
