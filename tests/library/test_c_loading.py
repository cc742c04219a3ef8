"""Programs without Python: which of them can load the library, and what it refuses."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from c_host import CC, NEEDED, TOP, library_path, numbers, program, run, state_after, written

from library import layouts
from library.exercise import NEEDLE
from magmotor.numerics.native_library import SWITCH
from magmotor_plugin.library import library as mujoco_library

pytestmark = NEEDED
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != SWITCH}
"""Which does not turn the library off."""


def compiled(folder, source, *options):
    """Compile a program."""
    path = folder / "program"
    (text := folder / "program.c").write_text(source)
    subprocess.run([CC, text, "-o", path, "-ldl", *options], check=True)
    return path


def test_a_folder_may_have_several_libraries_and_links(tmp_path):
    shutil.copy(library_path(), tmp_path / "libfirst.so")
    (tmp_path / "libsecond.so").symlink_to(library_path())
    done = run("plugins", 0, [TOP], library=f"{tmp_path}/")
    found = [line.split()[0] for line in done.stdout.splitlines()]
    assert found == ["magmotor.forces", "magmotor.magnetometer"]
    assert done.stderr == ""


LOADER = """
#include <dlfcn.h>

int main(int count, char **arguments) {
  void *host = dlopen(arguments[1], RTLD_LAZY);
  return ((int (*)(int, char **))dlsym(host, "main"))(count - 1, arguments + 1);
}
"""


def test_mujoco_may_be_loaded_by_a_plugin_of_the_program(tmp_path):
    """Its symbols are not visible then, as in nodes of ROS 2, in Julia and in Python."""
    loader = compiled(tmp_path, LOADER)
    (path,) = written(tmp_path, [NEEDLE])
    done = run("steps", 100, [path], by=(loader, program("-shared", "-fPIC")))
    model = mujoco.MjModel.from_xml_path(str(path))
    assert numbers(done.stdout) == state_after(model, 100)
    assert done.stderr == ""


CLOSING = """
#include <dlfcn.h>
#include <mujoco/mujoco.h>

int main(int count, char **arguments) {
  for (int k = 0; k < 1000; k++) dlclose(dlopen(arguments[1], RTLD_NOW));
  return count != 3 || !mj_loadXML(arguments[2], NULL, NULL, 0);
}
"""


def test_it_stays_when_a_program_closes_it(tmp_path):
    """MuJoCo has the addresses of its functions."""
    mujoco_file = Path(mujoco_library()._name)
    include = f"-I{mujoco_file.parent / 'include'}"
    closing = compiled(tmp_path, CLOSING, include, mujoco_file, f"-Wl,-rpath,{mujoco_file.parent}")
    subprocess.run([closing, library_path(), TOP], env=ENVIRONMENT, check=True)


WITHOUT_MUJOCO = """
#include <dlfcn.h>

int main(int count, char **arguments) {
  return !dlopen(arguments[count - 1], RTLD_NOW);
}
"""


@pytest.mark.parametrize(
    ("version", "reason"),
    [
        ("", "MuJoCo is not loaded, or exports nothing\n"),
        ("int mj_version(void) { return 4000000; }", "MuJoCo has no function "),
        (
            "int mj_version(void) { return 5001002; }",
            f"MuJoCo 5.1.2 is unknown; known are {', '.join(layouts.known())}\n",
        ),
    ],
    ids=["none", "incomplete", "unknown"],
)
def test_what_is_not_mujoco_is_refused(version, reason, tmp_path):
    one = compiled(tmp_path, version + WITHOUT_MUJOCO, "-rdynamic")
    done = subprocess.run(
        [one, library_path()], env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    assert done.stderr.startswith(f"magmotor: nothing is registered: {reason}")
    assert done.stderr.count("\n") == 1


def test_the_variable_that_turns_the_library_off_does_so(tmp_path):
    done = run("steps", 1, [TOP], MAGMOTOR_LIBRARY="0")
    assert "magmotor.forces" in done.stdout
    assert done.stderr == ""
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    (path,) = written(tmp_path, [f"<mujoco>{mark}<worldbody/></mujoco>"])
    run("callback", 1, [path], MAGMOTOR_LIBRARY="0")  # it would crash if it did anything


EMBEDDED = """
import ctypes, os, sys
c = ctypes.CDLL(sys.argv[1], ctypes.RTLD_GLOBAL)  # as in a program that is linked with MuJoCo
if {first}:
    c.mj_loadPluginLibrary(sys.argv[2].encode())
from magmotor.numerics import native_library
library = native_library.library()
print(c.mjp_pluginCount(), library and library._c.magmotor_is_registered())
import magmotor, mujoco
model = mujoco.MjModel.from_xml_path(sys.argv[3])
data = mujoco.MjData(model)
mujoco.mj_step(model, data, nstep=10)
print(data.qvel.tobytes().hex())
assert os.environ.get("MAGMOTOR_LIBRARY") is None
"""


@pytest.mark.parametrize("first", [False, True])
def test_a_program_in_c_may_embed_python(first):
    """Python registers its plugins, or takes those that the program has registered before."""
    command = [sys.executable, "-c", EMBEDDED.format(first=first), mujoco_library()._name]
    done = subprocess.run(
        [*command, library_path(), TOP], env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    registered, state = done.stdout.splitlines()
    # Another library may be there, for older processors.
    assert registered in (("2 None", "2 0") if first else ("0 0",))
    assert ("a program that embeds Python uses it" in done.stderr) == first
    model = mujoco.MjModel.from_xml_path(str(TOP))
    assert state == np.array(state_after(model, 10)[model.nq :]).tobytes().hex()
