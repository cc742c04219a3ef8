"""Programs without Python: the library as a plugin of MuJoCo in C."""

import doctest
import json
import os
import shutil
import subprocess
import warnings
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest
from messages import declarations

import magmotor as mm
from library import layouts
from library.exercise import NEEDLE
from magmotor.mjcf import error_raising, layout
from magmotor.numerics import native_library
from magmotor.numerics.native_library import SWITCH
from magmotor_plugin.library import library as mujoco_library

ROOT = Path(__file__).parents[2]
CC = shutil.which(os.environ.get("CC", "cc")) or ""
LIBRARY: Any = native_library.library()
pytestmark = [
    pytest.mark.skipif(LIBRARY is None, reason="there is no library: python -m library.build"),
    pytest.mark.skipif(not CC, reason="there is no C compiler"),
]
END = "\n\f\n"
TOP = ROOT / "models" / "top_magnetic.xml"
MODELS = "top_magnetic", "motor_magnetic", "levitation"
SLIDER = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="{act}"/></instance></plugin>{extension}</extension>
  <option gravity="0 0 0"/>
  <custom>{custom}</custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <site name="still" user="1e-3"/>
    <site name="probe" pos="0.5 0 0"/>
    <geom name="bar" size="0.01" pos="0 0 0.3"/>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.5"/>
    <body name="sled" pos="1 0 0" user="{wrench}">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
      <geom name="sled" size="0.01" mass="1"/>
      <site name="{name}" user="{moment}"/>
    </body>
  </worldbody>
  <sensor>{sensor}</sensor>
  <keyframe><key qpos="{qpos}" time="{time}"/></keyframe>
</mujoco>
"""
"""A dipole on a sled; the first key is a state in which something is wrong."""

GRID = " ".join(["4 4 4 -4 -4 -4 3 3 3", *["0 0 1"] * 64])
IRON = declarations.iron
METER = '<plugin plugin="magmotor.magnetometer"{}/>'
WRONG_STATES = {
    "coincidence": {"qpos": "-1 0"},
    "outside": {"custom": declarations.numeric("field", GRID), "qpos": "7 0"},
    "outside, iron": {
        "custom": declarations.field(GRID) + IRON("geom sled"),
        "moment": "",
        "qpos": "7.1 0",
    },
    "a force that is not finite": {
        "custom": declarations.numeric("field", "1e300 " * 8),
        "moment": "1e10",
    },
    "behind": {"custom": IRON("geom floor"), "qpos": "0 -0.7"},
    "behind, iron": {"custom": IRON("geom sled", "geom floor"), "moment": "", "qpos": "0 -0.7"},
    "merged": {"custom": IRON("geom bar"), "site": "0 0 0.3"},
    "unsolved": {"custom": IRON("geom sled", "geom bar"), "moment": "", "qpos": "-0.999 0.3"},
    "unmeasured": {
        "qpos": "-0.5 0",
        "extension": METER.format(""),
        "sensor": METER.format(' name="meter" objtype="site" objname="probe"'),
    },
    "time": {"act": "noise", "time": "1e300", "wrench": "1 0 0 0 0 0"},
}
NAMES = (
    "it's", 'say "it"', "it's \"it\"", "%s%n%%", "back\\slash", "tab\tand\nline", "é\xa0\xad", "漢",
    60 * "e", 61 * "e", 59 * "漢" + "'''", 61 * "%",
)  # fmt: skip


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    """The C program."""
    path, library = tmp_path_factory.mktemp("c") / "c_host", Path(mujoco_library()._name)
    source = Path(__file__).with_name("c_host.c")
    options = "-O1", "-Wall", "-Wextra", "-Werror", f"-I{library.parent / 'include'}"
    libraries = str(library), f"-Wl,-rpath,{library.parent}", "-lpthread", "-ldl"
    subprocess.run([CC, *options, source, *libraries, "-o", path], check=True)
    return path


@pytest.fixture
def run(program, tmp_path):
    """Let the C program do a task with models."""

    def run(task, count, models, **environment):
        level = LIBRARY.description["level"]
        library = native_library.FOLDER / f"libmagmotor-{level}.so"
        outside = {name: value for name, value in os.environ.items() if name != SWITCH}
        return subprocess.run(
            [program, library, task, str(count), *models], env=outside | environment, cwd=tmp_path,
            capture_output=True, text=True, check=True,
        )  # fmt: skip

    return run


def written(folder, texts):
    paths = [folder / f"{k}.xml" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return paths


def state_after(model, steps):
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, nstep=steps)
    return [*data.qpos, *data.qvel, *data.sensordata]


def numbers(line):
    return [float.fromhex(word) for word in line.split()]


def error_of(path):
    """The first error that Python raises for a model."""
    try:
        state_after(mujoco.MjModel.from_xml_path(str(path)), 1)
    except (ValueError, mujoco.FatalError) as error:
        return str(error)
    return "no error"


def test_the_bits_are_those_of_python(run, tmp_path):
    steps, paths = 3000, [ROOT / "models" / f"{name}.xml" for name in MODELS]
    paths += written(tmp_path, [NEEDLE])
    done = run("steps", steps, paths)
    found = [numbers(line) for line in done.stdout.splitlines()]
    expected = [state_after(mujoco.MjModel.from_xml_path(str(path)), steps) for path in paths]
    assert found == expected
    assert done.stderr == ""


def test_the_callback_has_them_too(run, tmp_path):
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    before, _, rest = NEEDLE.partition("<extension>")
    (path,) = written(tmp_path, [before + mark + rest.partition("</extension>")[2]])
    model = mujoco.MjModel.from_xml_path(str(path))
    with mm.magnetism():
        expected = state_after(model, 1000)
    assert numbers(run("callback", 1000, [path]).stdout) == expected != state_after(model, 1000)


def test_threads_have_the_same_bits(run):
    lines = run("threads", 500, [TOP]).stdout.splitlines()
    assert len(lines) == 4
    model = mujoco.MjModel.from_xml_path(str(TOP))
    assert {*map(tuple, map(numbers, lines))} == {tuple(state_after(model, 500))}


def _with_plugin(model, *custom, plugin=True, **given):
    model(*custom, plugin=True, **given)


def misdeclared_models(monkeypatch):
    """The models of the table of declarations, all with the plugin."""
    texts, names = [], dict(vars(declarations))
    names["model"] = partial(_with_plugin, declarations.model)
    kept = SimpleNamespace(MjModel=SimpleNamespace(from_xml_string=texts.append))
    monkeypatch.setattr(declarations, "mujoco", kept)
    names["mm"] = SimpleNamespace(describe=lambda _: None)
    for example in doctest.DocTestParser().get_examples(declarations.TABLE):
        if not any(each in example.source for each in ("changed", "sized", "found", "first")):
            exec(example.source, names)
    return texts


def test_errors_in_models_have_the_same_words(run, tmp_path, monkeypatch):
    texts = misdeclared_models(monkeypatch)
    texts += [named(name) for name in NAMES]
    texts.append(named("é").encode("latin-1"))
    paths = written(tmp_path, texts)
    expected = [error_of(path) for path in paths]
    assert len({*expected}) > 40
    assert run("errors", 1, paths).stdout.split(END)[:-1] == expected


def named(name):
    """A model whose invalid moment is that of a site with this name."""
    text = '<text name="magmotor" data="all"/>'
    numbers = dict.fromkeys(("wrenches", "potential", "of_flight", "custom", "actuator"), "")
    for character in "&\"'\t\n":
        name = name.replace(character, f"&#{ord(character)};")
    model = declarations.MODEL.replace('name="hand"', f'name="{name}"')
    extension = declarations.PLUGIN.format("")
    return model.format(extension=extension, text=text, moment="inf", **numbers)


def slider(**changed):
    names = dict.fromkeys(("extension", "custom", "wrench", "sensor"), "")
    given = (
        names
        | {"act": "all", "name": "moving", "moment": "1e-3", "qpos": "0 0", "time": "0"}
        | changed
    )
    site = given.pop("site", None)
    text = SLIDER.format(**given)
    return text.replace('name="still"', f'name="still" pos="{site}"') if site else text


def test_errors_in_steps_have_the_same_words(run, tmp_path):
    paths = written(tmp_path, [slider(**changed) for changed in WRONG_STATES.values()])
    expected = [error_of(path) for path in paths]
    assert "no error" not in expected
    assert len({*expected}) == len(expected)
    assert run("errors", 1, paths).stdout.split(END)[:-1] == expected


def test_an_error_that_nobody_handles_is_a_warning(run, tmp_path):
    (path,) = written(tmp_path, [slider(name="m%", qpos="-1 0")])
    lines = run("unhandled", 1, [path]).stdout.splitlines()
    assert lines[0] == f"{error_of(path)}; the state is set to NaN"
    assert lines[-1].split() == 2 * ["nan"] + 2 * ["0x0p+0"]


def test_notices_have_the_same_words(run, tmp_path, monkeypatch, capfd):
    sled, dipoles = slider(act="dipoles"), '<config key="act" value="dipoles"/>'
    flags = "<option><flag {}/></option><option"
    bare = sled.replace(dipoles, "")
    still = sled[: sled.index("<body")] + sled[sled.index("</body>") + 7 :].replace('"0 0"', '""')
    texts = [
        bare,
        bare.replace('user="1e-3"', 'user="1 2"', 1),
        bare.replace("<custom>", '<custom><text name="a_magmotor_b" data="dipoles"/>'),
        sled.replace(' user="1e-3"', ""),
        sled.replace(dipoles, dipoles.replace("dipoles", "iron")),
        slider(act="noise", custom=declarations.numeric("field", "0 0 1") + IRON("geom bar")),
        slider(act="iron", custom=IRON("geom bar", material="0")).replace(' user="1e-3"', ""),
        still,
        still.replace("<site", "<site/><site"),
        sled.replace("<option", flags.format('spring="disable" damper="disable"')),
        sled.replace("<option", flags.format('sleep="enable"')),
    ]
    paths = written(tmp_path, texts)
    sentences = set()
    for path in paths:  # each once per process
        monkeypatch.setattr(error_raising, "_printed", set())
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            mujoco.MjData(mujoco.MjModel.from_xml_path(str(path)))
        said, warned = capfd.readouterr().err, "".join({str(each.message) for each in caught})
        done = run("unhandled", 0, [path])
        assert "\n".join(done.stdout.split("\n")[:-2]) == warned  # before the state
        assert "".join(done.stderr.splitlines(True)[: said.count("\n")]) == said
        sentences |= {warned, said}
    assert len(sentences) > 10


def test_memory_does_not_grow(run):
    (grown,) = run("leaks", 1000, [TOP]).stdout.split()
    assert int(grown) < 1000


def test_an_unknown_version_is_refused(run, tmp_path):
    stub = tmp_path / "stub.so"
    (source := tmp_path / "stub.c").write_text("int mj_version(void) { return 5001002; }")
    subprocess.run([CC, "-shared", "-fPIC", source, "-o", stub], check=True)
    done = run("steps", 1, [TOP], LD_PRELOAD=str(stub))
    known = ", ".join(layouts.known())
    sentence = f"nothing is registered: MuJoCo 5.1.2 is unknown; known are {known}"
    assert done.stderr == f"magmotor: {sentence}\n"
    assert "magmotor.forces" in done.stdout  # an unknown plugin


def test_the_variable_that_turns_the_library_off_does_so(run):
    done = run("steps", 1, [TOP], MAGMOTOR_LIBRARY="0")
    assert "magmotor.forces" in done.stdout
    assert done.stderr == ""


def test_the_layout_of_the_running_version_is_known():
    assert layouts.known()[mujoco.mj_versionString()] == layouts.running()
    content = json.loads(layouts.PATH.read_text(encoding="utf-8"))
    assert content["fields"] == [*layout.Layout._fields]
