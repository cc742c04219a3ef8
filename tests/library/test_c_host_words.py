"""Programs without Python: errors and notices have the words that they have in Python."""

import doctest
import warnings
from functools import partial
from types import SimpleNamespace

import mujoco
import pytest
from c_host import END, LEVITATION, NEEDED, error_of, run, written
from messages import declarations

from magmotor.mjcf import error_raising

pytestmark = NEEDED
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
        if not any(
            each in example.source
            for each in ("changed", "sized", "magnetized", "found", "first", "negative")
        ):
            exec(example.source, names)
    return texts


def test_errors_in_models_have_the_same_words(tmp_path, monkeypatch):
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
    numbers = dict.fromkeys(
        ("wrenches", "potential", "of_flight", "of_geom", "custom", "actuator"), ""
    )
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


def test_errors_in_steps_have_the_same_words(tmp_path):
    paths = written(tmp_path, [slider(**changed) for changed in WRONG_STATES.values()])
    expected = [error_of(path) for path in paths]
    assert "no error" not in expected
    assert len({*expected}) == len(expected)
    assert run("errors", 1, paths).stdout.split(END)[:-1] == expected


def test_indices_that_lead_nowhere_have_the_same_words():
    model, expected = mujoco.MjModel.from_xml_path(str(LEVITATION)), []
    for field, place, value in (("name_textadr", 0, -5), ("tuple_size", 0, 1 << 20)):
        before = getattr(model, field)[place]
        getattr(model, field)[place] = value
        with pytest.raises(mujoco.FatalError) as caught:
            mujoco.mj_step(model, mujoco.MjData(model))
        expected.append(str(caught.value))
        getattr(model, field)[place] = before
    found = run("indices", 0, [LEVITATION]).stdout.split(END)
    assert found == [*expected, "names of the model: must end with a zero", ""]


FAILED = 2 * ["nan"] + 2 * ["0x0p+0"]


def test_an_error_that_nobody_handles_is_a_warning(tmp_path):
    (path,) = written(tmp_path, [slider(name="m%", qpos="-1 0")])
    lines = run("unhandled", 1, [path]).stdout.splitlines()
    assert lines[0] == f"{error_of(path)}; the state is set to NaN"
    assert lines[-1].split() == FAILED


def test_a_handler_of_logs_receives_errors(tmp_path):
    (path,) = written(tmp_path, [slider(name="m%", qpos="-1 0")])
    assert run("logged", 1, [path]).stdout == error_of(path) + END
    error, state = run("returned", 1, [path]).stdout.splitlines()
    assert error == error_of(path)
    assert state.split() == FAILED


def test_notices_have_the_same_words(tmp_path, monkeypatch, capfd):
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


def test_each_model_has_its_notices(tmp_path):
    """The second one has a notice of the same kind, with other words."""
    bare = slider(act="dipoles").replace('<config key="act" value="dipoles"/>', "")
    given = bare.replace("<custom>", '<custom><text name="{}" data="dipoles"/>')
    first, second = written(tmp_path, [given.format("a_magmotor"), given.format("b_magmotor")])
    found = run("unhandled", 0, [first, second, first]).stdout
    assert "'b_magmotor'" in found
    assert found.count("'a_magmotor'") == 1  # a sentence is given once
