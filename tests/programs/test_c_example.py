"""The example in C, built as its page says."""

import shutil
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest
from c_host import NEEDED, ROOT, TOP, library_path

from magmotor_plugin.library import library as mujoco_library

pytestmark = NEEDED
MUJOCO = Path(mujoco_library()._name).parent
TOOLS = {
    "make": [["make", "MUJOCO={}"]],
    "cmake": [["cmake", "-B", ".", "-DMUJOCO={}"], ["cmake", "--build", "."]],
}


def build(tool, folder, mujoco_folder):
    """Copy the example, and build it; return what is said on stderr."""
    if shutil.which(tool) is None:
        pytest.skip(f"{tool} is not installed")
    shutil.copytree(ROOT / "examples" / "c", folder)
    said = ""
    for command in TOOLS[tool]:
        words = [word.format(mujoco_folder) for word in command]
        said += subprocess.run(
            words, cwd=folder, capture_output=True, text=True, check=False
        ).stderr
    return said


@pytest.mark.parametrize("tool", TOOLS)
def test_it_prints_the_digits_of_python(tool, tmp_path):
    assert build(tool, tmp_path / "c", MUJOCO) == ""
    command = [tmp_path / "c" / "magnets", library_path(), TOP, "0.1"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = {line.split()[0]: [*map(float, line.split()[1:])] for line in lines.splitlines()}
    model = mujoco.MjModel.from_xml_path(str(TOP))
    data = mujoco.MjData(model)
    while data.time < 0.1:
        mujoco.mj_step(model, data)
    expected = {"time": [data.time], "qpos": [*data.qpos], "qvel": [*data.qvel]}
    mujoco.mj_forward(model, data)
    velocity, ball = np.empty(6), model.body("ball").id
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, ball, velocity, 0)
    assert found == expected | {"spin": [velocity[2]]}


@pytest.mark.parametrize("tool", TOOLS)
def test_a_folder_without_mujoco_is_named(tool, tmp_path):
    said = " ".join(build(tool, tmp_path / "c", tmp_path).split())
    assert f'MUJOCO is "{tmp_path}", where there is no libmujoco.so' in said
