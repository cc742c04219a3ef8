"""Programs without Python: the library as a plugin of MuJoCo in C."""

import ctypes
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from c_host import (
    CC,
    LEVITATION,
    NEEDED,
    TOP,
    library_path,
    numbers,
    run,
    written,
)
from hosted_models import FILES, MANY, MODELS, OF_MANY, STEPS, state_after, states

import magmotor as mm
from library import layouts
from library.exercise import NEEDLE
from magmotor.numerics.native_library import SWITCH
from magmotor_plugin import slots
from magmotor_plugin.library import library as mujoco_library

pytestmark = NEEDED


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Files of models with many magnets."""
    return written(tmp_path_factory.mktemp("many"), MANY.values())


def test_the_bits_are_those_of_python(tmp_path, many):
    few = written(tmp_path, MODELS.values())
    done = [run("steps", STEPS, [*few, *FILES]), run("steps", OF_MANY, many)]
    lines = "".join(each.stdout for each in done).splitlines()
    expected = states()
    names = [*MODELS, *FILES, *MANY]
    found = dict(zip(names, map(numbers, lines), strict=True))
    assert [name for name, state in zip(names, expected, strict=True) if found[name] != state] == []
    assert len({*map(tuple, expected)}) == len(names) > 22  # each does something of its own
    assert [each.stderr for each in done] == ["", ""]


def test_the_callback_has_them_too(tmp_path):
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    before, _, rest = NEEDLE.partition("<extension>")
    (path,) = written(tmp_path, [before + mark + rest.partition("</extension>")[2]])
    model = mujoco.MjModel.from_xml_path(str(path))
    with mm.magnetism():
        expected = state_after(model, 1000)
    assert numbers(run("callback", 1000, [path]).stdout) == expected != state_after(model, 1000)


@pytest.mark.parametrize(
    ("name", "steps"), [("top", 500), *((name, OF_MANY) for name in MANY)], ids=["top", *MANY]
)
def test_threads_have_the_same_bits(name, steps, many):
    path = TOP if name == "top" else many[[*MANY].index(name)]
    lines = run("threads", steps, [path]).stdout.splitlines()
    assert len(lines) == 4
    model = mujoco.MjModel.from_xml_path(str(path))
    assert {*map(tuple, map(numbers, lines))} == {tuple(state_after(model, steps))}


def test_mujoco_knows_the_same_of_the_plugins():
    find, expected = mujoco_library().mjp_getPluginAtSlot, []
    find.restype = ctypes.POINTER(slots.Plugin)
    state_after(mujoco.MjModel.from_xml_path(str(LEVITATION)), 1)
    functions = "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute"
    for name in slots.NAMES:
        plugin = find(slots.slot(name)).contents
        keys = [plugin.attributes[k].decode() for k in range(plugin.nattribute)]
        given = "".join(str(int(bool(getattr(plugin, function)))) for function in functions)
        outputs = 3 if plugin.nsensordata else 0
        expected.append(
            f"{name.decode()} {len(keys)} {''.join(keys) or '-'} {plugin.capabilityflags}"
            f" {plugin.needstage} {outputs} {given}"
        )
    assert run("plugins", 0, [TOP]).stdout.splitlines() == expected


def test_memory_does_not_grow():
    (grown,) = run("leaks", 1000, [TOP]).stdout.split()
    assert int(grown) < 1000


def test_an_unknown_version_is_refused(tmp_path):
    stub = tmp_path / "stub.so"
    (source := tmp_path / "stub.c").write_text("int mj_version(void) { return 5001002; }")
    subprocess.run([CC, "-shared", "-fPIC", source, "-o", stub], check=True)
    done = run("steps", 1, [TOP], LD_PRELOAD=str(stub))
    known = ", ".join(layouts.known())
    sentence = f"nothing is registered: MuJoCo 5.1.2 is unknown; known are {known}"
    assert done.stderr == f"magmotor: {sentence}\n"
    assert "magmotor.forces" in done.stdout  # an unknown plugin


def test_the_variable_that_turns_the_library_off_does_so():
    done = run("steps", 1, [TOP], MAGMOTOR_LIBRARY="0")
    assert "magmotor.forces" in done.stdout
    assert done.stderr == ""


EMBEDDED = """
import ctypes, os, sys
c = ctypes.CDLL(sys.argv[1], ctypes.RTLD_GLOBAL)  # as in a program that is linked with MuJoCo
if {first}:
    c.mj_loadPluginLibrary(sys.argv[2].encode())
from magmotor.numerics import native_library
library = native_library.library()
print(library and library._c.magmotor_is_registered())
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
    outside = {name: value for name, value in os.environ.items() if name != SWITCH}
    done = subprocess.run(
        [*command, library_path(), TOP], env=outside, capture_output=True, text=True, check=True
    )
    registered, state = done.stdout.splitlines()
    # Another library may be there, for older processors.
    assert registered in (("None", "0") if first else ("0",))
    assert ("a program that embeds Python uses it" in done.stderr) == first
    model = mujoco.MjModel.from_xml_path(str(TOP))
    assert state == np.array(state_after(model, 10)[model.nq :]).tobytes().hex()
