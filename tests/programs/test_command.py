"""The command `magmotor`: its output, its picture, its exit codes, and one line for a mistake."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

from magmotor.command_line import main

PENDULUM = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02"/>
    </body>
  </worldbody>
  <keyframe><key name="up" qpos="2"/></keyframe>
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


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run the command in a folder with two models; returns exit code, output and error."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.xml").write_text(PENDULUM)
    (tmp_path / "touching.xml").write_text(TOUCHING)
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


def test_advice_is_printed_and_drawn(run, tmp_path):
    code, out, _ = run("advise", "pendulum.xml", "--keyframe", "up", "--budget", "5")
    assert code == 0
    assert "\nadvice: " in out
    assert out.endswith("wrote advice.png\n")
    assert (tmp_path / "advice.png").stat().st_size > 10_000


def test_details_are_printed(run):
    arguments = ["--keyframe", "up", "--budget", "5", "--detail", "--picture", "other.png"]
    _, out, _ = run("advise", "pendulum.xml", *arguments)
    assert 'flag gravity="disable"' in out


def test_splittings_are_compared_at_a_temperature(run):
    code, out, _ = run("advise", "pendulum.xml", "--kT", "0.1", "--error", "0.3", "--duration", "8")
    assert (code, "baoab" in out, "wrote" in out) == (0, True, False)


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
    assert (code, out.count("acting: ")) == (0, 1)


@pytest.mark.parametrize(("arguments", "line"), [
    ("advise missing.xml", "magmotor: ParseXML: Error opening file 'missing.xml'"),
    ("advise broken.xml", "magmotor: XML parse error"),
    ("advise pendulum.xml", "magmotor: quantity = 'positions': does not change along the path"),
    ("advise pendulum.xml --error 2", "magmotor: error = 2.0: must be less than 0.5"),
    ("advise pendulum.xml --keyframe x", "magmotor: keyframe = 'x': must be one of the model's"),
    ("check pendulum.xml --keyframe x", "magmotor: keyframe = 'x': must be one of the model's"),
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
