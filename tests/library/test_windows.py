"""The library for Windows, by Wine.

The environment variable MUJOCO_WINDOWS names a folder with MuJoCo's library; `make cross` sets it.
"""

import os
import subprocess
from pathlib import Path

import mujoco
import pytest
from c_host import TOP, error_of, written
from hosted_models import state_after

from library.exercise import NEEDLE
from library.targets import TARGETS
from magmotor.numerics import native_library

MUJOCO = os.environ.get("MUJOCO_WINDOWS", "")
EXAMPLE = Path(__file__).parents[2] / "examples" / "c" / "magnets.c"
TARGET = TARGETS["windows"]
pytestmark = pytest.mark.skipif(not MUJOCO, reason="only `make cross` has MuJoCo for Windows")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The example, beside which MuJoCo's library must be, in a Windows of its own."""
    folder = tmp_path_factory.mktemp("windows")
    (folder / "mujoco.dll").symlink_to(Path(MUJOCO, "mujoco.dll"))
    made = "-I", Path(MUJOCO, "include"), EXAMPLE, folder / "mujoco.dll", "-o", folder / "magnets"
    subprocess.run([*TARGET.compiler, *made], check=True)
    return folder / "magnets.exe"


def run(program, path, seconds):
    """Run the example; paths on this machine are on drive Z of Wine."""
    command = ["wine", program, f"Z:{native_library.FOLDER / TARGET.file}", f"Z:{path}", seconds]
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    environment |= {"WINEPREFIX": str(program.parent / "wine"), "WINEDEBUG": "-all"}
    environment.pop(native_library.SWITCH, None)
    return subprocess.run(command, env=environment, capture_output=True, text=True)


def test_it_has_the_digits_of_python(program):
    model = mujoco.MjModel.from_xml_path(str(TOP))
    done = run(program, TOP, "1")
    _, qpos, qvel, _ = (list(map(float, line.split()[1:])) for line in done.stdout.splitlines())
    assert qpos + qvel == state_after(model, round(1 / model.opt.timestep))


def test_errors_have_the_words_of_python(program, tmp_path):
    (path,) = written(tmp_path, [NEEDLE.replace('user="0.2"', 'user="0.2 1 2"')])
    done = run(program, path, "1")
    assert error_of(path) in done.stderr
    assert done.returncode == 1
