"""The command `magmotor`: its output, its picture, its exit codes, and one line for a mistake."""

import os
import runpy
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from advised_models import Clock
from PIL import Image

import magmotor as mm
from magmotor.advice.points import Point
from magmotor.advice.report import fails_from
from magmotor.commands import COMMANDS, main
from magmotor.commands.model_file import load

SCRIPTS, EXAMPLES = (Path(__file__).parents[2] / name for name in ("scripts", "examples"))

PENDULUM = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02"/>
    </body>
  </worldbody>
  <actuator><motor joint="hinge" gear="2"/></actuator>
  <keyframe><key name="down" qpos="0"/><key name="up" qpos="2"/></keyframe>
</mujoco>
"""

OSCILLATOR = """
<mujoco>
  <option timestep="0.005" gravity="0 0 0"/>
  <worldbody>
    <body><joint type="slide" stiffness="400"/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""

TOUCHING = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body><freejoint/><geom size="0.005"/><site user="0.5"/></body>
    <body pos="0 0 0.03"><freejoint/><geom size="0.005"/><site user="0.5"/></body>
  </worldbody>
</mujoco>
"""


THERMAL = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body>
      <joint axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run the command in a folder with models; returns exit code, output and error."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.xml").write_text(PENDULUM)
    (tmp_path / "oscillator.xml").write_text(OSCILLATOR)
    (tmp_path / "touching.xml").write_text(TOUCHING)
    (tmp_path / "thermal.xml").write_text(THERMAL)
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody>")

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["magmotor", *arguments])
        code = 0
        try:
            main()
        except SystemExit as exit:
            code = exit.code
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def clock(monkeypatch):
    """Budgets count steps instead of time, so that no load of the machine changes an answer."""
    return Clock(monkeypatch, step=1e-4)


@pytest.mark.usefixtures("clock")
def test_advice_is_printed_and_drawn(run, tmp_path):
    code, out, _ = run("advise", "pendulum.xml", "--keyframe", "up", "--budget", "5")
    assert code == 0
    assert "\nadvice: " in out
    assert out.endswith("wrote advise.png\n")
    assert (tmp_path / "advise.png").stat().st_size > 10_000
    quick = ("--keyframe", "up", "--budget", "1", "--error", "0.3", "--picture")
    assert run("advise", "pendulum.xml", *quick, "a/b.svg")[0] == 0
    assert "<svg" in (tmp_path / "a" / "b.svg").read_text()
    assert run("advise", "pendulum.xml", *quick, "b.png", "--dpi", "50")[0] == 0
    with Image.open(tmp_path / "b.png") as picture:
        assert picture.size == (500, 220)
    assert run("advise", "pendulum.xml", *quick, "None")[1].count("wrote") == 0


@pytest.fixture
def asked(monkeypatch):
    """Return the arguments with which advice is asked; there is none."""
    found = []

    def advise(model, data, **settings):
        found.append(SimpleNamespace(data=data, **settings))
        return mm.Advice(quantity="positions", error=0.01, duration=1.0)

    monkeypatch.setattr("magmotor.commands.advise.advise", advise)
    return found


def test_random_velocities_are_added_to_the_state(run, asked):
    for options in ("--velocity 0.5", "--velocity 0.5 --seed 1", "--velocity 1 --seed 1", ""):
        run("advise", "pendulum.xml", *options.split())
    first, second, faster, none = (float(each.data.qvel[0]) for each in asked)
    assert first == 0.5 * np.random.default_rng(0).standard_normal()
    assert second != first
    assert faster == 2 * second
    assert none == 0.0


def test_controls_are_one_number_or_one_for_each_actuator(run, asked):
    for options in ("--control 0.5", "--keyframe up --control -1"):
        run("advise", "pendulum.xml", *options.split())
    assert [each.data.ctrl.tolist() for each in asked] == [[0.5], [-1.0]]
    assert asked[1].data.qpos.tolist() == [2.0]
    code, _, err = run("advise", "pendulum.xml", "--control", "1", "2")
    assert code == 2
    assert err.startswith(
        "magmotor advise: control = (1.0, 2.0): must be one number, or 1, one per act"
    )
    _, _, err = run("advise", "pendulum.xml", "--control", "1.1e10")
    assert err == "magmotor advise: control = 11000000000.0: must be less than 1e+10\n"
    _, _, err = run("advise", "touching.xml", "--control", "1")
    assert err.endswith("must be left out, since the model has no actuators\n")


def test_a_question_is_that_of_the_options(run, asked):
    given = "--quantity energy --error 0.2 --duration 3 --budget 7 --kT 0.5 --detail"
    for options in ("", given):
        run("advise", "pendulum.xml", *options.split())
    default, changed = (vars(each) for each in asked)
    assert default.items() >= {"quantity": "positions", "error": 0.01, "duration": None}.items()
    assert default.items() >= {"budget": 60.0, "kT": None, "detail": False}.items()
    assert changed.items() >= {"quantity": "energy", "error": 0.2, "duration": 3.0}.items()
    assert changed.items() >= {"budget": 7.0, "kT": 0.5, "detail": True}.items()


def test_magnets_at_a_temperature_act_once(run):
    """`mm.Langevin` computes their forces itself."""
    options = "--kT 1e-5 --error 0.3 --duration 0.1 --budget 2 --picture None"
    code, out, err = run("advise", "thermal.xml", *options.split())
    assert code in (0, 1)
    assert out.startswith("error of positions over 0.096 s")
    assert err == ""


def test_a_log_of_mujoco_is_not_left_behind(run, tmp_path):
    """Of a warning while a file is loaded."""
    (tmp_path / "nan.xml").write_text(PENDULUM.replace('qpos="2"', 'qpos="nan"'))
    run("describe", "nan.xml")
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_without_an_answer_the_findings_of_check_are_printed(run, asked):
    code, out, _ = run("advise", "touching.xml")
    assert code == 1
    reason = "what `magmotor check` finds may be the reason:\n"
    _, found, findings = out.partition(reason)
    assert found
    assert "once they touch" in findings.splitlines()[0]
    assert reason not in run("advise", "pendulum.xml")[1]
    assert len(asked) == 2


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize("option", ["--velocity 0.5", "--control 1", "--keyframe up"])
def test_what_is_at_rest_says_which_options_move_it(run, option):
    code, _, err = run("advise", "pendulum.xml", "--budget", "2")
    assert code == 2
    assert option.rpartition(" ")[0] in err
    assert run("advise", "pendulum.xml", "--budget", "2", *option.split())[0] == 0


@pytest.mark.usefixtures("clock")
def test_where_integrators_fail_along_the_path_is_printed(run):
    """Of an undamped oscillator of 20 rad/s: RK4 is stable up to 0.141 s, Euler's phase lags."""
    _, out, _ = run(
        "advise", "oscillator.xml", "--velocity", "1", "--duration", "20", "--budget", "20"
    )
    head, *rows = out.splitlines()[2:8]
    cells = {row.split()[0]: row[head.index("fails from") : head.index("stable")] for row in rows}
    assert cells["RK4"].startswith("0.16 s (diverges after ")
    assert cells["Euler"].startswith("0.02 s (error ")


def test_the_shortest_timestep_that_fails_counts():
    errors = {0.01: 0.1, 0.02: 0.6, 0.04: np.inf}
    points = [Point("RK4", timestep, 1.0, error) for timestep, error in errors.items()]
    assert fails_from(points) is points[1]
    assert fails_from(points[:1]) is None


@pytest.mark.usefixtures("clock")
def test_details_are_printed(run):
    arguments = ["--keyframe", "up", "--budget", "5", "--detail", "--picture", "other.png"]
    _, out, _ = run("advise", "pendulum.xml", *arguments)
    assert 'flag gravity="disable"' in out


def test_splittings_are_compared_at_a_temperature(run):
    code, out, _ = run("advise", "pendulum.xml", "--kT", "0.1", "--error", "0.3", "--duration", "8")
    assert (code, "baoab" in out, "wrote" in out) == (0, True, False)


@pytest.mark.usefixtures("clock")
def test_no_recommendation_is_exit_code_1(run):
    code, out, _ = run("advise", "pendulum.xml", "--keyframe", "up", "--budget", "1", "--error",
                       "1e-8", "--duration", "200")  # fmt: skip
    assert code == 1
    assert "no recommendation: " in out


def test_findings_are_exit_code_1(run):
    code, out, _ = run("check", "touching.xml")
    assert code == 1
    assert "will fly apart" in out
    assert run("check", "pendulum.xml")[0] == 0


def test_a_model_is_described_once(run):
    code, out, _ = run("describe", "touching.xml")
    starts = [line.partition(": ")[0] for line in out.splitlines()]
    assert (code, starts.count("acting")) == (0, 1)


def test_a_compiled_model_is_described_alike(run, tmp_path):
    model = mujoco.MjModel.from_xml_path("touching.xml")
    mujoco.mj_saveModel(model, str(tmp_path / "touching.mjb"))
    expected = run("describe", "touching.xml")
    assert run("describe", str(tmp_path / "touching.mjb")) == expected
    assert load(tmp_path / "touching.mjb").nbody == model.nbody


def test_what_is_no_compiled_model_is_one_line_and_leaves_no_log(run, tmp_path):
    (tmp_path / "garbage.mjb").write_text("garbage")
    code, _, error = run("describe", "garbage.mjb")
    assert code == 2
    sentence = f"must be a model that MuJoCo {mujoco.__version__} has compiled"
    assert error == f"magmotor describe: path = 'garbage.mjb': {sentence}\n"
    assert run("describe", "missing.mjb")[2] == (
        "magmotor describe: cannot read missing.mjb: No such file or directory\n"
    )
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


@pytest.mark.parametrize(("arguments", "line"), [
    ("advise missing.xml", "magmotor advise: cannot read missing.xml: No such file or directory"),
    ("advise broken.xml", "magmotor advise: cannot load broken.xml: it is not valid XML (line 1)"),
    ("advise pendulum.xml", "magmotor advise: quantity = 'positions': does not change along"),
    ("advise pendulum.xml --picture a.b", "magmotor advise: picture = 'a.b': must be a file name"),
    ("advise pendulum.xml --dpi 5", "magmotor advise: dpi = 5: must be at least 10"),
    ("advise pendulum.xml --error 2", "magmotor advise: error = 2.0: must be less than 0.5"),
    ("advise pendulum.xml --keyframe x", "magmotor advise: keyframe = 'x': must be one of"),
    ("check pendulum.xml --keyframe x", "magmotor check: keyframe = 'x': must be one of"),
])  # fmt: skip
def test_a_mistake_is_one_line_and_exit_code_2(arguments, line, run):
    code, _, err = run(*arguments.split())
    assert code == 2
    assert err.startswith(line)
    assert err.count("\n") == 1


def test_the_command_is_installed_and_is_also_a_module():
    (command,) = entry_points(group="console_scripts", name="magmotor")
    assert command.load() is main
    called = subprocess.run([sys.executable, "-m", "magmotor", "--help"], capture_output=True)
    assert called.returncode == 0
    assert b"advise" in called.stdout


def test_without_a_command_the_commands_are_listed(run):
    code, out, _ = run()
    assert code == 2
    assert out.startswith("usage: magmotor ")
    assert all(f"\n  {name} " in out for name in COMMANDS)
    assert run("--help")[:2] == (0, out)
    assert run("--version")[:2] == (0, f"magmotor {mm.__version__}\n")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_describes_itself_once(run, command):
    code, out, err = run(command, "--help")
    assert (code, err) == (0, "")
    assert out.startswith(f"usage: magmotor {command} ")
    assert out.count("usage: ") == 1
    assert max(map(len, out.splitlines())) <= 100


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", ["--help", "examples list", "completion bash"])
def test_output_that_cannot_be_written_or_is_not_read(monkeypatch, words):
    command = [sys.executable, "-m", "magmotor", *words.split()]
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 4
    assert done.stderr.endswith(": cannot write: No space left on device\n")
    assert done.stderr.count("\n") == 1
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (4, "")


@pytest.mark.parametrize(("variable", "value", "line"), [
    ("MUJOCO_GL", "directx", "invalid value for environment variable MUJOCO_GL: directx"),
    ("NUMBA_DISABLE_JIT", "1", "NUMBA_DISABLE_JIT is set: unset it, since magmotor needs"),
])  # fmt: skip
def test_a_wrong_environment_is_one_line(run, variable, value, line):
    done = subprocess.run(
        [sys.executable, "-m", "magmotor", "describe", "touching.xml"], capture_output=True,
        text=True, check=False, env={**os.environ, variable: value},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"magmotor describe: {line}")
    assert done.stderr.count("\n") == 1


def test_an_unknown_command_is_named_in_one_line(run):
    code, out, err = run("moovie")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(
        "magmotor: 'moovie' is not a command (did you mean 'movie'?); the commands are movie, view,"
    )


def test_a_script_is_the_command_of_its_name(monkeypatch):
    names = {path.stem for path in SCRIPTS.glob("*.py")} - {"disk", "figures", "motor", "study"}
    assert names < set(COMMANDS)
    called = []
    monkeypatch.setattr("magmotor.commands.main", called.append)
    for name in sorted(names):
        runpy.run_path(str(SCRIPTS / f"{name}.py"), run_name="__main__")
    assert called == sorted(names)


def test_examples_are_listed_shown_and_run(run, tmp_path, monkeypatch):
    code, out, _ = run("examples", "list")
    assert (code, out.count("\n")) == (0, len(list(EXAMPLES.glob("*.py"))) - 1)  # without support
    code, out, _ = run("examples", "show", "compass_needles")
    assert out.startswith((EXAMPLES / "compass_needles.py").read_text())
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "support", raising=False)
    flags = ("--duration", "4", "--out")
    code, _, _ = run("examples", "run", "compass_needles", *flags, "needles.png")
    assert code == 0
    assert (tmp_path / "needles.png").exists()
    assert run("examples", "copy", "mine")[:2] == (0, "copied the examples to mine\n")
    names = {path.name for path in EXAMPLES.iterdir() if path.suffix in {".py", ".xml"}}
    assert {path.name for path in (tmp_path / "mine").iterdir()} == names
    program = [sys.executable, "-W", "error", "mine/compass_needles.py", *flags, "mine.png"]
    done = subprocess.run(program, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "theory: 24.77" in done.stdout
    assert (tmp_path / "mine.png").exists()
    _, _, err = run("examples", "copy", "mine")
    assert err == "magmotor examples: folder = 'mine': must be the path of a new folder\n"


@pytest.mark.parametrize(("arguments", "line"), [
    ("play", "magmotor examples: verb = 'play': must be one of list, show, run, copy"),
    ("run", "magmotor examples: name = '': must be one of climbing_robot"),
    ("run support", "magmotor examples: name = 'support': must be one of climbing_robot"),
])  # fmt: skip
def test_an_unknown_example_is_named_in_one_line(run, arguments, line):
    code, out, err = run("examples", *arguments.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(line)
