"""`describe` names what acts on a model, its temperature, and what does not act."""

import re
import sys
import warnings

import mujoco
import numpy as np
import pytest
from refusals import misdeclared

import magmotor as mm
from magmotor.mjcf.lookup import number_of

MARK = '<custom><text name="magmotor" data="{}"/></custom>'
PLUGIN = '<extension><plugin plugin="magmotor.forces"><instance name="{}"/></plugin></extension>'
PAIR = """
<mujoco>
  {head}
  <worldbody>
    <body name="left" pos="-0.1 0 0"><freejoint/><geom size="0.01"/><site user="1"/></body>
    <body name="right" pos="0.1 0 0">
      <joint name="turn" type="hinge" damping="0.5"/>
      <geom size="0.01"/>
      <site user="2"/>
      <site pos="0 0 0.01" user="-2"/>
    </body>
  </worldbody>
</mujoco>
"""
COUPLING = """<custom><tuple name="coupling"><element objtype="body" objname="left" prm="{0}"/>
<element objtype="body" objname="right" prm="{0}"/></tuple></custom>"""


def described(text):
    """The description of a model, and its text."""
    found = mm.describe(mujoco.MjModel.from_xml_string(text))
    return found, str(found)


def test_dipoles_and_pairs():
    found, text = described(PAIR.format(head=MARK.format("dipoles")))
    assert found.acting == ("dipoles",)
    assert found.marked
    assert not found.plugin
    assert found.dipoles == {"left": 1, "right": 2}
    assert found.pairs == {("left", "right"): 1.0}
    assert found.idle == ()
    assert text.splitlines()[:3] == [
        "acting: dipoles, inside magmotor.magnetism()",
        "dipoles: 1 on left, 2 on right",
        "pairs: left and right",
    ]


GRIPPER = """<mujoco>{head}<worldbody><body name="hand"><geom size=".01"/><site user=".5"/></body>
</worldbody></mujoco>"""
LONG_ARM = """<mujoco>{head}<option gravity="0 0 0"/><worldbody>
<body name="arm"><geom size=".02" pos="0 0 -.1"/><site name="flange"/></body>
<body name="part" pos="0 0 .05"><freejoint/><geom size=".01"/><site user=".5"/></body>
</worldbody></mujoco>"""
ACT = '<config key="act" value="dipoles"/>'
ALONE = PLUGIN.format("magnets").replace('"magnets"/>', f'"magnets">{ACT}</instance>')


def attached(arm="", gripper=ALONE):
    """An arm to which a gripper is attached, with these elements at the tops of both."""
    spec = mujoco.MjSpec.from_string(LONG_ARM.format(head=arm))
    other = mujoco.MjSpec.from_string(GRIPPER.format(head=gripper))
    spec.attach(other, site=spec.site("flange"), prefix="g_")
    return spec


def pulled(model):
    """The force on the part in N, by MuJoCo alone."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model.body("part").mass[0] * data.joint(0).qacc[2]


@pytest.mark.parametrize(
    ("tell", "marked"), [(mm.describe, False), (mm.describe, True), (mm.check, False)]
)
def test_a_plugin_that_attach_drops_comes_back_by_the_lines_that_are_printed(tell, marked, capsys):
    mark = MARK.format("dipoles") * marked
    spec = attached(arm=mark)
    force = -6e-7 * 0.5**2 / 0.05**4
    model = spec.compile()
    assert pulled(model) == 0
    print(tell(model))
    line = capsys.readouterr().out.splitlines()[-1]
    assert "not acting: dipoles outside of magmotor.magnetism()" in line
    assert ("attach drops it" in line) != marked  # the mark alone is meant for magnetism()
    [extension] = re.findall("<extension>.*</extension>", line)
    assert pulled(attached(arm=mark + extension).compile()) == pytest.approx(
        force, rel=1e-13, abs=0
    )
    exec(line.partition("in Python ")[2], {"spec": spec, "mm": mm})
    restored = spec.compile()
    assert pulled(restored) == pytest.approx(force, rel=1e-13, abs=0)
    print(tell(restored))
    assert "outside of" not in capsys.readouterr().out


def test_check_notes_a_missing_plugin_beside_a_mark(capsys):
    """Briefly, since a mark may be meant for magnetism(): `describe` prints the lines to add."""
    for head, noted in ((MARK.format("dipoles"), True), (PLUGIN.format("m"), False)):
        found = mm.check(mujoco.MjModel.from_xml_string(PAIR.format(head=head)))
        print(found)
        assert ("dipoles outside of magmotor.magnetism()" in capsys.readouterr().out) == noted
        assert [("describe" in note, "attach" in note) for note in found.notes] == (
            [(True, False)] * noted
        )


@pytest.mark.parametrize(
    ("module", "sentence"),
    [
        ("mujoco.mjx", "dipoles in MJX, which cannot run the forces of magmotor"),
        ("mujoco_warp", "dipoles in MuJoCo Warp, unless magmotor.warp.put_model makes its model"),
    ],
)
def test_engines_that_do_not_run_the_plugin_are_named_if_they_are_loaded(
    module, sentence, monkeypatch
):
    text = PAIR.format(head=PLUGIN.format("m"))
    for loaded in ("mujoco_warp", "magmotor.warp"):
        monkeypatch.delitem(sys.modules, loaded, raising=False)
    assert sentence not in described(text)[1]
    monkeypatch.setitem(sys.modules, module, None)
    assert sentence in described(text)[1]
    monkeypatch.setitem(sys.modules, "magmotor.warp", None)
    assert (sentence in described(text)[1]) == (module == "mujoco.mjx")


@pytest.mark.parametrize("name", ["magmotr", "Magmotor", "mag_motor", "g_magmotor", "topic"])
@pytest.mark.parametrize("plugin", ["", PLUGIN.format("m")])
def test_a_misspelt_mark_is_named(name, plugin, capsys):
    """By `describe`, and by a warning where our code runs; other texts may contain our words."""
    head = MARK.replace('"magmotor"', f'"{name}"').format("dipoles fields") + FIELD.join(
        ("<custom>", "</custom>")
    )
    with warnings.catch_warnings(record=True) as caught, mm.magnetism():
        warnings.simplefilter("always")
        model = mujoco.MjModel.from_xml_string(PAIR.format(head=head + plugin))
        mujoco.mj_step(model, mujoco.MjData(model), nstep=2)
    found = [str(each.message) for each in caught if "only the name magmotor" in str(each.message)]
    assert (len(found) > 0) == (name != "topic")
    assert all(f"text '{name}'" in sentence for sentence in found)
    assert len(found) <= (2 if plugin else 1)
    print(mm.describe(model))
    named = f"not acting: text '{name}', since only the name magmotor"
    assert (named in capsys.readouterr().out) == (name != "topic")


@pytest.mark.parametrize("names", [("magmotr", "topic"), ("topic", "magmotr")])
@pytest.mark.parametrize("plugin", ["", PLUGIN.format("m")])
def test_a_misspelt_mark_is_named_beside_a_text_with_our_words(names, plugin):
    head = "".join(MARK.replace('"magmotor"', f'"{name}"').format("dipoles") for name in names)
    with warnings.catch_warnings(record=True) as caught, mm.magnetism():
        warnings.simplefilter("always")
        model = mujoco.MjModel.from_xml_string(PAIR.format(head=head + plugin))
        mujoco.mj_step(model, mujoco.MjData(model), nstep=3)
    found = [str(each.message) for each in caught if "only the name magmotor" in str(each.message)]
    assert all("text 'magmotr'" in sentence for sentence in found)
    assert len(found) == 1 or (plugin and len(found) == 2)  # in the compiler, and for the data


@pytest.mark.parametrize(("factor", "pairs"), [(3, {("left", "right"): 3.0}), (0, {})])
def test_couplings(factor, pairs):
    head = MARK.format("dipoles couplings") + COUPLING.format(factor)
    found, text = described(PAIR.format(head=head))
    assert found.pairs == pairs
    assert ("times 3" in text) == (factor == 3)
    assert ("switch all pairs off" in text) == (factor == 0)


@pytest.mark.parametrize(
    ("head", "line"),
    [
        ("", "acting: dipoles, inside magmotor.magnetism(); the model has no mark"),
        (COUPLING.format(2), "not acting: tuples named coupling..., since there is no mark"),
        (MARK.format("noise"), "not acting: user numbers of sites, since the mark does not name"),
        (PLUGIN.format("magnets"), "acting: dipoles, by the plugin magmotor.forces"),
        (PLUGIN.format('a"/><instance name="b'), "not acting: further instances of magmotor"),
        ('<option><flag actuation="disable"/></option>', "not acting: magnetism(), since MuJoCo"),
        (
            PLUGIN.format("a") + '<option><flag spring="disable" damper="disable"/></option>',
            "not acting: magmotor.forces, since MuJoCo skips it",
        ),
        (
            PLUGIN.format("a") + '<option><flag sleep="enable"/></option>',
            "not acting: magmotor.forces on sleeping bodies",
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*MuJoCo skips the plugin:UserWarning")
@pytest.mark.filterwarnings("ignore:a sleeping body is not woken:UserWarning")
def test_what_acts_and_what_does_not(head, line):
    _, text = described(PAIR.format(head=head))
    assert line in text


def test_one_dipole_acts_with_a_field_or_iron(capsys):
    model = """<mujoco>
      <custom><text name="magmotor" data="dipoles {word}"/>{declared}</custom>
      <worldbody><body><freejoint/><geom size="1"/><site user="1"/></body>
        <geom name="plate" size="1" pos="3 0 0"/></worldbody></mujoco>"""
    iron = (
        '<numeric name="soft" data="9"/><tuple name="iron"><element objtype="numeric" '
        'objname="soft"/><element objtype="geom" objname="plate"/></tuple>'
    )
    field = '<numeric name="field" data="0 0 1"/>'
    for word, declared in (("fields", field), ("iron", iron)):
        found = mm.describe(
            mujoco.MjModel.from_xml_string(model.format(word=word, declared=declared))
        )
        print(found)
        assert found.idle == ()
    print(mm.describe(mujoco.MjModel.from_xml_string(model.format(word="", declared=""))))
    assert "not acting: the dipoles, since all are on one rigid body" in capsys.readouterr().out


HALL = """
<mujoco>
  <extension>
    <plugin plugin="magmotor.magnetometer"/>
    {plugin}
  </extension>
  <custom><text name="magmotor" data="{mark}"/>{custom}</custom>
  <worldbody><site name="probe"/><body name="cart" pos="0 0 1"><freejoint/><geom size="0.1"/>
    <site user="{moment}"/></body></worldbody>
  <sensor><plugin name="hall" plugin="magmotor.magnetometer" objtype="site" objname="probe"/>
  </sensor>
</mujoco>"""
FIELD = '<numeric name="field" data="0 0 1"/>'
FORCES = '<plugin plugin="magmotor.forces"><instance name="m"/></plugin>'


@pytest.mark.parametrize("plugin", ["", FORCES])
@pytest.mark.parametrize(("mark", "custom", "moment", "warning", "idle"), [
    ("dipoles", "", 1, None, ()),
    ("fields", FIELD, 0, None, ()),
    ("dipoles fields", "", 1, None, ("fields, which the mark names, since the model has none",)),
    ("fields", "", 1, "it declares dipoles, but no mark names them",
     ("user numbers of sites, since the mark does not name dipoles",
      "fields, which the mark names, since the model has none")),
    ("fields", FIELD, 1, "it declares dipoles, but no mark names them",
     ("user numbers of sites, since the mark does not name dipoles",)),
    ("dipoles", FIELD, 0, "it declares fields, but no mark names them", ...),
    ("dipoles", "", 0, "it has no dipole sites", ...),
])  # fmt: skip
def test_what_only_a_magnetometer_feels(mark, custom, moment, warning, idle, plugin, capsys):
    """Nothing acts on the body, but a warning would be wrong if the sensor measures something."""
    text = HALL.format(mark=mark, custom=custom, moment=moment, plugin=plugin)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_step(model, data)
    assert {str(each.message).partition("this model: ")[2][: len(warning or "")]
            for each in caught} == ({warning} if warning else set())  # fmt: skip
    found = mm.describe(model)
    print(found)
    assert found.acting == ()
    assert found.magnetometers == {"hall": "probe"}
    assert "\nmagnetometers: hall at probe\n" in f"{capsys.readouterr().out}\n"
    assert idle in (found.idle, ...)
    seen = ("dipoles" in mark and moment) or ("fields" in mark and custom)
    assert data.sensordata.any() == bool(seen)


def test_a_tuple_of_fields_that_do_not_act_may_name_another_numeric():
    head = MARK.format("dipoles").replace(
        "</custom>",
        '<numeric name="other" data="1"/><tuple name="field">'
        '<element objtype="numeric" objname="other"/></tuple></custom>',
    )
    _, text = described(PAIR.format(head=head))
    assert "acting: dipoles" in text


def test_fields_that_act_on_nothing():
    """Not because the mark names no dipoles: there are none."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><custom><text name="magmotor" data="fields"/>{FIELD}</custom></mujoco>'
    )
    with pytest.warns(UserWarning, match="nothing acts"), mm.magnetism():
        mujoco.mj_step(model, mujoco.MjData(model))


@pytest.mark.parametrize(("actuator", "pushes"), [
    ('<general name="u" site="moving" gainprm="0"/>', False),
    ('<general name="u" site="moving"/>', True),
    ('<motor name="u" site="moving"/>', True),
    ('<motor name="u" site="fixed"/>', False),
    ('<motor name="u" site="fixed" refsite="moving"/>', True),
    ('<position name="u" joint="hinge" kp="0"/>', False),
    ('<position name="u" joint="hinge" kp="2"/>', True),
    ('<damper name="u" joint="hinge" kv="2" ctrlrange="0 1"/>', True),
    ('<general name="u" joint="hinge" gainprm="0" biastype="affine" biasprm="1"/>', True),
    ('<muscle name="u" joint="hinge"/>', True),
])  # fmt: skip
@pytest.mark.parametrize("driven", ["coil", "field"])
def test_actuators_that_also_push_are_named(actuator, pushes, driven):
    """The force of the actuator itself, in MuJoCo, says whether it does."""
    numeric = '<numeric name="field_1" data="0 0 1"/>'
    element = '<element objtype="site" objname="fixed"/>'
    if driven == "field":
        element = '<element objtype="numeric" objname="field_1"/>'
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <custom><text name="magmotor" data="dipoles fields coils"/>{numeric}
        <tuple name="{driven}"><element objtype="actuator" objname="u"/>{element}</tuple></custom>
      <worldbody><site name="fixed" user="1"/><body pos="0 0 1">
        <joint name="hinge" range="-90 90"/><geom size="0.1"/>
        <site name="moving" pos="0.3 0.2 0.1" user="1"/></body></worldbody>
      <actuator>{actuator}</actuator></mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[:], data.qvel[:], data.act[:] = 0.5, 0.1, 0.5
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator.any() == pushes
    found = mm.describe(model)
    assert found.pushing == ("u",) * pushes
    assert ('(gainprm="0" prevents this): u' in str(found)) == pushes


def test_check_notes_a_name_to_which_attach_added_a_prefix(capsys):
    """Such a coupling does not act, whatever its factor."""
    head = MARK.format("dipoles couplings").replace("</custom>", "")
    head += COUPLING.format(0).replace("<custom>", "").replace('"coupling"', '"r_coupling"')
    found = mm.check(mujoco.MjModel.from_xml_string(PAIR.format(head=head)))
    print(found)
    note = "tuple 'r_coupling', since only names that start with coupling count"
    assert [note in each for each in found.notes].count(True) == 1
    assert f"note: not acting: {note}" in capsys.readouterr().out


def test_user_numbers_of_others_are_left_alone():
    found, _ = described(PAIR.format(head="").replace('name="turn"', 'name="turn" user="1123"'))
    assert found.acting == ()
    assert found.idle == (
        (
            'user numbers of sites, since there is no mark, such as <text name="magmotor"'
            ' data="dipoles"/>'
        ),
        (
            'user numbers of joints, since there is no mark, such as <text name="magmotor"'
            ' data="potentials"/>'
        ),
    )


@pytest.mark.parametrize(
    ("scene", "kT"),
    [
        (mm.Motor.paper("uniform-a"), mm.Motor.paper("uniform-a").kT),
        (mm.Disk(), 1 / mm.Disk().beta),
        (mm.Disk(noise=1.0), 1 / mm.Disk(noise=1.0).beta),
    ],
)
def test_the_temperature_of_a_scene(scene, kT, capsys):
    found = mm.describe(mm.build(scene))
    print(found)
    assert found.kT == pytest.approx((kT, kT), rel=1e-14)  # measured: 4e-16
    assert re.search(r"temperature: kT = [\d.e-]+ J$", capsys.readouterr().out, re.MULTILINE)


def test_a_ring_with_noise_alone_has_no_temperature(capsys):
    """At nonuniform temperature, the motor's ring has noise but no friction."""
    found = mm.describe(mm.build(mm.Motor.paper("nonuniform-a")))
    print(found)
    assert found.kT == (0.0, np.inf)
    assert "unbounded, since noise drives a motion that is not damped" in capsys.readouterr().out


CHAIN = """
<mujoco>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body name="upper" user="{upper}">
      <joint type="hinge" damping="{damping}"/>
      <geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
      <body name="lower" pos="1 0 0" user="{lower}">
        <joint type="hinge" damping="0.2"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_noise_of_the_world_does_not_match_damping_between_the_bodies_of_a_tree():
    """Torques about z: J = [[1, 0], [1, 1]]; kT are the eigenvalues of C^-1 J^T s^2 J/2."""
    row = "0 0 0 0 0 0.6"
    text = CHAIN.format(upper=row, lower=row, damping=0.2)
    found, printed = described(text)
    noise = 0.6**2 / 2 * np.array([[2.0, 1.0], [1.0, 1.0]])
    assert found.kT == pytest.approx(np.linalg.eigvalsh(noise / 0.2), rel=8e-14)  # 3e-15
    assert "not uniform, kT from 0.3438 J to 2.356 J" in printed


def test_noise_without_damping():
    found, text = described(CHAIN.format(upper="0 0 0 0 0 1", lower="0", damping=0))
    assert found.kT == (0.0, np.inf)
    assert "temperature: unbounded, since noise drives a motion that is not damped" in text


ARM = """
<mujoco>
  <option gravity="0 0 0">{flags}</option>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body name="arm" user="{noise}">
      <joint name="axle" axis="0 0 1" damping="{damping}" {joint}/>
      <geom type="capsule" fromto="0 0 0 1 0 0" size="0.1" mass="1" {arm}/>
    </body>
    {more}
  </worldbody>
  <tendon>{tendon}</tendon>
  <equality>{equality}</equality>
  <actuator>{actuator}</actuator>
</mujoco>
"""
"""Its center of mass is 0.5 m from its axle, so BAOAB refuses it."""

DEFAULTS = {
    "flags": "", "noise": "0 0 0 0 0 0.6", "damping": "0.2", "joint": "", "arm": "", "more": "",
    "tendon": "", "equality": "", "actuator": "",
}  # fmt: skip
TENDON = '<fixed {}><joint joint="axle" coef="1"/></fixed>'
SPATIAL = '<spatial {}><site site="near"/><site site="far"/></spatial>'
ENDS = '<site name="near" pos="2 0 0"/><body pos="3 0 0"><site name="far"/></body>'
POLE = '<geom size="0.1" pos="0 1 0"/>'


def arm(**parts):
    return ARM.format(**DEFAULTS | parts)


@pytest.mark.parametrize(
    ("parts", "kT"),
    [
        ({}, 0.9),  # s^2/(2 c)
        ({"actuator": '<velocity joint="axle" kv="0.7"/>'}, 0.2),
        ({"actuator": '<position joint="axle" kp="1" kv="0.7"/>'}, 0.2),
        ({"actuator": '<motor joint="axle" gear="2" damping="0.1"/>'}, 0.3),
        ({"actuator": '<motor joint="axle" gear="2" damping="0.1"/>',
          "flags": '<flag actuation="disable"/>'}, 0.3),
        ({"tendon": SPATIAL.format('damping="1"'), "more": ENDS}, 0.9),  # nothing pulls the arm
        ({"tendon": TENDON.format('damping="0.2"')}, 0.45),
        ({"noise": "0 0 0 0 0 0.6  0 0 0 0 0 0.6"}, 1.8),
        ({"noise": "0 0 0 0 0 0.6", "flags": '<flag damper="disable"/>'}, np.inf),
        ({"damping": "0"}, np.inf),
        ({"damping": "0", "tendon": TENDON.format('damping="0.2"')}, 0.9),
        ({"actuator": '<motor joint="axle"/><position joint="axle" kp="2"/>'}, 0.9),
        (
            {
                "actuator": '<velocity joint="axle" kv="2"/>',
                "flags": '<flag actuation="disable"/>',
            },
            0.9,
        ),
        ({"actuator": '<motor joint="axle" damping="1"/>',
          "flags": '<flag damper="disable"/>'}, np.inf),
        ({"joint": 'frictionloss="1"', "flags": '<flag frictionloss="disable"/>'}, 0.9),
        ({"more": POLE, "flags": '<flag contact="disable"/>'}, 0.9),
        ({"more": POLE.replace("/>", ' contype="2" conaffinity="2"/>')}, 0.9),
        ({"more": f'{POLE}<body mocap="true">{POLE}</body>',
          "arm": 'contype="0" conaffinity="0"'}, 0.9),
        ({"more": f'{POLE}<body mocap="true">{POLE}{POLE}</body>',
          "arm": 'contype="0" conaffinity="0"'}, 0.9),
        ({"arm": 'contype="2" conaffinity="2"/><geom size="0.1" mass="0"'}, 0.9),
        ({"arm": 'contype="1"/><geom size="0.1" mass="0"'}, 0.9),
        ({"equality": '<joint joint1="axle" active="false"/>'}, 0.9),
        ({"joint": 'range="-1 1"', "flags": '<flag constraint="disable"/>'}, 0.9),
    ],
)  # fmt: skip
def test_the_temperature_by_formula(parts, kT):
    found, text = described(arm(**parts))
    assert found.kT is not None
    assert found.kT[1] == pytest.approx(kT, rel=6e-15)  # 2.5e-16
    line = "unbounded, since noise drives" if kT == np.inf else f"kT = {kT} J"
    assert f"temperature: {line}" in text


@pytest.mark.parametrize(
    ("parts", "what"),
    [
        ({"joint": 'frictionloss="1"'}, "friction loss"),
        ({"tendon": TENDON.format('frictionloss="1"')}, "friction loss"),
        ({"joint": 'range="-1 1"'}, "limits"),
        ({"tendon": TENDON.format('range="-1 1"')}, "limits"),
        ({"equality": '<joint joint1="axle"/>'}, "equalities"),
        ({"more": POLE}, "contacts"),
        ({"more": POLE.replace("/>", ' contype="0"/>')}, "contacts"),
        ({"flags": '<flag damper="disable"/>', "more": POLE}, "contacts"),
        ({"joint": 'frictionloss="1" range="-1 1"', "more": POLE},
         "friction loss, limits and contacts"),
    ],
)  # fmt: skip
def test_a_temperature_that_other_dampers_may_change_is_unknown(parts, what):
    found, text = described(arm(**parts))
    assert found.kT is None
    assert f"temperature: unknown, since {what} may damp" in text.splitlines()


@pytest.mark.parametrize(
    ("parts", "element"),
    [
        ({"actuator": '<damper joint="axle" kv="2" ctrlrange="0 1"/>'}, "actuator 0: gainprm[2]"),
        ({"actuator": '<muscle joint="axle" lengthrange="0 1"/>'}, "actuator 0: gaintype"),
        ({"damping": "0.2 0.1"}, "joint 'axle': dampingpoly"),
        ({"tendon": TENDON.format('damping="0 0.1"')}, "tendon 0: dampingpoly"),
    ],
)
def test_friction_that_is_not_linear_makes_the_temperature_unknown(parts, element):
    found, text = described(arm(**parts))
    assert found.kT is None
    assert f"temperature: unknown, since its friction is not linear ({element} = " in text


def test_friction_that_is_no_number_makes_the_temperature_unknown(capsys):
    model = mujoco.MjModel.from_xml_string(arm())
    model.dof_damping[0] = np.nan
    assert mm.describe(model).kT is None
    print(mm.describe(model))
    assert (
        "temperature: unknown, since its friction is not a finite number" in capsys.readouterr().out
    )


def test_the_drag_of_a_fluid():
    """The arm's drag is 3 pi eta d (0.5 m)^2 + pi eta d^3 about its axle."""
    text = arm(damping="0").replace("<option", '<option viscosity="2"')
    model = mujoco.MjModel.from_xml_string(text)
    moments = model.body_inertia[1]
    d = np.sqrt((moments.sum() - 2 * moments) * 6).mean()
    kT = 0.36 / 2 / (6 * np.pi * d * 0.25 + 2 * np.pi * d**3)
    assert described(text)[0].kT == pytest.approx((kT, kT), rel=3e-14)  # measured: 1e-15


def test_a_fluid_with_density_makes_the_temperature_unknown():
    found, text = described(arm().replace("<option", '<option density="1000"'))
    assert found.kT is None
    assert "since its friction is not linear (option density = 1000.0: " in text


def test_a_force_on_an_arm_that_turns_matches_its_damping_in_one_configuration_only():
    """At `qpos0` kT is (0.6 N 0.5 m)^2/(2 c) = 0.225 J; turned by q, cos^2 q of that."""
    found, text = described(arm(noise="0 0.6 0 0 0 0"))
    assert found.kT is not None
    assert found.kT[1] == pytest.approx(0.225, rel=6e-15)  # 2.5e-16
    assert 0 <= found.kT[0] < 0.1 * 0.225  # 0.0156
    assert "differ by" in text


def test_a_fluid_does_not_act_without_passive_forces():
    flags = '<flag spring="disable" damper="disable"/>'
    text = arm(flags=flags).replace("<option", '<option density="1000"')
    assert described(text)[0].kT == (0.0, np.inf)


@pytest.mark.parametrize(
    ("plugin", "actuator", "unknown"),
    [
        ("magmotor.forces", "", ""),
        ("mujoco.pid", '<plugin joint="axle" plugin="mujoco.pid" instance="i"/>', "plugins"),
    ],
)
def test_only_plugins_of_others_may_damp(plugin, actuator, unknown):
    extension = f'<extension><plugin plugin="{plugin}"><instance name="i"/></plugin></extension>'
    text = arm(actuator=actuator).replace("<custom>", f"{extension}<custom>")
    found, _ = described(text)
    assert found.unknown == (f"{unknown} may damp" if unknown else "")


def test_a_pair_of_geoms_makes_the_temperature_unknown():
    """Unless it is a viscous contact, as in `test_the_temperature_of_a_scene`."""
    geoms = '<geom name="pole" size="0.1" pos="0 1 0" contype="0" conaffinity="0"/>'
    text = arm(more=geoms).replace('type="capsule"', 'name="rod" type="capsule"')
    text = text.replace("<tendon>", '<contact><pair geom1="pole" geom2="rod"/></contact><tendon>')
    assert described(text)[0].unknown == "contacts may damp"


@pytest.mark.parametrize(
    ("inside", "unknown"),
    [
        ("", "contacts may damp"),
        ('<exclude body1="arm" body2="world"/>', ""),
    ],
)
def test_excluded_geoms_do_not_collide(inside, unknown):
    text = arm(more=POLE).replace("<tendon>", f"<contact>{inside}</contact><tendon>")
    assert described(text)[0].unknown == unknown


@pytest.mark.parametrize(("parent", "unknown"), [("enable", ""), ("disable", "contacts may damp")])
def test_geoms_of_parent_and_child_do_not_collide(parent, unknown):
    text = CHAIN.format(upper="0 0 0 0 0 1", lower="0", damping=0.2)
    flag = f'<option><flag filterparent="{parent}"/></option>'
    found, _ = described(text.replace("<worldbody>", f"{flag}<worldbody>"))
    assert found.unknown == unknown


def test_noise_that_drives_nothing():
    """A force along the axle; the model has no other noise."""
    found, printed = described(arm(noise="0 0 1 0 0 0"))
    assert found.kT is None
    assert "temperature: unknown, since noise drives no joint" in printed


def test_noise_on_what_cannot_move():
    found, printed = described(arm(noise="0", more='<body user="0 0 0 0 0 1"/>'))
    assert found.acting == ()
    assert found.noise == {}
    assert "not acting: noise of body 2, since what cannot move is not driven" in printed


def test_the_attitude_at_qpos0_does_not_matter_to_a_ball():
    scene = mm.Motor.paper("uniform-a")
    model = mm.build(scene)
    ball = model.joint(int(np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL)[0]))
    model.qpos0[ball.qposadr[0] : ball.qposadr[0] + 4] = 0.1, 0.5, -0.7, 0.5
    assert mm.describe(model).kT == pytest.approx((scene.kT, scene.kT), rel=1e-14)  # 4e-16


def test_the_temperature_is_that_of_a_run():
    """I <w^2> over 3000 s, in which w^2 has a correlation time of I/(2 c) = 0.45 s.

    Its standard error is sqrt(4 0.45/3000) = 2.4 %; an error of 12 % has a chance of 6e-7.
    """
    model = mujoco.MjModel.from_xml_string(arm(tendon=TENDON.format('damping="0.2"')))
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    squares = []
    with mm.magnetism():
        for _ in range(15000):
            mujoco.mj_step(model, data, nstep=20)
            squares.append(data.qvel[0] ** 2)
    found = model.dof_M0[0] * np.mean(squares)
    assert mm.describe(model).kT == pytest.approx((found, found), rel=0.12)


@pytest.mark.parametrize(
    ("upper", "lower", "kT"),
    [("0", "0 0 0 0 0 0.6", (0.9, 0.9)), ("0 0 0 0 0 0.6", "0", (0.0, np.inf))],
)
def test_a_tendon_damps_one_direction_of_two(upper, lower, kT):
    """It damps w1 + w2; a torque on the lower body drives both, one on the upper body w1."""
    text = CHAIN.format(upper=upper, lower=lower, damping=0).replace("0.2", "0")
    joints = text.replace('<joint type="hinge"', '<joint name="{}" type="hinge"').format("a", "b")
    tendon = """<tendon><fixed damping="0.2"><joint joint="a" coef="1"/><joint joint="b" coef="1"/>
    </fixed></tendon></mujoco>"""
    found, _ = described(joints.replace("</mujoco>", tendon))
    assert found.kT == pytest.approx(kT, rel=3.6e-15)  # 1.2e-16


def marked(*bodies):
    return f"""<mujoco>{MARK.format("dipoles noise potentials")}
    <worldbody>{"".join(bodies)}</worldbody></mujoco>"""


GEOM = '<geom size="0.01" contype="0" conaffinity="0"/>'


def body(content, *, name="", joint='<joint damping="1"/>', user=""):
    given = "".join(f' {key}="{value}"' for key, value in (("name", name), ("user", user)) if value)
    return f"<body{given}>{joint}{GEOM}{content}</body>"


SITE = '<site user="1"/>'
WORLD = '<element objtype="body" objname="world"/>'


def declared(custom):
    return f"</worldbody><custom>{custom}</custom><worldbody>"


ON_A = '<element objtype="numeric" objname="field_a"/>'
IRON = '<element objtype="numeric" objname="m"/><element objtype="geom" objname="g"/>'
LINES = {
    "eight entries": (
        [body(SITE, name=f"b{k}") for k in range(8)],
        "dipoles: 1 on b0, 1 on b1, 1 on b2, 1 on b3, 1 on b4, 1 on b5, 1 on b6, 1 on b7",
    ),
    "more entries": (
        [body(SITE, name=f"b{k}") for k in range(10)],
        f"dipoles: {', '.join(f'1 on b{k}' for k in range(8))}, and 2 more",
    ),
    "names": ([body(SITE), body(SITE, name="needle")], "dipoles: 1 on body 1, 1 on needle"),
    "pairs": ([body(SITE), body(SITE, name="needle")], "pairs: body 1 and needle"),
    "one rigid body": (
        [body(SITE + "<body>" + SITE + "</body>")],
        "not acting: the dipoles, since all are on one rigid body",
    ),
    "the world alone": (
        [SITE, body("")], "not acting: the dipoles, since all are on one rigid body",
    ),
    "rows of zeros": (
        [body("", name="a", user="0 0 0 0 0 0  1 0 0 0 0 0  0 0 0 0 0 0"), body("", user="0")],
        "noise, Brownian wrenches: a 1",
    ),
    "a potential": (
        [body("", joint='<joint user="1 2 3 0"/>')],
        "periodic potentials, Fourier terms: joint 0 2",
    ),
    "absent": (
        [body(SITE), body(SITE)],
        "not acting: noise and potentials, which the mark names, since the model has none",
    ),
    "a prefix of a coupling": (
        [f"</worldbody><custom><tuple name='a_coupling'>{WORLD}</tuple></custom><worldbody>"],
        ("not acting: tuple 'a_coupling', since only names that start with coupling count"
        " (MjSpec.attach adds a prefix)"),
    ),
    "a prefix of a mark": (
        ["</worldbody><custom><text name='a/magmotor' data='all'/></custom><worldbody>"],
        "not acting: text 'a/magmotor', since only the name magmotor makes it a mark",
    ),
    "a prefix of a field": (
        [declared("<numeric name='a_field' data='0 0 1'/>")],
        ("not acting: numeric 'a_field', since only names that start with field count"
        " (MjSpec.attach adds a prefix)"),
    ),
    "a prefix of a coil": (
        [f"</worldbody><custom><tuple name='a_coil'>{WORLD}</tuple></custom><worldbody>"],
        ("not acting: tuple 'a_coil', since only names that start with coil count (MjSpec.attach"
        " adds a prefix), so that its sites are permanent magnets"),
    ),
    "another case": (
        [f"</worldbody><custom><tuple name='Iron'>{WORLD}</tuple></custom><worldbody>"],
        "not acting: tuple 'Iron', since only names that start with iron count",
    ),
    "a plural": (
        [declared("<numeric name='Magnetic_Constants' data='1'/>")],
        "not acting: numeric 'Magnetic_Constants', since only the name magnetic_constant counts",
    ),
    "an abbreviation": (
        [declared("<numeric name='magnetic_const' data='1'/>")],
        "not acting: numeric 'magnetic_const', since only the name magnetic_constant counts",
    ),
    "a prefix of a constant": (
        [declared("<numeric name='arm_magnetic_constant' data='1'/>")],
        ("not acting: numeric 'arm_magnetic_constant', since only the name magnetic_constant counts"
        " (MjSpec.attach adds a prefix)"),
    ),
    "a tuple on a field": (
        [declared(f"<numeric name='field_a' data='0 0 1'/><tuple name='carrier'>{ON_A}</tuple>")],
        (
            "not acting: tuple 'carrier' on 'field_a', since the name of a tuple that places or"
            " drives a field starts with field"
        ),
    ),
    "no numbers": (
        [body("<site/>")],
        'not acting: sites without user numbers (a dipole has user="MOMENT", in A m^2)',
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", ["Field_of_view", "Ironing", "electromagnetic_constant", "magnetic_distance"]
)
def test_a_name_that_only_resembles_another_is_not_mentioned(name):
    numeric = declared(f"<numeric name='{name}' data='1'/>")
    _, text = described(marked(body(SITE), body(SITE), numeric))
    assert name not in text


@pytest.mark.parametrize("name", LINES)
@pytest.mark.filterwarnings("ignore:nothing acts:UserWarning")
def test_a_line_of_the_text(name):
    bodies, line = LINES[name]
    _, text = described(marked(*bodies))
    assert line in text.splitlines()


def test_magnets_of_which_none_can_move():
    """A mocap body is not welded to the world."""
    fixed = f'<body mocap="true">{SITE}</body>'
    _, text = described(marked(SITE, fixed, fixed, body("")))
    assert "not acting: the dipoles, since none of their bodies can move" in text.splitlines()


def test_a_model_without_a_mark_or_numbers():
    _, text = described("<mujoco/>")
    assert text.splitlines() == [
        "acting: nothing",
        'not acting: sites without user numbers (a dipole has user="MOMENT", in A m^2)',
    ]


def test_potentials_keep_inner_zeros():
    text = PAIR.format(head=MARK.format("potentials")).replace(
        'name="turn"', 'name="turn" user="0 0 0 0.5 0 0"'
    )
    found, printed = described(text)
    np.testing.assert_array_equal(found.potentials["turn"], [0, 0, 0, 0.5])
    assert "Fourier terms: turn 2" in printed


def test_dry_friction_of_joints_and_tendons():
    """Noise does not belong to it, so that the text names it, unless a flag disables it."""
    cord = '<tendon><fixed frictionloss="0.1"><joint joint="turn" coef="1"/></fixed></tendon>'
    text = PAIR.format(head=MARK.format("dipoles") + cord).replace(
        '"0.5"', '"0.5" frictionloss="1"'
    )
    found, printed = described(text)
    assert found.dry_friction == ("joint 'turn'", "tendon 0")
    assert "dry friction, which has no matching noise: joint 'turn', tendon 0" in printed
    flag = '<option><flag frictionloss="disable"/></option>'
    found, printed = described(text.replace("<mujoco>", "<mujoco>" + flag))
    assert found.dry_friction == ()
    assert "dry friction" not in printed


def test_iron_without_susceptibility():
    text = marked(
        "<geom name='g' size='1'/>",
        declared(f"<numeric name='m' data='0'/><tuple name='iron'>{IRON}</tuple>"),
        body(SITE),
    ).replace("noise potentials", "iron")
    found, printed = described(text)
    assert found.acting == ()
    assert "not acting: iron, since its susceptibility is 0" in printed.splitlines()


def test_elements_without_a_name_are_named_once(capsys):
    """By their type and number."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><custom><text name="magmotor" data="dipoles"/></custom><worldbody>
        <site/><site user="5e4"/><body><freejoint/><geom size=".1"/><site name="s"/></body>
        </worldbody></mujoco>"""
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        print(mm.describe(model))
        print(mm.check(model))
    said = capsys.readouterr().out
    assert "site site" not in said
    assert all(f"{name}" in said for name in ("site 0, site s:", "site 1 has 50000 A m^2"))


LATIN = """<mujoco>
  <custom>
    <text name="magmotor" data="all"/>
    <numeric name="field_k\xfchl" data="0 0 1e-3"/>
    <tuple name="field f\xfcr"><element objtype="numeric" objname="field_k\xfchl"/></tuple>
  </custom>
  <worldbody>
    <body name="M\xfcller"><joint name="T\xfcr" type="hinge" axis="1 0 0"/>
      <geom name="St\xfcck" size=".1"/><site name="s\xfc\xdf" user="{moment}"/></body>
  </worldbody>
  <keyframe><key name="fr\xfch"/></keyframe>
</mujoco>"""
"""A model whose names are neither ASCII nor, in Latin-1, UTF-8."""


OTHER_UNITS = '<numeric name="magnetic_constant" data="1.2566370614e-3"/></custom>'


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_elements_are_found_by_their_names_in_latin_1(encoding, tmp_path):
    path = tmp_path / "model.xml"
    text = LATIN.format(moment="1").replace("</custom>", OTHER_UNITS)
    path.write_bytes(text.encode(encoding))
    model = mujoco.MjModel.from_xml_path(str(path))
    assert "mu0 = 0.00125664" in mm.describe(model).units[0]
    found = [number_of(model, "joint", name) for name in ("T\xfcr", "Tur", "T\udcfcr")]
    assert found == [0, -1, -1]


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_names_in_latin_1(encoding, tmp_path, capsys):
    path = tmp_path / "model.xml"
    path.write_bytes(LATIN.format(moment="2e3").encode(encoding))
    model = mujoco.MjModel.from_xml_path(str(path))
    found = mm.describe(model)
    print(found)
    assert found.dipoles == {"M\xfcller": 1}
    assert [*found.fields] == ["field_k\xfchl"]
    assert "site s\xfc\xdf has 2000 A m^2" in capsys.readouterr().out
    assert any("M\xfcller" in each or "s\xfc\xdf" in each for each in mm.check(model).findings)
    model.site_user[:] = np.nan
    with misdeclared("moment", 0) as outside:
        print(mm.describe(model))
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_step(model, mujoco.MjData(model))
    assert str(in_a_step.value) == str(outside.value)
    assert str(outside.value).startswith("site 0 's\xfc\xdf': ")
