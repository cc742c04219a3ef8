"""The program that checks the models of public packages."""

import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
PENDULUM = """
<mujoco>
  <worldbody>
    <body>
      <joint type="hinge" axis="0 1 0"/>
      <geom size="0.01" pos="0 0 -0.1"/>
      <body pos="0 0 -0.2">
        <joint type="hinge" axis="0 1 0"/>
        <geom size="0.01" pos="0 0 -0.1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
FILES = {
    "pendulum.xml": PENDULUM,
    "same.xml": PENDULUM,
    "still.xml": "<mujoco/>",
    "part.xml": "<mujocoinclude/>",
    "drawing.xml": "<svg/>",
    "half.xml": "<mujoco>",
    "lost.xml": '<mujoco><include file="nowhere.xml"/></mujoco>',
    "wrong.xml": "<mujoco><worldbody><body><freejoint/></body></worldbody></mujoco>",
}


@pytest.fixture
def packages(tmp_path):
    """A folder with one package, as pip installs it."""
    (tmp_path / "robots").mkdir()
    for name, content in FILES.items():
        (tmp_path / "robots" / name).write_text(content)
    info = tmp_path / "robots-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: robots\nVersion: 1.2\n")
    (info / "RECORD").write_text("".join(f"robots/{name},,\n" for name in FILES))
    return tmp_path


def program(folder, before="", name="__main__"):
    """Exit code and output of a program, after some statements."""
    code = f"import os, sys, time, corpus.processes, corpus.{name} as program"
    code = f"{code}\n{before}\nsys.exit(program.main())"
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder), "--workers", "2"],
        cwd=TESTS, capture_output=True, text=True, check=False, timeout=100,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


def test_the_table_counts_each_kind_of_file(packages):
    code, output, errors = program(packages)
    assert code == 0, errors
    assert "| robots 1.2 | 8 | 3 | 2 | 1 | 0 | 0 |" in output
    assert "of which two rigid bodies or more move, for the third law: 1" in output
    for reason in (
        "2 files, not MJCF", "1 files, nothing moves", "1 files, to be included",
        "1 files, lacks a file that it names", "1 files, does not compile by itself",
    ):  # fmt: skip
        assert f"skipped: {reason}" in output


@pytest.mark.parametrize(
    ("before", "complaint"),
    [
        ("import corpus.checks; corpus.checks.ROUNDING = 1e-18", "callback "),
        ("program.examine = lambda *_, **__: os._exit(3)", "exit code 3"),
        (
            "corpus.processes.LIMIT = 1; program.examine = lambda *_, **__: time.sleep(99)",
            "not done after 1 s",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(packages, before, complaint):
    code, output, errors = program(packages, before)
    assert code == 1, errors
    assert f"WRONG: robots/pendulum.xml: {complaint}" in output


def test_the_table_of_temperatures(packages):
    floor = '<worldbody><geom type="plane" size="1 1 1"/>'
    (packages / "robots" / "same.xml").write_text(PENDULUM.replace("<worldbody>", floor))
    code, output, errors = program(packages, name="acceptance")
    assert code == 0, errors
    assert "| robots 1.2 | 2 | 0 | 1 | 1 | 0 |" in output
    assert "disabled: 1 models, contact" in output
    assert "reason for contact: 1 models, geom .. and geom ..: condim: must be 1" in output


@pytest.mark.parametrize(
    ("before", "complaint"),
    [
        ("program.BOUNDS['energy'] = 1e-18", "energy "),
        ("program.BOUNDS['temperature'] = 1e-3", "temperature "),
        ("program.examine = lambda *_, **__: os._exit(3)", "exit code 3"),
    ],
)
def test_what_is_wrong_at_a_temperature_is_named(packages, before, complaint):
    code, output, errors = program(packages, before, name="acceptance")
    assert code == 1, errors
    assert f"WRONG: robots/pendulum.xml: {complaint}" in output
