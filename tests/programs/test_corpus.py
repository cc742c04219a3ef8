"""The program that checks the models of public packages."""

import json
import math
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from magmotor.advice.stability import Limit
from trials.corpus import beside
from trials.corpus.judgment import Judgment, along, judge, quantity_of
from trials.corpus.stability import agree, is_finite

ROOT = Path(__file__).parents[2]
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


PROGRAMS = """
import gc, json, os, sys, time, traceback
sys.path.append("tests")
import trials.corpus.__main__, trials.corpus.acceptance, trials.corpus.advice
import trials.corpus.processes, trials.corpus.stability
from trials.corpus.acceptance import HINGE, mm, mujoco

with mm.magnetism():
    mm.Langevin(mujoco.MjModel.from_xml_string(HINGE), kT=1.0, seed=1)
gc.freeze()
for line in sys.stdin:
    name, before, arguments, files = json.loads(line)
    program = sys.modules[f"trials.corpus.{name}"]
    child = os.fork()
    if child == 0:
        for number, file in enumerate(files, start=1):
            os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT), number)
        sys.argv[1:] = arguments
        code = 1
        try:
            exec(before)
            code = program.main()
        except SystemExit as end:
            code = end.code
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(code or 0)  # without taking down all that has been loaded
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
"""Runs a program in a fork for each line of input, since loading takes longer than most."""


@pytest.fixture(scope="module")
def programs():
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAMS],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        yield process
        process.communicate(timeout=100)


@pytest.fixture
def program(programs, tmp_path_factory):
    """Exit code and output of a program, after some statements."""

    def run(folder, before="", name="__main__", options=("--workers", "2")):
        texts = tmp_path_factory.mktemp("output")
        files = [texts / "output", texts / "errors"]
        line = json.dumps([name, before, [str(folder), *options], [*map(str, files)]])
        print(line, file=programs.stdin, flush=True)
        return int(programs.stdout.readline()), *(file.read_text() for file in files)

    return run


def test_the_table_counts_each_kind_of_file(packages, program):
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
        ("import trials.corpus.checks as c; c.BOUNDS['callback'] = 1e-18", "callback "),
        ("program.examine = lambda *_, **__: os._exit(3)", "exit code 3"),
        (
            "trials.corpus.processes.LIMIT = 1; program.examine = lambda *_, **__: time.sleep(99)",
            "not done after 1 s",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(packages, program, before, complaint):
    code, output, errors = program(packages, before)
    assert code == 1, errors
    assert f"WRONG: robots/pendulum.xml: {complaint}" in output


def test_the_table_of_temperatures(packages, program):
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
def test_what_is_wrong_at_a_temperature_is_named(packages, program, before, complaint):
    code, output, errors = program(packages, before, name="acceptance")
    assert code == 1, errors
    assert f"WRONG: robots/pendulum.xml: {complaint}" in output


FEW = """
from advised_models import Clock
from pytest import MonkeyPatch
Clock(MonkeyPatch(), step=1e-4)
program.BUDGET, program.DURATIONS, program.SPEEDS = 3, (1.0,), (2.0,)
program.QUANTITIES = "positions", "energy"
"""
"""Questions about the pendulum that have an answer; the budget counts steps instead of time."""


def test_promises_are_judged_twice(packages, program):
    code, output, errors = program(packages, FEW, name="advice")
    assert code == 0, errors
    assert "against RK4" in output or "against implicitfast" in output
    assert "| all | 1 | 1 | 0 | 1 | 1 of 1 |" in output
    assert output.endswith("1 models, 1 promises, of which 1 hold\n")


@pytest.mark.parametrize("change", ["own=1.0", "other=1.0, doubt=0.01, by='RK4'"])
def test_a_promise_broken_before_either_judge_fails(packages, program, change):
    before = f"{FEW}\nfrom dataclasses import replace\njudge = program.judge\n"
    before += f"program.judge = lambda *arguments: replace(judge(*arguments), {change})"
    code, output, errors = program(packages, before, name="advice")
    assert code == 1, errors
    assert "BROKEN" in output
    assert output.endswith("1 models, 1 promises, of which 0 hold\n")


def test_a_process_that_does_not_return_fails(packages, program):
    before = f"{FEW}\nprogram.mm.advise = lambda *_, **__: os._exit(3)"
    code, output, _ = program(packages, before, name="advice")
    assert code == 1
    assert "robots/pendulum.xml FAILED: exit code 3" in output


SPRING = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="ball">
      <joint type="slide" axis="1 0 0" stiffness="4"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(
    ("integrator", "other", "own", "others"),
    [
        ("Euler", "RK4", 0.1, 1e-5),  # 0.01, 1.6e-6: the ends of the motion are between records
        ("RK4", "implicitfast", 2e-3, 0.5),  # 1.2e-4, 0.079
    ],
)
def test_both_judges_find_the_error_of_an_oscillator(integrator, other, own, others):
    """Its motion is x = sin(2 t)/2, and its energy that of its start."""
    model = mujoco.MjModel.from_xml_string(SPRING)
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    step = {"Euler": 0.02, "RK4": 0.2}[integrator]
    count = round(3.0 / step)
    truth = np.sin(2 * step * np.arange(count + 1)) / 2
    body = quantity_of(model, "body ball")
    run = along(model, data, body.observe, integrator, step, 1, count)
    exact = np.abs(run[:, 0] - truth).max()  # the range is 1 m
    energies = along(model, data, quantity_of(model, "energy").observe, "RK4", 0.01, 1, 100)
    found = judge(model, data, body, integrator, step, 3.0, promised=0.01)
    assert (found.by, found.doubt < 0.0025) == (other, True)
    assert found.other == pytest.approx(exact, rel=others)
    assert found.own == pytest.approx(exact, rel=own)
    assert np.abs(energies[:, 0] - 0.5).max() < 1e-9  # 4.4e-11
    assert np.ptp(energies[:, 1]) == pytest.approx(0.5, abs=1e-3)  # 4.2e-5


def test_the_judges_see_the_worst_element():
    """A free body turns by a right angle about z while x errs by half of its range, 0.02.

    y moves by less than a thousandth of the rest, and does not count.
    """
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    )
    data, judged = mujoco.MjData(model), quantity_of(model, "positions", whole=False)
    rows = []
    for x, y, angle in ((0.0, 0.0, 0.0), (0.02, 1e-7, np.pi / 2), (0.01, 2e-7, np.pi / 2)):
        data.qpos[:2] = x, y
        mujoco.mju_axisAngle2Quat(data.qpos[3:7], np.array([0.0, 0.0, 1.0]), angle)
        rows.append(judged.observe(model, data))
    truth, own = np.array([rows[0], rows[1]]), np.array([rows[0], rows[2]])
    assert judged.distance(own, truth, truth) == pytest.approx(0.5, rel=1e-12)
    x, axis = judged.parts[0][0], judged.parts[3][0]
    assert rows[1][x] == pytest.approx(0.02)
    assert rows[1][axis] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)  # of the body, in the world
    own, truth = own[:, : judged.size], truth[:, : judged.size]
    assert quantity_of(model, "positions").distance(own, truth, truth) < 0.2  # 0.1


def test_the_other_judge_counts_as_far_as_it_is_certain():
    assert Judgment(own=0.009).holds(0.01)
    assert not Judgment(own=0.011).holds(0.01)
    assert not Judgment(0.009, other=0.013, doubt=0.002).holds(0.01)
    assert Judgment(0.009, other=0.011, doubt=0.002).holds(0.01)


def test_limits_that_are_infinite_both_are_counted_apart(packages, program):
    options = ["--models", "1"]
    code, output, errors = program(packages, name="stability", options=options)
    assert code == 0, errors
    assert "1 models, 5 pairs of limits, of which " in output
    before = "program.NEAR = -1.0"
    assert program(packages, before, name="stability", options=options)[0] == 1
    before = "program.is_finite = lambda _: False"
    assert program(packages, before, name="stability", options=options)[0] == 1
    infinite = Limit(math.inf, math.inf, ())
    assert not is_finite(infinite)
    for pair in [(math.inf, 1.0), (1.0, math.inf), (1.0, 1.2)]:
        assert is_finite(Limit(*pair, ()))
        assert not agree(Limit(*pair, ()))
    assert agree(Limit(1.0, 1.05, ()))


def test_the_table_of_packages_is_whole():
    """`python -m trials.corpus` asks pip whether its rows are right."""
    rows = beside.rows_of(beside.PAGE.read_text())
    requirements = ROOT / "trials" / "corpus" / "requirements.txt"
    names = [each.replace("==", " ") for each in beside.packages_of(requirements)]
    assert [*rows] == names
    for name, (mujoco_version, numpy_version, reason) in rows.items():
        assert bool(mujoco_version and numpy_version) != bool(reason), name
