"""What `check` says of magnets that slides keep on one line, or hinges within limits."""

import math

import mujoco
import numpy as np
import pytest

import magmotor as mm

MODEL = """
<mujoco>
  <option gravity="0 0 0"/>
  <extension><plugin plugin="magmotor.forces">
    <instance name="magnets"><config key="act" value="dipoles{acting}"/></instance>
  </plugin></extension>
  {more}
  <worldbody>{bodies}</worldbody>
</mujoco>"""
DISC = '<geom type="cylinder" size=".01 .003" zaxis="1 0 0" density="7500"/>'
SLIDE = '<joint type="slide" axis="1 0 0"/>'
BODY = (
    '<body name="{}" pos="{}">{}{}<site name="{}" pos="0 {} 0" zaxis="{} 0 0" user="1.5"/></body>'
)
FLOATER = """<site name="base" zaxis="0 0 1" user="1"/>
<body name="floater" pos="0 0 .05">
  <joint name="rod" type="slide" axis="0 0 1" range="-.045 .1" solreflimit=".1 1"/>
  <geom type="cylinder" size=".01 .003" density="7500"/><site zaxis="0 0 {}" user="1"/></body>"""
FALLING = """<site user=".01"/><body pos="0 0 .05"><joint type="slide" axis="0 0 1"/>
<geom size=".005" density="7500" contype="0"/><site user=".01" zaxis="0 0 -1"/></body>"""
COIL = """<actuator><general name="drive" site="{}" ctrlrange="-1 1" ctrllimited="true"/></actuator>
<custom><tuple name="coil"><element objtype="actuator" objname="drive"/>
<element objtype="site" objname="b"/></tuple></custom>"""
COUPLING = """<custom><tuple name="coupling"><element objtype="body" objname="a" prm="-1"/>
<element objtype="body" objname="b" prm="-1"/></tuple></custom>"""
IRON = """<custom><numeric name="steel" data="1000"/><tuple name="iron">
<element objtype="numeric" objname="steel"/>
<element objtype="geom" objname="far"/></tuple></custom>"""


def springs(sign, joint=SLIDE, aside=0.0, acting="", more="", extra="", mocap=False):
    """Two magnets that slide on one line, whose moments are parallel or opposed."""
    bodies = BODY.format("a", "0 0 0", "" if mocap else SLIDE, DISC, "a", 0, 1) + extra
    bodies = bodies.replace("<body", '<body mocap="true"') if mocap else bodies
    bodies += BODY.format("b", ".04 0 0", joint, DISC, "b", aside, sign)
    return mujoco.MjModel.from_xml_string(MODEL.format(bodies=bodies, acting=acting, more=more))


def floater(sign):
    """A magnet on a rod above another one, without contact and with a soft limit."""
    text = MODEL.format(bodies=FLOATER.format(sign), acting="", more="")
    return mujoco.MjModel.from_xml_string(text)


def thrown(model, velocities, step):
    """Places after 0.1 s, and the least ones of the last joint on the way."""
    model.opt.timestep = step
    data, nearest = mujoco.MjData(model), np.inf
    data.qvel[:] = velocities
    for _ in range(round(0.1 / step)):
        mujoco.mj_step(model, data)
        nearest = min(nearest, data.qpos[-1])
    return np.append(data.qpos, nearest)


ONLY = "can swing or turn with omega"


def only_the_frequency(model):
    """Whether `check` finds nothing but a timestep that is too long where the magnets touch."""
    (finding,) = mm.check(model).findings
    return ONLY in finding and "at most where they touch" in finding


def test_contacts_of_magnets_that_repel_on_a_rail_are_not_judged():
    """At a relative velocity of 1 m/s they do not touch, and the timestep is short enough."""
    model = springs(-1)
    assert only_the_frequency(model)
    default, short = (thrown(model, [0.5, -0.5], step) for step in (2e-3, 1e-4))
    assert short[-2] > 0.02  # pushed back
    assert abs(default - short).max() < 0.04 * abs(short).max()
    model.opt.timestep = 0.002
    mm.check(model, fix=True)
    assert mm.check(model).findings == ()


def test_a_soft_limit_need_not_hold_what_repels():
    """A magnet that another one holds up reaches its limit in neither model."""
    assert "limit of joint 'rod' is too soft" in mm.check(floater(1)).findings[0]
    model = floater(-1)
    assert not any("too soft" in each for each in mm.check(model).findings)
    data = mujoco.MjData(model)
    data.qpos[0] = -0.02
    mujoco.mj_step(model, data, 2000)
    assert data.qpos[0] > -0.02


@pytest.mark.filterwarnings("ignore:.*so that it may fly apart")
def test_a_long_timestep_takes_magnets_that_repel_through_each_other():
    """One that falls from 0.05 m onto another one is thrown up to 0.36 m."""
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(bodies=FALLING, acting="", more="").replace("0 0 0", "0 0 -9.81", 1)
    )
    assert "coincide" in mm.check(model).findings[0]
    highest = []
    for step in (2e-3, 1e-4):
        model.opt.timestep, data, heights = step, mujoco.MjData(model), []
        for _ in range(round(1.2 / step)):
            mujoco.mj_step(model, data)
            heights.append(data.qpos[0])
        highest.append(max(heights))
    assert highest[0] > 0.2
    assert highest[1] < 1e-3


@pytest.mark.parametrize(("build", "said"), [
    (springs, ("may fly apart", "too strongly", "can swing or turn")),
    (floater, ("limit of joint 'rod' is too soft",)),
])  # fmt: skip
def test_magnets_that_attract_on_a_rail_fail_as_before(build, said):
    findings = mm.check(build(1)).findings
    assert len(findings) == len(said)
    for finding, words in zip(findings, said, strict=True):
        assert words in finding


def test_a_negative_coupling_reverses_the_force():
    """Magnets whose moments are parallel repel each other then."""
    for sign, sound in ((1, True), (-1, False)):
        findings = mm.check(springs(sign, acting=" couplings", more=COUPLING)).findings
        assert all(ONLY in finding for finding in findings) is sound


@pytest.mark.parametrize("change", [
    {"joint": SLIDE + '<joint type="hinge" axis="0 1 0"/>'},
    {"joint": SLIDE + '<joint type="slide" axis="0 1 0"/>'},
    {"joint": "<freejoint/>"},
    {"acting": " coils", "more": COIL.format("b")},
    {"acting": " iron", "more": IRON,
     "extra": '<geom name="far" size=".001" pos="0 0 1" contype="0" conaffinity="0"/>'},
    {"aside": 0.009},  # they attract each other before they touch
    {"mocap": True},  # a hand can turn it
])  # fmt: skip
def test_magnets_that_can_attract_fail_as_before(change):
    assert "attract" in str(mm.check(springs(-1, **change)))


def test_magnets_a_little_off_their_line_repel_too():
    """They touch, and penetrate, before their dipoles pass each other."""
    assert only_the_frequency(springs(-1, aside=0.001))


@pytest.mark.filterwarnings("ignore:.*has sunk into")
@pytest.mark.parametrize(("aside", "through"), [(0.001, False), (0.0035, True)])
def test_a_soft_contact_lets_magnets_come_to_where_they_attract(aside, through):
    """At 25 m/s, its distance falls below aside sqrt(3/2); both pairs repel until they touch."""
    model = springs(-1, aside=aside)
    place, other, _ = thrown(model, [12.5, -12.5], 1e-5)
    assert bool(0.04 + other < place) is through
    assert ("attract" in str(mm.check(model))) is through


SIDE = """<geom type="cylinder" size=".01 .003" zaxis="1 0 0" pos="0 .03 0" density="7500"/>
<site pos="0 .03 0" zaxis="-1 0 0" user="30"/>"""


def test_magnets_that_attract_only_on_a_part_of_the_way_fail_as_before():
    """They repel each other far away, and where they touch; a large one aside attracts between."""
    bodies = BODY.format("a", "0 0 0", SLIDE, DISC, "a", 0, 1)
    bodies += BODY.format("b", ".04 0 0", SLIDE, DISC + SIDE, "b", 0, -1)
    bodies = bodies.replace('user="1.5"', 'user=".3"')
    model = mujoco.MjModel.from_xml_string(MODEL.format(bodies=bodies, acting="", more=""))
    data, forces = mujoco.MjData(model), []
    for gap in (0.04, 0.015, 0.006):
        data.qpos[1] = gap - 0.04
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_passive[1])
    assert np.sign(forces).tolist() == [1, -1, 1]
    assert "attract" in str(mm.check(model))


def test_the_order_on_the_rail_and_of_the_bodies_does_not_matter():
    bodies = BODY.format("a", "0 0 0", "", DISC, "a", 0, -1)
    for place in (-0.04, 0.04):
        for joint in (SLIDE, SLIDE.replace("1 0 0", "-1 0 0")):
            own = bodies + BODY.format("b", f"{place} 0 0", joint, DISC, "b", 0, 1)
            text = MODEL.format(bodies=own, acting="", more="")
            assert only_the_frequency(mujoco.MjModel.from_xml_string(text))


DOOR = """
<body name="door"><joint type="{}" axis="0 0 1" {} damping="1e-3"/>
  <geom type="box" size=".05 .002 .05" pos=".05 0 0" mass=".1" contype="0" conaffinity="0"/>
  <site pos="{} 0 0" zaxis="0 1 0" user=".5"/></body>
<site name="latch" pos=".1 .012 0" zaxis="0 1 0" user=".5"/>"""
UNLESS = "unless the limits of their hinges or ball joints keep them apart"
SOFT = "the limit of joint 0 is too soft"


@pytest.mark.parametrize(("kind", "limits", "said"), [
    ("hinge", 'range="-90 0"', SOFT), ("hinge", "", ""), ("ball", 'range="0 30"', UNLESS),
])  # fmt: skip
@pytest.mark.parametrize(("place", "words"), [
    (0.1, "can swing or turn"), (math.hypot(0.1, 0.012), "coincide"),
])  # fmt: skip
def test_it_says_where_limits_of_turns_may_keep_magnets_apart(kind, limits, said, place, words):
    """Limits of balls are not judged."""
    text = MODEL.format(bodies=DOOR.format(kind, limits, place), acting="", more="")
    findings = mm.check(mujoco.MjModel.from_xml_string(text)).findings
    assert words in findings[0]
    assert [each in findings[0] for each in (UNLESS, SOFT)] == [said == UNLESS, said == SOFT]
