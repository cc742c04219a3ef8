"""What `check` reads from a model: contacts, limits, masses, couplings, coils, iron."""

import math

import mujoco
import numpy as np
import pytest
from only_meeting import meeting

import magmotor as mm
from magmotor.mjcf.checking.frequencies import frequency_at_touch

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MU0 = 4e-7 * np.pi
MOMENT, RADIUS = 0.54, 5e-3
FORCE = 3 * MU0 * MOMENT**2 / (2 * np.pi * (2 * RADIUS) ** 4)

MODEL = """
<mujoco>
  <option gravity="0 0 0" {option}><flag {flag}/></option>
  <custom><text name="magmotor" data="dipoles couplings coils iron"/>{custom}</custom>
  <worldbody>{bodies}</worldbody>
  {more}
</mujoco>"""
BALL = """<body name="{0}" pos="{1}">{2}
<geom name="{0}" size="0.005" density="7500"/><site name="{0}" user="0.54" zaxis="{3}"/></body>"""


def ball(name, place, joint="<freejoint/>", axis="0 0 1"):
    return BALL.format(name, place, joint, axis)


def load(bodies, option="", flag="", custom="", more=""):
    text = MODEL.format(bodies=bodies, option=option, flag=flag, custom=custom, more=more)
    return mujoco.MjModel.from_xml_string(text)


def farthest_and_deepest(model, duration):
    """Largest distance of the last two bodies, and largest penetration over the radius."""
    data, distances = mujoco.MjData(model), []
    with mm.magnetism():
        while data.time < duration:
            mujoco.mj_step(model, data)
            distances.append(np.linalg.norm(data.xpos[-1] - data.xpos[-2]))
    return max(distances), 2 - min(distances) / RADIUS


# Contact pairs and margins -----------------------------------------------------------------------

FOUR = ball("a", "0 0 0") + ball("b", "0 0 .03") + ball("c", "1 0 0") + ball("d", "1 0 .03")


@pytest.mark.parametrize("soft", ["", 'solref="0.02 1"', 'solref="1e-4 1" solimp="0.1 0.2"'])
def test_contact_pairs_of_bodies_that_are_alike(soft):
    """The pair of a and b holds, and the other one of c and d does not."""
    pairs = f"""<contact><pair geom1="a" geom2="b" solref="1e-4 1"/>
    <pair geom1="c" geom2="d" {soft}/></contact>"""
    model = load(FOUR, more=pairs, option='timestep="5e-5"')
    model.geom_solref[:] = 1e-4, 1
    found = mm.check(model, fix=True)
    assert [*found.solref] == ["pair 1"]
    assert found.findings[0].startswith("bodies 'c' and 'd' will ")
    assert mm.check(model).findings == ()


@pytest.mark.parametrize("override", [False, True])
def test_margins_of_contact_pairs_and_of_the_option(override):
    pair = '<contact><pair geom1="a" geom2="b" margin="0.003"/></contact>'
    model = load(ball("a", "0 0 0") + ball("b", "0 0 .03"), more="" if override else pair)
    if override:
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
        model.opt.o_margin = 0.003
    _, found = meeting(model)
    assert found.approach.distance == pytest.approx(0.013, rel=1e-14)


# Limits of joints --------------------------------------------------------------------------------

SLIDE = '<joint name="rail" type="slide" axis="0 0 1" range="-.004 1" {}/>'


@pytest.mark.parametrize(("constant", "step", "holds"), [
    (0.02, 2e-3, False), (2e-3, 1e-4, False), (1e-4, 2e-5, True),
])  # fmt: skip
def test_a_limit_that_is_too_soft_keeps_no_magnets_apart(constant, step, holds):
    """It stops a ball 1 mm before that touches another one, or does not."""
    joint = SLIDE.format(f'solreflimit="{constant} 1"')
    model = load(ball("a", "0 0 0", "") + ball("b", "0 0 .015", joint), f'timestep="{step}"')
    assert (farthest_and_deepest(model, 0.01)[1] < 0) == holds
    findings = mm.check(model, fix=True).findings
    assert (findings == ()) == holds
    if not holds:
        assert "(the limit of joint 'rail' is too soft to keep them apart);" in findings[0]
        farthest, deepest = farthest_and_deepest(model, 0.01)
        assert farthest < 0.0151
        assert deepest < 0.25  # 0.2


@pytest.mark.parametrize("solref", ["0.02 0", "0.02 -2", "0.004 0.01", "-1e9 -1e3"])
def test_limits_that_mujoco_replaces_or_that_no_timestep_resolves(solref):
    """MuJoCo takes 0.02 1 for a mixture of both formats; the others are stiff, not damped."""
    joint = SLIDE.format(f'solreflimit="{solref}"')
    model = load(ball("a", "0 0 0", "") + ball("b", "0 0 .015", joint))
    assert "(the limit of joint 'rail' is too soft to keep them apart)" in str(mm.check(model))
    data, nearest = mujoco.MjData(model), math.inf
    with mm.magnetism():
        for _ in range(20):
            mujoco.mj_step(model, data)
            nearest = min(nearest, np.linalg.norm(data.xpos[-1] - data.xpos[-2]))
    lost = data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number > 0
    assert lost or nearest < 0.0105  # the limit is at 0.011


# Masses ------------------------------------------------------------------------------------------

ARM = """<body pos="0 -.1 0"><joint axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 0 .09 0" size=".001" density="10" contype="0" conaffinity="0"/>
{}</body>"""


def test_joints_do_not_make_a_magnet_lighter():
    """The inverse mass that MuJoCo assumes is a mean over three axes, only one of which moves."""
    moving = ARM.format(ball("b", "0 .1 0", "", "1 0 0"))
    model = load(ball("a", ".03 0 0", "", "1 0 0") + moving)
    _, found = meeting(model)
    mass = model.body_subtreemass[model.body("b").id - 1]
    assert found.approach.least_mass == pytest.approx(mass, rel=1e-14)
    assert found.approach.mass > 2.9 * mass
    mm.check(model, fix=True)
    data, deepest = mujoco.MjData(model), 0.0
    with mm.magnetism():
        while data.time < 0.1:
            mujoco.mj_step(model, data)
            deepest = max([deepest, *-data.contact.dist])
    assert 0.02 < deepest / RADIUS < 0.25  # 0.13; with the other mass 0.37


# Damping -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("solref", ["0.016 0.02", "0.1 0.003", "1 0.0003", "-1e7 -1", "-1e7 -100"])
def test_contacts_with_little_damping_are_found(solref):
    """They are as stiff as those that hold with damping, and half as deep again at impact."""
    model = load(ball("a", "0 0 0") + ball("b", "0 0 .03"), 'timestep="2e-5"')
    model.geom_solref[:] = [float(word) for word in solref.split()]
    finding = mm.check(model).findings[0]
    says = float(finding.split("and by up to ")[1].split(" %")[0]) / 100
    _, deepest = farthest_and_deepest(model, 0.03)
    assert 0.9 * says < deepest < says  # 0.93 .. 0.98
    mm.check(model, fix=True)
    assert farthest_and_deepest(model, 0.03)[1] < 0.25  # 0.19


# Forces ------------------------------------------------------------------------------------------


def test_couplings_multiply_the_force():
    custom = """<tuple name="coupling"><element objtype="body" objname="a" prm="3"/>
    <element objtype="body" objname="b" prm="3"/></tuple>"""
    bodies = ball("a", "0 0 0") + ball("b", "0 0 .03")
    _, found = meeting(load(bodies, custom=custom))
    assert found.approach.force == pytest.approx(3 * FORCE, rel=1e-14)


COIL = """<tuple name="coil"><element objtype="actuator" objname="i"/>
<element objtype="{}" objname="a"/></tuple>"""


@pytest.mark.parametrize("kind", ["site", "body"])
@pytest.mark.parametrize(("actuator", "flag", "drive"), [
    ('ctrlrange="-3 1"', "", 3), ('ctrlrange="-3 1"', 'clampctrl="disable"', None),
    ('ctrlrange="-3 1" dyntype="filter" dynprm="1"', "", 3),
    ('ctrlrange="-3 1" dyntype="integrator"', "", None),
    ('ctrlrange="-3 1" dyntype="integrator" actrange="-1 5"', "", 5),
    ('ctrlrange="-3 1" ctrllimited="false"', "", None),
])  # fmt: skip
def test_the_largest_drive_of_a_coil(kind, actuator, flag, drive):
    """`None`: nothing bounds it, and it is taken at drive 1."""
    coil = f'<actuator><general name="i" site="a" gainprm="0" {actuator}/></actuator>'
    bodies = ball("a", "0 0 0") + ball("b", "0 0 .03")
    model = load(bodies, custom=COIL.format(kind), more=coil, flag=flag)
    _, found = meeting(model)
    assert found.approach.force == pytest.approx((drive or 1) * FORCE, rel=1e-14)
    assert ("at drive 1 of actuator 'i', which nothing bounds" in str(mm.check(model))) == (
        not drive
    )


def test_the_frequency_of_two_needles_that_touch():
    """Head to tail, the stiffness against opposite turns is 3 mu0 m^2/(4 pi d^3)."""
    model = load(ball("a", "0 0 0") + ball("b", "0 0 .03"))
    model.body_inertia[:] *= 0.01
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data, found = meeting(model)
    stiffness = 3 * MU0 * MOMENT**2 / (4 * np.pi * (2 * RADIUS) ** 3)
    omega = frequency_at_touch(model, data, found.magnets, found.approach)
    assert omega == pytest.approx(np.sqrt(stiffness / model.body_inertia[1, 0]), rel=1e-14)


def test_diamagnets_attract_no_magnets():
    graphite = """<numeric name="graphite" data="-0.5"/><tuple name="iron">
    <element objtype="numeric" objname="graphite"/>
    <element objtype="geom" objname="plate"/></tuple>"""
    plate = '<body pos="0 0 .008"><freejoint/><geom name="plate" type="box" size=".002 .002 .002"/>'
    model = load(ball("a", "0 0 0", "") + plate + "</body>", 'timestep="1e-4"', custom=graphite)
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    assert data.xfrc_applied[-1, 2] > 0.01
    assert mm.check(model).findings == ()
