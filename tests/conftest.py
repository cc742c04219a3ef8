"""Fixtures shared by several tests."""

import importlib
import re
import signal
import sys
import warnings
from pathlib import Path

import pytest
from PIL import ImageDraw

import magmotor as mm
from magmotor.commands import COMMANDS
from magmotor.device import device as protocol
from magmotor.numerics.compilation_notice import TEXT
from magmotor.render.camera import NoOpenGL
from magmotor.render.views import Views

TESTS = Path(__file__).parent
sys.path.insert(0, str(TESTS))

pytest_plugins = ["browser"]

# If a shell runs the tests in the background, they and their child processes ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)


SLOW = {*(TESTS / "slow.txt").read_text(encoding="utf-8").splitlines()}
"""Tests of library and devices whose cases take a quarter of a second of CPU time in all."""


def pytest_collection_modifyitems(items):
    """Mark each test with the name of its folder, and those of the list as slow."""
    for item in items:
        item.add_marker(item.path.relative_to(TESTS).parts[0])
        if item.nodeid.partition("[")[0] in SLOW:
            item.add_marker("slow")


@pytest.fixture
def run_script(monkeypatch, capsys):
    """Run a command or script here; return its exit code and its output to stdout and stderr."""
    monkeypatch.syspath_prepend(TESTS.parent / "scripts")
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    mujoco = importlib.import_module("mujoco")  # after magmotor, which selects OpenGL
    before = mujoco.get_mju_user_warning()

    def run(name, *arguments):
        is_command = name in COMMANDS
        script = importlib.import_module(f"magmotor.commands.{name}" if is_command else name)
        program = f"magmotor {name}" if is_command else f"{name}.py"
        monkeypatch.setattr(sys, "argv", [program, *map(str, arguments)])
        code = 0
        try:
            script.main()
        except SystemExit as stop:
            code = stop.code
        said, error = capsys.readouterr()
        return code, said, re.sub(f"{TEXT}.*\n", "", error)

    yield run
    mujoco.set_mju_user_warning(before)


@pytest.fixture
def without_rotor():
    """Restore the registered scene classes after the test, which begins without Rotor."""
    before = dict(protocol.SCENES)
    protocol.SCENES.pop("Rotor", None)
    yield
    protocol.SCENES.clear()
    protocol.SCENES.update(before)


@pytest.fixture
def rotor(monkeypatch, without_rotor):
    """The module of a device outside the package, examples/own_device.py, imported anew."""
    monkeypatch.syspath_prepend(TESTS.parent / "examples")
    monkeypatch.delitem(sys.modules, "own_device", raising=False)
    return importlib.import_module("own_device")


@pytest.fixture
def written(monkeypatch):
    """The list of the texts that are drawn into pictures during the test."""
    texts, draw = [], ImageDraw.ImageDraw.text

    def text(pen, place, words, *more):
        texts.append(words)
        return draw(pen, place, words, *more)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    return texts


@pytest.fixture(scope="session")
def opengl():
    """Skip the test if OpenGL is unavailable."""
    try:
        Views(mm.Top(), {"front": (180, 240)}).close()
    except NoOpenGL as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="session")
def case4_truth():
    """Case 4 by DOP853 for 60 s, every 0.1 s; halving its tolerance moves J by 1e-13 of its max."""
    return mm.simulate(mm.Top.paper(4), method="scipy/dop853", timestep=0.1, duration=60)
