"""`check` in states where no force is defined, and the names that it gives to elements."""

import math
import re
import warnings

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.mjcf.checking import dipole_depth
from magmotor.mjcf.checking.closest_approach import meetings

PLACED = """
<mujoco>
  <option timestep="1e-4"/>
  <custom>
    <text name="magmotor" data="dipoles fields iron coils"/>
    {custom}
  </custom>
  <worldbody>
    {world}
    <body name="left" pos="0 0 0.05"><freejoint/>
      <geom name="left" size="0.005"/><site name="first" user="{moment}"/></body>
    <body name="right" pos="{place}"><freejoint/>
      <geom name="right" size="0.005"/><site name="second" user="{moment}"/></body>
  </worldbody>
</mujoco>
"""
IRON = """<numeric name="steel" data="1000"/><tuple name="iron">
<element objtype="numeric" objname="steel"/><element objtype="geom" objname="table"/></tuple>"""


def load(place="0.1 0 0.05", moment=1e-3, custom="", world=""):
    text = PLACED.format(place=place, moment=moment, custom=custom, world=world)
    return mujoco.MjModel.from_xml_string(text)


def table_of_a_field():
    return mm.tabulated_field(lambda points: 0.01 + 0 * points, (-0.2,) * 3, (0.2,) * 3, (4, 4, 4))


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        ({"place": "0.1 0 -0.02", "custom": IRON,
          "world": '<geom name="table" type="plane" size="1 1 1"/>'},
         "dipole site 1 'second' is below the plane of iron"),
        ({"place": "0.1 0 0.3", "custom": table_of_a_field()},
         "dipole site 1 'second' is outside the grid of the table in numeric 0 'field'"),
        ({"place": "0 0 0.05"}, "dipole sites 1 'second' and 0 'first' coincide"),
    ],
)  # fmt: skip
def test_dipoles_where_no_force_is_defined_are_named_and_nothing_absurd_is_proposed(
    parts, sentence
):
    model = load(**parts)
    found = mm.check(model, fix=True)
    assert found.findings[0].startswith(sentence)
    assert found.findings[0].endswith("(in the state given)")
    assert found.timestep == model.opt.timestep == 1e-4
    with pytest.raises(mujoco.FatalError) as error, mm.magnetism():
        mujoco.mj_step(model, mujoco.MjData(model))
    assert str(error.value).partition("; mm.check")[0].split()[-1] in found.findings[0]


def test_dipoles_that_almost_coincide_propose_no_timestep():
    found = mm.check(load(place="0 0 0.05000001"))
    assert any("can swing or turn with omega = " in finding and
               finding.endswith("exceeds 2; move its dipoles apart")
               for finding in found.findings)  # fmt: skip
    assert found.timestep == 1e-4


def test_dipoles_just_below_the_surface_propose_no_contact():
    """They come within 4 nm of each other."""
    text = PLACED.replace("<site", '<site pos="0 0 0.004999998"')
    model = mujoco.MjModel.from_xml_string(
        text.format(place="0.1 0 0.05", moment=1, custom="", world="")
    )
    found = mm.check(model)
    assert "can come so near that their dipoles coincide, since a dipole is on" in str(found)
    assert found.timestep == 1e-4
    assert found.solref == {}


@pytest.mark.parametrize("name", ["qpos", "mocap_pos"])
def test_data_that_are_not_finite_are_rejected(name):
    model = load(world='<body mocap="true"/>')
    data = mujoco.MjData(model)
    getattr(data, name)[0] = np.nan
    with refused(f"data.{name}"):
        mm.check(model, data)


@pytest.mark.parametrize("moment", [1e-200, 1e200])
def test_forces_beyond_the_range_of_numbers(moment):
    model = load(moment=moment)
    found = mm.check(model)
    assert found.timestep == 1e-4
    assert (found.findings == ()) == (moment < 1)


@pytest.mark.parametrize("number", ["1e160", "1e300", "1e308"])
@pytest.mark.parametrize(
    ("custom", "actuator", "moment"),
    [
        ("", "", 1),
        ("coil", "", 0),
        ("coil", 'ctrlrange="-{number} {number}"', 0),
        ('<numeric name="field" data="{number} 0 0"/>', "", 0),
        ('<numeric name="field" data="0 0 0 {number} 0 0 {number} 0"/>', "", 0),
    ],
)
def test_numbers_that_overflow_are_a_finding(number, custom, actuator, moment):
    text = custom.format(number=number)
    if custom == "coil":
        text = COIL.format(0 if actuator else number, "first")
    model = PLACED.format(
        place="0.1 0 0.05", moment="{moment}", custom=text, world=""
    ).replace("{moment}", number if moment else "0.5", 1).replace("{moment}", "0.5")  # fmt: skip
    drive = ACTUATOR.format(actuator.format(number=number))
    found = mm.check(mujoco.MjModel.from_xml_string(model.replace("</mujoco>", drive)))
    words = "frequency overflows", "not finite", "of neodymium magnets"
    assert any(word in str(found) for word in words)
    assert 1e-9 < found.timestep <= 1e-4


def test_the_work_for_pieces_of_iron_grows_as_their_number(monkeypatch):
    """400 pieces on one body took minutes, since each was compared with all pairs of others."""
    counts, depth = [], dipole_depth.depth_and_normal
    element = '<element objtype="geom" objname="{}"/>'
    geom = '<geom name="{}" type="box" size=".005 .005 .005" pos="0 {} 0"/>'
    magnet = '<body pos="0 0 .1"><freejoint/><geom size=".005"/><site user=".5"/></body>'
    for number in (10, 40):
        calls = []

        def count(*arguments, calls=calls):
            calls.append(len(arguments[-1]))
            return depth(*arguments)

        monkeypatch.setattr(dipole_depth, "depth_and_normal", count)
        geoms = "".join(geom.format(k, 0.02 * k) for k in range(number))
        text = BAR.format("".join(element.format(k) for k in range(number)), geoms)
        text = text.replace("iron fields", "iron dipoles fields")
        model = mujoco.MjModel.from_xml_string(
            text.replace("</worldbody>", magnet + "</worldbody>")
        )
        assert "may fly apart once they touch" in str(mm.check(model))
        counts.append(len(calls))
    assert counts[1] < 6 * counts[0]  # 3.9


COIL = """<tuple name="coil"><element objtype="actuator" objname="current" prm="{}"/>
<element objtype="site" objname="{}"/></tuple>"""
ACTUATOR = '<actuator><general name="current" site="first" gainprm="0" {}/></actuator></mujoco>'


@pytest.mark.parametrize(
    ("range_", "prm", "site", "said"),
    [
        ("", 0, "first", True),
        ("", 0, "second", True),
        ('ctrlrange="-1 1"', 0, "first", False),
        ("", 2, "first", False),
    ],
)
def test_a_coil_without_limits_is_said_to_be_taken_at_drive_1(range_, prm, site, said):
    text = PLACED.format(place="0.1 0 0.05", moment=0.5, custom=COIL.format(prm, site), world="")
    model = mujoco.MjModel.from_xml_string(text.replace("</mujoco>", ACTUATOR.format(range_)))
    finding = mm.check(model).findings[0]
    assert ("N (at drive 1 of actuator 'current', which nothing bounds);" in finding) == said


@pytest.mark.parametrize(
    ("fixed", "name"),
    [
        ('<body name="post"><geom size="0.005"/><site name="magnet" user="0.5"/></body>',
         "bodies 'post' and 'left'"),
        ('<body name="post"><geom size="0.005"/><body><site user="0.5"/></body></body>',
         "bodies 'post' and 'left'"),
        ('<body><geom size="0.005"/><site name="magnet" user="0.5"/></body>',
         "site 'magnet' and body 'left'"),
        ('<geom size="0.005"/><site name="magnet" user="0.5"/>', "site 'magnet' and body 'left'"),
        ('<geom name="pole" size="0.005"/><geom pos="1 0 0" size="0.01"/><site user="0.5"/>',
         "geom 'pole' and body 'left'"),
    ],
)  # fmt: skip
def test_what_is_fixed_to_the_world_has_its_own_name(fixed, name):
    found = mm.check(load(world=fixed, moment=0.5))
    assert found.findings[0].startswith(f"{name} (and 1 more like them) will fly apart once")
    assert "'world'" not in str(found)


def test_a_needle_that_only_turns_about_its_center():
    """It has no mass against which a fixed magnet could pull it."""
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <custom><text name="magmotor" data="dipoles"/></custom>
      <worldbody>
        <geom size="0.01" pos="0.05 0 0"/><site pos="0.05 0 0" user="0.01"/>
        <body>
          <joint axis="0 0 1"/><geom type="capsule" fromto="-.03 0 0 .03 0 0" size="0.003"/>
          <site user="0.01" zaxis="1 0 0"/>
        </body>
      </worldbody>
    </mujoco>""")
    assert model.body_invweight0[1, 0] == 0
    assert mm.check(model).findings == ()


PIECE = """
<mujoco>
  <custom>
    <text name="magmotor" data="dipoles iron"/><numeric name="steel" data="1000 1.7e6"/>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/><element objtype="geom" objname="piece"/>
    </tuple>
  </custom>
  <worldbody>
    <geom name="piece" type="{}" size="{}"/>
    <body pos="0 0 0.05">
      <freejoint/><geom size="0.005" density="7500"/><site user="0.54"/>
    </body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(("kind", "size"), [
    ("sphere", "0.02"), ("box", "0.01 0.01 0.01"), ("box", "0.1 0.1 0.002"),
    ("cylinder", "0.003 0.03"), ("box", "0.005 0.005 0.03"),
])  # fmt: skip
def test_iron_of_any_shape_attracts_at_most_as_a_plane(kind, size):
    """The force at contact that is said is that of a plane; the end of a bar may be 18 % above it.

    A dipole of 0.54 A m^2 is 5 mm above iron.
    """
    model = mujoco.MjModel.from_xml_string(PIECE.format(kind, size))
    plane = 3 * 4e-7 * np.pi * 0.54**2 / (32 * np.pi * 0.005**4)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.approach is not None
    assert found.approach.force == pytest.approx(plane, rel=1e-9)
    top = float(size.split()[-1]) if kind != "sphere" else float(size)
    data.qpos[2] = top + 0.005
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    assert 0.1 * plane < -data.xfrc_applied[1, 2] < 1.25 * plane


CART = """
<mujoco>
  <option timestep="1e-4"><flag limit="{}"/></option>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body mocap="{}" pos="0 0 {}"><geom size="0.005"/><site user="0.54"/></body>
    <body>
      <joint type="slide" axis="0 0 1" range="-.01 .01" solreflimit="2e-4 1"/>
      <geom size="0.005"/><site user="0.54"/>
    </body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(("limit", "mocap", "height", "number"), [
    ("enable", "false", 0.015, 1), ("enable", "false", 0.03, 0), ("disable", "false", 0.03, 1),
    ("enable", "true", 0.03, 1),
])  # fmt: skip
def test_which_magnets_can_meet(limit, mocap, height, number):
    """They touch at 10 mm: a limit may keep them apart, unless one is moved by the user."""
    model = mujoco.MjModel.from_xml_string(CART.format(limit, mocap, height))
    findings = mm.check(model).findings
    assert sum(", they attract each other" in finding for finding in findings) == number


def test_a_driven_field_without_limits_is_taken_at_1_whatever_its_control():
    """m B = 0.54 A m^2 x 10 T turns a ball of 5 mm with more than 1000 rad/s."""
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <custom>
        <text name="magmotor" data="dipoles fields"/><numeric name="field" data="10 0 0"/>
        <tuple name="field">
          <element objtype="numeric" objname="field"/><element objtype="actuator" objname="u"/>
        </tuple>
      </custom>
      <worldbody>
        <body name="ball"><freejoint/><geom size="0.005"/><site name="s" user="0.54"/></body>
      </worldbody>
      <actuator><general name="u" site="s" gainprm="0"/></actuator>
    </mujoco>""")
    data = mujoco.MjData(model)
    for control in (0.0, 1.0, 100.0):
        data.ctrl[0] = control
        (finding,) = mm.check(model, data).findings
        assert finding.startswith(
            "body 'ball' can swing or turn with omega = 3.21e+04 rad/s at most (at drive 1 of"
            " actuator 'u', which nothing bounds), so that omega h = 64.2 exceeds 2"
        )


BAR = """
<mujoco>
  <custom>
    <text name="magmotor" data="iron fields"/><numeric name="steel" data="1000"/>
    <numeric name="field" data=".02 0 0  1 0 0 -.5 0"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>{}</tuple>
  </custom>
  <worldbody><body><freejoint/>{}</body></worldbody>
</mujoco>"""

TWO_PIECES = """
<mujoco>
  <custom>
    <text name="magmotor" data="iron fields"/><numeric name="steel" data="{chi}"/>
    <numeric name="field" data="0 0 0.02"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="one"/><element objtype="geom" objname="other"/></tuple>
  </custom>
"""
SPHERES = (
    TWO_PIECES
    + """\
  <default><geom margin="{margin}"/></default>
  <worldbody>
    <body name="one">{joint}<geom name="one" size="0.005"/></body>
    <body name="other" pos="{place} 0 0">{joint}<geom name="other" {geom}/></body>
  </worldbody>
  {more}
</mujoco>"""
)
HINGE, SLIDE = '<joint axis="1 0 0"/>', '<joint type="slide" axis="1 0 0"/>'
EXCLUDED = '<contact><exclude body1="one" body2="other"/></contact>'
INSIDE_SHELL = 'size="0.005" contype="0" conaffinity="0"/><geom size="{}e-2"'


@pytest.mark.parametrize(
    ("parts", "found"),
    [
        ({}, 1),
        ({"place": 0.5}, 1),  # free, they can come
        ({"joint": HINGE}, 1),
        ({"joint": HINGE, "place": 0.5}, 0),
        ({"joint": SLIDE, "place": 0.5}, 1),
        ({"joint": SLIDE.replace("/>", ' range="-0.24 0.24"/>'), "place": 0.5}, 0),
        ({"margin": 0.51e-3}, 0),
        ({"margin": 0.49e-3}, 1),
        ({"geom": 'size="0.005" contype="0" conaffinity="0"'}, 1),
        ({"geom": INSIDE_SHELL.format(0.61), "place": 0.02}, 0),
        ({"geom": INSIDE_SHELL.format(0.59), "place": 0.02}, 1),
        ({"geom": 'type="capsule" size="0.005 0.01"'}, 1),
        ({"chi": 0.5}, 0),
    ],
)
def test_iron_that_can_touch_other_iron(parts, found):
    text = {"chi": 1000, "margin": 0, "joint": "<freejoint/>", "place": 0.01} | parts
    text = {"geom": 'size="0.005"', "more": ""} | text
    findings = mm.check(mujoco.MjModel.from_xml_string(SPHERES.format(**text))).findings
    can = "come near each other" if text["geom"].endswith('affinity="0"') else "touch"
    sentence = f"geom 'one' and geom 'other' are pieces of iron that can {can}, where the force"
    assert [each.startswith(sentence) for each in findings] == [True] * found


@pytest.mark.parametrize("geom", ['size="0.005"', 'size="0.005" contype="0"'])
def test_iron_whose_contact_is_excluded_is_a_doubt(geom):
    """It comes as near as other iron if it does meet; only the user knows whether it does."""
    text = {"chi": 1000, "margin": 0, "joint": "<freejoint/>", "place": 0.01, "more": EXCLUDED}
    checked = mm.check(mujoco.MjModel.from_xml_string(SPHERES.format(geom=geom, **text)))
    assert not checked.findings
    (doubt,) = (note for note in checked.notes if "pieces of iron" in note)
    assert "can come near each other" in doubt
    assert "the model excludes their contact" in doubt


CHAIN = (
    TWO_PIECES
    + """\
  <default><joint axis="0 1 0"/><geom size="0.005" {collides}/></default>
  <worldbody>
    <body><joint/><geom name="one" pos="0.04 0 0"/>
      <body pos="0.1 0 0"><joint/><geom pos="0.05 0 0"/>
        <body pos="0.1 0 0"><joint/><geom name="other" pos="{place} 0 0"/></body></body></body>
  </worldbody>
</mujoco>"""
)


@pytest.mark.parametrize(
    ("place", "collides", "found"),
    [
        (0.05, "", "can touch"),
        (0.05, 'contype="0" conaffinity="0"', "can come near each other"),
        (0.0295, "", "may come near each other"),  # 0.5 mm apart at least
        (0.01, "", None),  # 0.1 m from the middle joint, the other one 0.06 m
    ],
)
def test_iron_in_chains_that_fold(place, collides, found):
    model = mujoco.MjModel.from_xml_string(CHAIN.format(chi=1000, place=place, collides=collides))
    said = f"geom 'one' and geom 'other' are pieces of iron that {found}, where"
    assert [each.startswith(said) for each in mm.check(model).findings] == [True] * bool(found)


@pytest.mark.parametrize(("place", "found"), [(0.0305, True), (0.0315, False)])
def test_iron_whose_end_is_near_other_iron(place, found):
    """The end of the capsule is 0.025 m from its center, and so 0.5 or 1.5 mm from the ball."""
    capsule = 'type="capsule" size="0.005 0.02" zaxis="1 0 0"'
    text = SPHERES.format(chi=1000, margin=0, joint=HINGE, place=place, geom=capsule, more="")
    said = "geom 'one' and geom 'other' are pieces of iron that may come near each other, where"
    findings = mm.check(mujoco.MjModel.from_xml_string(text)).findings
    assert [each.startswith(said) for each in findings] == [True] * found


def test_iron_whose_bound_alone_touches_is_not_said_to_touch():
    """The capsule stands 0.018 m beside the ball, and only turns about an axis between them."""
    capsule = 'type="capsule" size="0.005 0.02"'
    text = SPHERES.format(chi=1000, margin=0, joint=HINGE, place=0.028, geom=capsule, more="")
    (finding,) = mm.check(mujoco.MjModel.from_xml_string(text)).findings
    assert "are pieces of iron that may come near each other, where" in finding


UNITS = """
<mujoco>
  <custom><text name="magmotor" data="dipoles fields iron"/>{custom}</custom>
  <worldbody>
    <site pos="0 0 {height}" user="{moment}"/><geom name="iron" {iron}/>
    <body name="needle"><joint type="ball"/>
      <geom type="capsule" size="{size} {size}" density="7500"/>
      <site zaxis="1 0 0" user="{moment}"/></body>
  </worldbody>
</mujoco>"""
EARTH = '<numeric name="field" data="2e-5 0 0"/>'
OWN_UNITS = '<numeric name="magnetic_constant" data="1.2566e-3"/>'
STEEL = """<numeric name="steel" data="1000"/><tuple name="iron">
<element objtype="numeric" objname="steel"/><element objtype="geom" objname="iron"/></tuple>"""


@pytest.mark.parametrize(
    ("parts", "found"),
    [
        ({}, 0),
        ({"height": 0.5}, 0),
        ({"height": 100}, 1),  # positions in mm, sizes in m
        ({"height": 100, "size": 5}, 1),  # all in mm
        ({"height": 6.4e6, "moment": 8e22, "size": 0.02}, 0),
        ({"height": 8, "moment": 0.05}, 0),  # 800 radii
        ({"height": 12, "moment": 0.05}, 1),
        ({"height": 12, "moment": 5}, 0),  # 0.2 rad/s
        ({"height": 100, "custom": STEEL}, 0),
        ({"height": 100, "custom": STEEL, "iron": 'size="0.005" pos="0 0 50"'}, 1),
        ({"height": 100, "custom": STEEL, "iron": 'size="0 0 1" type="plane"'}, 0),
        ({"height": 100, "custom": EARTH}, 0),
        ({"height": 100, "size": 5, "custom": EARTH}, 1),
        ({"height": 100, "size": 0.05, "custom": EARTH}, 0),
        ({"height": 100, "custom": OWN_UNITS}, 0),
    ],
)
def test_magnets_that_are_absurdly_far_from_each_other(parts, found):
    text = {"height": 0.1, "moment": 0.5, "size": 0.005, "custom": ""} | parts
    text = {"iron": 'size="0.005" pos="0 0 1"'} | text
    checked = mm.check(mujoco.MjModel.from_xml_string(UNITS.format(**text)))
    findings, notes = checked.findings, [note for note in checked.notes if "hardly feels" in note]
    assert len(notes) == found * (text["custom"] == EARTH)
    said = [each for each in findings if "hardly feels the other magnets" in each]
    assert len(said) == found * (text["custom"] != EARTH)
    assert all(each.endswith("are all lengths in meters?") for each in said)


@pytest.mark.parametrize(
    ("height", "custom", "noted"),
    [(9, EARTH, False), (11, EARTH, True), (11, "", False), (11, EARTH + OWN_UNITS, False)],
)
def test_magnets_that_only_feel_a_field_are_a_note(height, custom, noted):
    """The needle's radius is 0.01 m."""
    model = mujoco.MjModel.from_xml_string(
        UNITS.format(height=height, custom=custom, moment=0.5, size=0.005, iron='size="0.1"')
    )
    notes = [note for note in mm.check(model).notes if note.startswith("magnets hardly feel")]
    said = "such as body 'needle' with a radius of 0.01 m, 11 m away from the nearest one"
    doubt = f"magnets hardly feel each other, {said}: are all lengths in meters?"
    assert notes == [doubt] * noted


SWING = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}"/>
  <custom><text name="magmotor" data="dipoles fields"/>
    <numeric name="field" data="{field} 0 0"/>{driven}</custom>
  <worldbody>
    <body name="ball"><joint axis="0 0 1"/><geom size=".005" density="7500"/>
      <site name="site" zaxis="1 0 0" user=".5"/></body>
  </worldbody>
  {more}
</mujoco>"""
DRIVEN = """<tuple name="field"><element objtype="numeric" objname="field"/>
<element objtype="actuator" objname="current"/></tuple>"""


def swing(omega_h, integrator="Euler", driven="", more=""):
    """A ball in a field in which omega h is a number, at a timestep of 2 ms."""
    inertia = 0.4 * 7500 * 4 / 3 * np.pi * 0.005**5
    text = SWING.format(field=(omega_h / 2e-3) ** 2 * inertia / 0.5, integrator=integrator,
                        driven=driven, more=more)  # fmt: skip
    return mujoco.MjModel.from_xml_string(text)


def test_swings_that_rk4_damps_are_a_note():
    """Small ones, over two of the times in which it takes a factor of e from their energy."""
    assert not any("RK4" in note for note in mm.check(swing(0.4, "RK4")).notes)
    model = swing(0.8, "RK4")
    (note,) = (note for note in mm.check(model).notes if "omega h = 0.8" in note)
    steps = float(re.findall(r"of such swings in (\S+) steps", note)[0])
    data = mujoco.MjData(model)
    data.qpos[0] = 0.01
    energies = []
    with mm.magnetism():
        for _ in range(2):
            mujoco.mj_forward(model, data)
            inertia, speed = model.dof_M0[0], data.qvel[0]
            energies.append(inertia * (speed**2 + (0.8 / 2e-3 * data.qpos[0]) ** 2))
            mujoco.mj_step(model, data, nstep=round(2 * steps))
    assert math.log(energies[0] / energies[1]) == pytest.approx(2, rel=0.1)  # by (omega h)^8/576


@pytest.mark.parametrize(
    ("omega_h", "integrator", "noted"),
    [(0.8, "Euler", False), (1.2, "Euler", True), (1.2, "implicitfast", True), (1.2, "RK4", False)],
)
def test_wide_swings_that_gain_energy_are_a_note(omega_h, integrator, noted):
    """From 168 degrees, over 10,000 steps; the speed is at most 2 omega sin(84 degrees)."""
    model = swing(omega_h, integrator)
    notes = [note for note in mm.check(model).notes if "wide ones" in note]
    said = f"body 'ball' has omega h = {omega_h:.3g} at most: small swings are stable up to 2, but"
    assert notes == [f"{said} wide ones that nothing damps gain energy from about 1 on"] * noted
    data, fastest = mujoco.MjData(model), 0.0
    data.qpos[0] = np.radians(168)
    with mm.magnetism(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that the ball turns far in a step
        for _ in range(10_000):
            mujoco.mj_step(model, data)
            fastest = max(fastest, abs(data.qvel[0]))
    excess = fastest / (2 * omega_h / 2e-3 * np.sin(np.radians(84)))
    assert excess > 5 if noted else excess < 1.1


def test_a_drive_that_nothing_bounds_is_a_note():
    def notes(more):
        actuator = f'<actuator><general name="current" site="site" gainprm="0" {more}/></actuator>'
        found = mm.check(swing(0.5, driven=DRIVEN, more=actuator)).notes
        return [note for note in found if note.startswith("actuator 'current' has no limits")]

    assert len(notes("")) == 1
    assert notes('ctrlrange="-1 1"') == []


def test_magnets_that_overlap_in_a_keyframe():
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <custom><text name="magmotor" data="dipoles"/></custom>
      <worldbody>
        <body name="a"><geom name="one" size=".01"/><site user="1e-6"/></body>
        <body pos=".1 0 0"><joint type="slide" axis="1 0 0"/>
          <geom name="other" size=".01"/><site user="1e-6"/></body>
      </worldbody>
      <keyframe><key qpos="0"/><key qpos="-.085" name="near"/></keyframe>
    </mujoco>""")
    (finding,) = mm.check(model).findings
    assert finding == (
        "geom 'one' and geom 'other' of magnets overlap by 0.005 m in keyframe 'near'; move them"
        " apart"
    )
