"""Models composed with `MjSpec`: the same as by MJCF, also after `attach` and as XML."""

import doctest
from functools import cache
from typing import Any

import mujoco
import numpy as np
import pytest
from messages import mjspec
from refusals import refused

import magmotor as mm

GAUGE = mm.magnet("cylinder", (0.01, 0.004), grade="N42", direction=(0, 3, 4))
RING = mm.magnet("ring", (0.004, 0.01, 0.005), remanence=1.2)
ACCURACY: dict[str, Any] = {"error": 0.05, "gap": 0.02}

PLUGIN = """<extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin>
</extension>"""
KEY = PLUGIN.replace("/>", '><config key="act" value="{}"/></instance>', 1)
WHOLE = """<custom>
  <text name="magmotor" data="dipoles coils fields iron"/>
  <numeric name="field" data="0 0.002 0.01  0.1 0 0.2 0 0"/>
  <numeric name="field_of_hand" data="0 0 0.003"/>
  <numeric name="iron" data="1000 1.7e6"/>
  <numeric name="iron_of_table" data="500"/>
  <tuple name="coil of the hand">
    <element objtype="actuator" objname="current" prm="1.5"/>
    <element objtype="site" objname="tip"/>
  </tuple>
  <tuple name="field_of_hand">
    <element objtype="numeric" objname="field_of_hand"/>
    <element objtype="body" objname="hand"/>
    <element objtype="actuator" objname="current" prm="2"/>
  </tuple>
  <tuple name="iron">
    <element objtype="numeric" objname="iron"/>
    <element objtype="geom" objname="pellet"/>
  </tuple>
  <tuple name="iron_of_table">
    <element objtype="numeric" objname="iron_of_table"/>
    <element objtype="geom" objname="table"/>
  </tuple>
</custom>"""
EARTH = '<site pos="0 0 -9" user="1e6"/>'
TIP = '<site name="tip" pos="0 0 -0.02" zaxis="0 0 -1" user="2"/>'
ANCHOR = '<site name="anchor" pos="0 0.1 0" zaxis="0 1 0" user="5"/>'
MODEL = """<mujoco>
  {plugin}
  <option gravity="0 0 0" timestep="1e-4"/>
  {custom}
  <worldbody>
    <site name="mount"/>
    <geom name="table" type="plane" size="1 1 1" pos="0 0 -0.2"/>
    {anchor}
    <body name="hand" pos="0 0 0.1"><freejoint/><geom size="0.01"/>{tip}</body>
    <body name="disk" pos="0.1 0 0"><freejoint/>{disk}</body>
    <body name="pellet" pos="0 -0.1 0"><freejoint/><geom name="pellet" size="0.005"/></body>
  </worldbody>
  <actuator><general name="current" site="mount" gainprm="0"/></actuator>
</mujoco>"""
EMPTY = '<mujoco><option gravity="0 0 0" timestep="1e-4"/></mujoco>'
BARE = MODEL.format(
    plugin="", custom="", anchor="", tip="", disk='<geom name="core" size="0.001"/>'
)


def by_hand(plugin=PLUGIN, custom=WHOLE, disk='<geom name="core" size="0.001"/>'):
    disk += GAUGE.mjcf(**ACCURACY, name="disk")
    return MODEL.format(plugin=plugin, custom=custom, anchor=ANCHOR, tip=TIP, disk=disk)


def composed():
    spec = mujoco.MjSpec.from_string(BARE)
    hand, current = spec.body("hand"), spec.actuator("current")
    mm.add_dipole(spec, spec.worldbody, 5, pos=[0, 0.1, 0], zaxis=[0, 1, 0], name="anchor")
    tip = mm.add_dipole(spec, hand, 2, pos=[0, 0, -0.02], zaxis=[0, 0, -1], name="tip")
    mm.add_magnet(spec, spec.body("disk"), GAUGE, **ACCURACY, name="disk")
    mm.add_coil(spec, current, [tip], saturation=1.5, name="coil of the hand")
    mm.add_field(spec, [0, 0.002, 0.01, 0.1, 0, 0.2, 0, 0])
    mm.add_field(
        spec, (0, 0, 0.003), frame=hand, actuator=current, saturation=2, name="field_of_hand"
    )
    mm.add_iron(spec, [spec.geom("pellet")], 1000, 1.7e6)
    mm.add_iron(spec, [spec.geom("table")], 500, name="iron_of_table")
    return spec


def accelerations(model):
    """The accelerations in a state with a current."""
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.7
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


@cache
def wanted():
    return accelerations(mujoco.MjModel.from_xml_string(by_hand()))


def are_the_same(one, other):
    """Whether all arrays, names and texts of two models are equal to the bit."""
    arrays = [name for name in dir(one) if isinstance(getattr(one, name), np.ndarray)]
    assert len(arrays) > 300
    different = [
        name
        for name in arrays
        if not np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
    ]
    return not different and one.names == other.names and one.text_data == other.text_data


# The same as by MJCF ------------------------------------------------------------------------------


def test_the_model_is_the_one_written_by_hand():
    spec = composed()
    assert are_the_same(spec.compile(), mujoco.MjModel.from_xml_string(by_hand()))


def test_each_declaration_acts():
    """What the forces are without it differs by far more than by rounding."""
    for missing in ("dipoles", "coils", "fields", "iron"):
        words = " ".join(w for w in ("dipoles", "coils", "fields", "iron") if w != missing)
        spec = composed()
        spec.text("magmotor").data = words
        without = accelerations(spec.compile())
        assert abs(without - wanted()).max() > 1e-5 * abs(wanted()).max()  # 2e-4


def test_steps_are_the_same():
    ends = []
    for model in (composed().compile(), mujoco.MjModel.from_xml_string(by_hand())):
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.7
        mujoco.mj_step(model, data, nstep=100)
        ends.append(data.qpos.copy())
    assert np.array_equal(*ends)


@pytest.mark.parametrize("tell", [mm.describe, mm.check])
def test_describe_and_check_say_the_same(tell, capsys):
    said = []
    for model in (composed().compile(), mujoco.MjModel.from_xml_string(by_hand())):
        print(tell(model))
        said.append(capsys.readouterr().out)
    assert said[0] == said[1]
    assert tell is mm.check or "acting: dipoles, fields, coils and iron, by the plugin" in said[0]


@pytest.mark.parametrize("magnet", [GAUGE, RING])
@pytest.mark.parametrize("name", ["", "a magnet"])
@pytest.mark.parametrize("units", [(1, 1, 1), (1e-3, 1e-3, 1e-6)])
def test_a_magnet_is_its_mjcf(magnet, name, units):
    custom = '<custom><text name="magmotor" data="dipoles"/></custom>'
    text = magnet.mjcf(**ACCURACY, name=name, units=units)
    body = f'<body><freejoint/><frame pos="0 0 1" euler="30 0 0">{text}</frame></body>'
    expected = mujoco.MjModel.from_xml_string(
        f"<mujoco>{PLUGIN}{custom}<worldbody>{EARTH}{body}</worldbody></mujoco>"
    )
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{EARTH}</worldbody></mujoco>")
    body = spec.worldbody.add_body()
    body.add_freejoint()
    frame = body.add_frame(pos=[0, 0, 1], euler=[30, 0, 0])
    geoms, sites = mm.add_magnet(spec, frame, magnet, **ACCURACY, name=name, units=units)
    assert are_the_same(spec.compile(), expected)
    assert len(geoms) == expected.ngeom
    assert [site.name for site in sites] == [expected.site(k + 1).name for k in range(len(sites))]


def test_a_table_is_a_field():
    """Longer than what MuJoCo 3 reads from XML."""
    points = [[0.013, 0.02, -0.01], [0.0, 0.0, -0.03]]
    text = mm.tabulated_field(
        lambda at: np.stack([at[:, 1], at[:, 0], 0.3 + 0 * at[:, 2]], axis=-1),
        [-0.1] * 3, [0.1] * 3, (6, 6, 6), name="field_of_magnet",
    )  # fmt: skip
    spec = mujoco.MjSpec.from_string(BARE)
    mm.add_dipole(spec, spec.body("hand"), 0.1, pos=[0, 0, -0.05])
    field = mm.add_field(spec, text)
    assert field.name == "field_of_magnet"
    model = spec.compile()
    assert model.numeric("field_of_magnet").data.size == 9 + 3 * 6**3
    dipole = mm.dipoles.field(points, [[0, 0, 0.05]], [[0, 0, 0.1]])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = mm.field(model, data, points) - dipole
    assert abs(found - [[0.02, 0.013, 0.3], [0, 0, 0.3]]).max() < 1e-15  # 6e-17
    assert mm.add_field(spec, [*field.data], name="field_again").size == 9 + 3 * 6**3


# The plugin and the mark --------------------------------------------------------------------------


def test_the_plugin_and_the_mark_are_there_once():
    spec = composed()
    for _ in range(2):
        mm.add_magnetism(spec)
    assert [(each.name, each.plugin_name) for each in spec.plugins] == [
        ("magnets", "magmotor.forces")
    ]
    assert [(each.name, each.data) for each in spec.texts] == [
        ("magmotor", "dipoles coils fields iron")
    ]
    assert spec.to_xml().count('plugin="magmotor.forces"') == 1


@pytest.mark.parametrize(("words", "after"), [("noise", "noise fields"), ("all", "all")])
@pytest.mark.parametrize("key", [False, True])
def test_words_of_a_mark_remain(words, after, key):
    """The plugin's key and the mark would have to have the same words."""
    mark = f'<custom><text name="magmotor" data="{words}"/></custom>'
    spec = mujoco.MjSpec.from_string(f"<mujoco>{KEY.format(words) if key else mark}</mujoco>")
    mm.add_field(spec, [0, 0, 1])
    mm.add_field(spec, [0, 0, 1], name="field_2")
    assert spec.text("magmotor").data == after
    assert [dict(each.config) for each in spec.plugins] == [{}]


def test_dipoles_without_a_mark_still_act():
    spec = mujoco.MjSpec.from_string(by_hand(plugin="", custom=""))
    mm.add_iron(spec, [spec.geom("pellet")], 1000)
    assert spec.text("magmotor").data == "dipoles iron"
    spec = mujoco.MjSpec.from_string(BARE)
    mm.add_iron(spec, [spec.geom("pellet")], 1000)
    assert spec.text("magmotor").data == "iron"
    spec = mujoco.MjSpec()
    mm.add_magnetism(spec)
    assert spec.text("magmotor").data == "dipoles"


@pytest.mark.parametrize(("before", "after"), [(-1, -1), (0, 1), (1, 1), (3, 3)])
def test_sizes_of_user_numbers_grow_as_needed(before, after):
    spec = mujoco.MjSpec.from_string(BARE)
    spec.nuser_site = before
    mm.add_dipole(spec, spec.worldbody, 1)
    mm.add_dipole(spec, spec.body("hand"), 1)
    assert spec.nuser_site == after
    assert spec.compile().nuser_site == max(after, 1)


# Attached specs -----------------------------------------------------------------------------------


def test_what_attach_loses():
    """Else `add_magnetism` would not be needed."""
    spec, parent = composed(), mujoco.MjSpec.from_string(EMPTY)
    parent.attach(spec, prefix="a/", suffix="_b", frame=parent.worldbody.add_frame())
    assert [*parent.plugins] == []
    assert [text.name for text in parent.texts] == ["a/magmotor_b"]
    assert [each.name for each in parent.numerics][:2] == ["a/field_b", "a/field_of_hand_b"]
    assert [each.name for each in parent.tuples][:2] == [
        "a/coil of the hand_b",
        "a/field_of_hand_b",
    ]
    assert [*parent.tuples[1].objname] == ["a/field_of_hand_b", "a/hand_b", "a/current_b"]
    assert [*parent.site("a/tip_b").userdata] == [2]
    assert not accelerations(parent.compile()).any()


def through_a_frame(spec, parent):
    parent.attach(spec, prefix="a/", frame=parent.worldbody.add_frame())


def through_a_site(spec, parent):
    parent.attach(spec, prefix="a/", suffix="_b", site=parent.worldbody.add_site(name="flange"))


def twice(spec, parent):
    between = mujoco.MjSpec.from_string(EMPTY)
    through_a_frame(spec, between)
    parent.attach(between, prefix="b_", frame=parent.worldbody.add_frame())


def twice_and_repaired(spec, parent):
    between = mujoco.MjSpec.from_string(EMPTY)
    through_a_frame(spec, between)
    mm.add_magnetism(between)
    parent.attach(between, prefix="b_", frame=parent.worldbody.add_frame())


WAYS = (through_a_frame, through_a_site, twice, twice_and_repaired)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("key", [False, True], ids=["composed", "key act"])
@pytest.mark.parametrize("late", ["add_magnetism", "add_dipole"])
def test_attached_specs_act(way, key, late, capsys):
    """Also one from a file whose plugin says what acts, if it gets a mark before."""
    parent = mujoco.MjSpec.from_string(EMPTY)
    spec = composed()
    if key:
        mark = WHOLE.replace('<text name="magmotor" data="dipoles coils fields iron"/>', "")
        text = by_hand(KEY.format("dipoles coils fields iron"), mark)
        spec = mujoco.MjSpec.from_string(text)
        mm.add_magnetism(spec)
    way(spec, parent)
    if late == "add_dipole":
        mm.add_dipole(parent, parent.worldbody, 0, pos=[1, 1, 1])
    else:
        mm.add_magnetism(parent)
    model = parent.compile()
    assert np.array_equal(accelerations(model), wanted())
    assert [each.name for each in parent.texts] == ["magmotor"]
    found = mm.describe(model)
    assert found.acting == ("dipoles", "fields", "coils", "iron")
    assert found.idle == ()
    before = parent.to_xml()
    mm.add_magnetism(parent)
    assert parent.compile().nnumeric == model.nnumeric
    assert parent.to_xml() == before


def test_two_hands_on_one_arm():
    arm = mujoco.MjSpec.from_string(EMPTY)
    for side in ("left/", "right/"):
        hand = mujoco.MjSpec.from_string(BARE)
        tip = mm.add_dipole(hand, hand.body("hand"), 2, name="tip")
        mm.add_coil(hand, hand.actuator("current"), [tip])
        arm.attach(hand, prefix=side, frame=arm.worldbody.add_frame(pos=[len(side), 0, 0]))
    mm.add_field(arm, [0, 0.1, 0])
    assert arm.text("magmotor").data == "dipoles coils fields"
    model = arm.compile()
    assert [model.tuple(k).name for k in range(2)] == ["coil_left/coil", "coil_right/coil"]
    data = mujoco.MjData(model)
    torques = []
    for side in ("left/", "right/"):
        data.ctrl[:] = 0
        data.actuator(f"{side}current").ctrl[:] = 0.5
        mujoco.mj_forward(model, data)
        torques.append(
            [
                data.joint(model.body(f"{s}hand").jntadr[0]).qfrc_passive[3]
                for s in ("left/", "right/")
            ]
        )
    expected = -0.5 * 2 * 0.1
    assert np.array(torques) == pytest.approx(np.diag([expected] * 2), rel=0, abs=1e-16)  # 0


def test_only_what_the_mark_of_the_attached_spec_names_gets_its_name_back():
    spec = mujoco.MjSpec.from_string(by_hand())
    spec.text("magmotor").data = "dipoles iron"
    spec.add_numeric(name="fieldwork", data=[1], size=1)
    spec.add_text(name="notes on magmotor", data="see the manual")
    parent = mujoco.MjSpec()
    parent.add_numeric(name="a/field_of_parent", data=[1], size=1)
    through_a_frame(spec, parent)
    mm.add_magnetism(parent)
    assert parent.numeric("a/fieldwork") is not None
    assert parent.numeric("a/field") is not None
    assert parent.tuple("a/coil of the hand") is not None
    assert parent.tuple("iron_a/iron") is not None
    assert parent.text("a/notes on magmotor").data == "see the manual"


def test_names_that_only_look_alike_remain():
    spec, parent = composed(), mujoco.MjSpec.from_string(EMPTY)
    body = spec.worldbody.add_body(name="field", pos=[0, 0, 1])
    mm.add_dipole(spec, body, 1)
    mm.add_coil(spec, spec.actuator("current"), [body], name="coil of a body")
    spec.text("magmotor").data = "all"
    remaining = ["magmotor/field", "my_magmotor/field_b", "magmotor/iron_b"]
    for name in remaining[:2]:
        parent.add_numeric(name=name, data=[1], size=1)
    frame = parent.worldbody.add_frame()
    parent.attach(spec, prefix="magmotor/", suffix="_b", frame=frame)
    mm.add_magnetism(parent)
    assert [(text.name, text.data) for text in parent.texts] == [("magmotor", "all")]
    assert all(parent.numeric(name) is not None for name in remaining)
    assert parent.numeric("field_magmotor/field_b") is not None
    coil = parent.tuple("coil_magmotor/coil of a body_b")
    assert [*coil.objname] == ["magmotor/current_b", "magmotor/field_b"]
    parent.compile()


def test_without_a_prefix_names_remain():
    spec, parent = composed(), mujoco.MjSpec.from_string(EMPTY)
    parent.attach(spec, prefix="", suffix="_b", frame=parent.worldbody.add_frame())
    mm.add_magnetism(parent)
    assert [text.name for text in parent.texts] == ["magmotor"]
    assert [each.name for each in parent.numerics][:2] == ["field_b", "field_of_hand_b"]
    assert [each.name for each in parent.tuples][:2] == ["coil of the hand_b", "field_of_hand_b"]


def test_noise_and_potentials_of_an_attached_spec():
    spec = mujoco.MjSpec.from_string("""<mujoco><worldbody><body user="0 0 0 0 0 1e-3">
      <joint name="axis" axis="0 0 1" user="0 0.2" damping="1"/><geom size="0.1"/><site user="1 0"/>
    </body></worldbody><custom><text name="magmotor" data="noise potentials"/></custom></mujoco>""")
    parent = mujoco.MjSpec.from_string(
        '<mujoco><size nuser_body="0" nuser_jnt="0" nuser_site="9"/></mujoco>'
    )
    through_a_frame(spec, parent)
    mm.add_magnetism(parent)
    assert (parent.nuser_body, parent.nuser_jnt, parent.nuser_site) == (6, 2, 9)
    found = mm.describe(parent.compile())
    assert found.acting == ("noise", "potentials")


@pytest.mark.parametrize("name", ["magnetic_constant", "magnetic_tolerance"])
def test_numbers_of_whole_models_must_agree(name):
    def attached(own):
        spec, parent = composed(), mujoco.MjSpec()
        spec.add_numeric(name=name, data=[1e-3], size=1)
        if own:
            parent.add_numeric(name=name, data=[own], size=1)
        through_a_frame(spec, parent)
        mm.add_magnetism(parent)
        return parent

    spec = attached(1e-3)
    assert [*spec.numeric(name).data] == [1e-3]
    assert spec.numeric(f"a/{name}") is None
    for own, shown in ((0, "missing"), (2e-3, "[0.002]")):
        with refused(f"numeric 'a/{name}'") as caught:
            attached(own)
        assert str(caught.value).endswith(f" is {shown}")


# As XML -------------------------------------------------------------------------------------------


def test_the_xml_has_the_same_forces():
    """To the six digits that MuJoCo writes."""
    spec, parent = composed(), mujoco.MjSpec.from_string(EMPTY)
    through_a_frame(spec.copy(), parent)
    mm.add_magnetism(parent)
    for each in (spec, parent):
        each.compile()
        found = accelerations(mujoco.MjModel.from_xml_string(each.to_xml()))
        assert abs(found - wanted()).max() < 3e-6 * abs(wanted()).max()  # 1e-6


def test_short_numbers_survive_xml_to_the_bit():
    spec = mujoco.MjSpec.from_string(BARE)
    mm.add_dipole(spec, spec.body("hand"), 2.5, pos=[0.01, 0.02, 0.03])
    mm.add_dipole(spec, spec.body("disk"), -1.25)
    mm.add_field(spec, [0, 0.5, 0, 1, 2, 3, 4, 5])
    model = spec.compile()
    assert are_the_same(mujoco.MjModel.from_xml_string(spec.to_xml()), model)


# Bad input ----------------------------------------------------------------------------------------


def add(spec, function):
    """Call a function with good arguments."""
    good = {
        "add_dipole": {"body": spec.worldbody, "moment": 1},
        "add_magnet": {"body": spec.worldbody, "magnet": GAUGE, **ACCURACY},
        "add_coil": {
            "actuator": spec.actuator("current"), "dipoles": [spec.site("tip")], "name": "coil 2"
        },
        "add_field": {"field": [0, 0, 1], "name": "field_2"},
        "add_iron": {
            "geoms": [spec.geom("core")], "susceptibility": 1000, "name": "iron_2"
        },
    }  # fmt: skip
    return getattr(mm, function)(spec, **good[function])


@pytest.mark.parametrize("name", ["add_dipole", "add_magnet", "add_coil", "add_field", "add_iron"])
def test_good_arguments(name):
    spec = composed()
    before = elements(spec)
    add(spec, name)
    assert elements(spec) != before


def test_what_is_refused_adds_nothing():
    """Of all statements in the messages' table."""
    names, count, before = dict(vars(mjspec)), 0, []
    for example in doctest.DocTestParser().get_examples(mjspec.TABLE):
        if "spec" in names:
            before = elements(names["spec"])
        if "Error: " not in example.want:
            exec(example.source, names)
        elif not example.want.startswith("ValueError"):
            with pytest.raises(mm.InputError):
                exec(example.source, names)
            assert elements(names["spec"]) == before, example.source
            count += 1
    assert count > 30  # 40


def elements(spec):
    """The numbers of elements in a spec."""
    kinds = ("site", "geom", "tuple", "numeric", "text", "plugin")
    return [len(getattr(spec, f"{kind}s")) for kind in kinds]
