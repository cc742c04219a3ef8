"""How near hinges with limits let magnets come, against MuJoCo's own kinematics on a fine grid."""

import itertools
import warnings

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize

import magmotor as mm
from magmotor.mjcf.checking.swept import limited_joints, swept_gaps, swept_joints

MODEL = """
<mujoco>
  <compiler angle="degree"/>
  <option gravity="0 0 0" timestep="1e-4"/>
  <default><geom size=".005" density="7500"/><joint axis="0 1 0" solreflimit="1e-3 1"/></default>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>{}</worldbody>
</mujoco>"""
FRAME = '<body name="frame" pos=".4 0 0"><geom {0}/><site name="frame" user=".05"/></body>'
DOOR = """
<body name="door"><joint name="hinge" axis="0 0 1" range="{0}"/>
  <geom pos=".4 0 0" {1}/><site name="door" pos=".4 0 0" zaxis="0 0 -1" user=".05"/></body>"""
FINGER = """
<body pos="{0} 0 0">
  <joint range="-20 30" axis="0 {1} 0"/><geom pos="0 0 .05"/>
  <body name="{2}" pos="0 0 .1" euler="0 {3} 5">
    <joint range="-10 40" axis="0 {1} .3"/><geom pos="0 0 .04" {4}/>
    <site name="{2}" pos="0 0 .04" user=".05"/><site name="{2}2" pos="0 0 .03" user=".05"/>
  </body>
</body>"""
ARM = """
<body><joint name="turn" axis="0 0 1" range="-60 60"/><geom/>
  <body pos=".1 0 .05"><joint range="20 90"/><geom/>
    <body name="hand" pos=".1 0 0"><joint type="slide" axis="1 0 0" range="0 .04"/>
      <geom pos=".05 0 0" {0}/><site name="hand" pos=".05 0 0" user=".05"/></body></body></body>
<body name="part" pos=".1 .05 -.05"><geom {0}/><site name="part" user=".05"/></body>"""
THROUGH = 'contype="0" conaffinity="0"'


def load(bodies):
    return mujoco.MjModel.from_xml_string(MODEL.format(bodies))


def fingers(apart, more=""):
    return FINGER.format(-apart, 1, "left", 0, more) + FINGER.format(apart, -1, "right", 10, more)


def nearest(model, names, number):
    """The least distances of sites: by a grid over the ranges of all joints, and from there on."""
    data, least, best = mujoco.MjData(model), np.full((4, 4), np.inf), {}
    sites = [[k for k in range(model.nsite) if name in model.site(k).name] for name in names]

    def apart(places):
        data.qpos[:] = places
        mujoco.mj_kinematics(model, data)
        one, other = (data.site_xpos[own] for own in sites)
        return np.linalg.norm(one[:, np.newaxis] - other, axis=-1)

    for places in itertools.product(*(np.linspace(a, b, number) for a, b in model.jnt_range)):
        for pair, value in np.ndenumerate(apart(places)):
            if value < least[pair]:
                least[pair], best[pair] = value, places
    for pair, places in best.items():
        found = minimize(lambda q, pair=pair: apart(q)[pair], places, bounds=model.jnt_range,
                         method="Nelder-Mead", options={"fatol": 1e-9})  # fmt: skip
        least[pair] = min(least[pair], found.fun)
    return least[: len(sites[0]), : len(sites[1])]


def bounds(model, data, bodies, points, normal=None):
    """The lower bounds of the distances of points of two bodies, which all joints move."""
    one, other = bodies
    walls = limited_joints(model, one, other)
    joints = swept_joints(model, one, other, walls)
    assert len(joints) == model.njnt
    return swept_gaps(model, data, joints, walls, (one, other), points, normal)


CASES = [
    (FRAME.format("") + DOOR.format("5 90", ""), ("frame", "door"), 200),
    (FRAME.format("") + DOOR.format("-90 -20", ""), ("frame", "door"), 200),
    (fingers(0.08), ("left", "right"), 9),
    (fingers(0.12), ("left", "right"), 9),
    (ARM.format(""), ("hand", "part"), 15),
]


@pytest.mark.parametrize(("bodies", "names", "number"), CASES)
@pytest.mark.parametrize("start", [0, 1])
def test_the_least_distance_within_limits(bodies, names, number, start):
    """It is a lower bound, from any start; rough where four joints let magnets nearly meet."""
    model, rng = load(bodies), np.random.default_rng(start)
    data = mujoco.MjData(model)
    data.qpos[:] = rng.uniform(*model.jnt_range.T) if start else np.clip(0, *model.jnt_range.T)
    mujoco.mj_forward(model, data)
    one, other = (model.body(name).id for name in names)
    points = [data.site_xpos[[k for k in range(model.nsite) if name in model.site(k).name]]
              for name in names]  # fmt: skip
    found = bounds(model, data, (one, other), points)
    ratio = found / nearest(model, names, number)
    assert (ratio <= 1).all()
    assert (ratio > (0.1 if ratio.size > 1 else 0.95)).all()  # 0.17 and 0.98


SLIDE = 'type="slide" axis="1 0 0" range="0 .2"'
TURN_AND_SLIDE = """
<body><joint axis="0 0 1" range="{0}"/><geom/>
  <body pos=".1 0 0"><joint {1}/><geom pos=".05 0 0"/>
    <site name="hand" pos=".05 0 0" user=".05"/></body></body>
<body name="part" pos="{2}"><geom/><site name="part" user=".05"/></body>"""


@pytest.mark.parametrize(
    ("bodies", "least"),
    [
        # The second hinge has no limits: folded back, it reaches 0.05 m from the first one.
        (TURN_AND_SLIDE.format("-5 5", 'axis="0 0 1"', ".04 0 0"), 0.01),
        # The slide reaches from 0.15 to 0.35 m.
        (TURN_AND_SLIDE.format("-5 5", SLIDE, ".4 0 0"), 0.05),
        (TURN_AND_SLIDE.format("-5 5", SLIDE, ".31 0 .02"), 0.02),
    ],
)
def test_hinges_without_limits_and_slides(bodies, least):
    model = load(bodies)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    points = [data.site_xpos[[k]] for k in range(2)]
    found = bounds(model, data, model.site_bodyid.tolist(), points)[0, 0]
    assert 0.97 * least < found <= least  # 0.98


@pytest.mark.parametrize("height", [0.02, -0.02])
def test_the_least_height_above_a_plane(height):
    """The hand's lowest place is at the largest pitch, fully extended: analytic."""
    model = load(ARM.format(""))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hand = model.body("hand").id
    point, normal = np.array([[0, 0, height]]), np.array([0.0, 0, 1])
    found = bounds(model, data, (hand, 0), [data.site_xpos[[0]], point], normal)
    lowest = 0.05 - 0.19 - height  # the arm of 0.19 m points down
    assert lowest - 0.03 * abs(lowest) < found[0, 0] <= lowest


@pytest.mark.parametrize(
    ("bodies", "said"),
    [
        (FRAME.format(THROUGH) + DOOR.format("5 90", THROUGH), None),
        (FRAME.format(THROUGH) + DOOR.format("0 90", THROUGH), "their dipoles coincide, since"),
        (FRAME.format(THROUGH) + DOOR.format("-90 90", THROUGH), "their dipoles coincide, since"),
        (FRAME.format("") + DOOR.format("5 90", ""), None),
        (fingers(0.12, THROUGH), None),
        (fingers(0.02, THROUGH), "their dipoles coincide, since"),
        (ARM.format(THROUGH), None),
    ],
)
def test_what_limits_of_hinges_keep_apart_is_no_finding(bodies, said):
    model = load(bodies)
    data = mujoco.MjData(model)
    data.qpos[:] = model.jnt_range @ [0.4, 0.6]
    findings = mm.check(model, data).findings
    assert [str(said) in each for each in findings] == [True] * (said is not None)


def test_many_dipoles_are_bounded_by_spheres():
    rng, model = np.random.default_rng(0), load(ARM.format(""))
    data = mujoco.MjData(model)
    data.qpos[:] = model.jnt_range @ [0.5, 0.5]
    mujoco.mj_forward(model, data)
    bodies = model.body("hand").id, model.body("part").id
    clouds = [data.site_xpos[[k]] + rng.uniform(-3e-3, 3e-3, (200, 3)) for k in range(2)]
    found = bounds(model, data, bodies, clouds)
    alone = [cloud[:1] for cloud in clouds]
    sharp = bounds(model, data, bodies, alone)[0, 0]
    assert found.shape == (200, 200)
    assert sharp - 0.03 < found[0, 0] < 1.02 * sharp  # 0.010 less


@pytest.mark.parametrize("place", ["", 'mocap="true"'])
def test_a_mocap_body_above_a_hinge_can_be_anywhere(place):
    """The door that its hinge keeps away may be carried to the magnet."""
    door = DOOR.format("5 90", THROUGH)
    model = load(FRAME.format(THROUGH) + f"<body {place}>{door}</body>")
    data = mujoco.MjData(model)
    data.qpos[:] = 1.0
    assert bool(mm.check(model, data).findings) is bool(place)


def test_a_limit_that_is_too_soft_keeps_nothing_apart():
    """The door swings through its limit to its frame's magnet in MuJoCo, too."""
    door = DOOR.format("1 90", THROUGH)
    for constant, holds in ((1e-3, True), (5.0, False)):
        model = load(
            FRAME.format(THROUGH) + door.replace("/>", f' solreflimit="{constant} 1"/>', 1)
        )
        data, least = mujoco.MjData(model), np.inf
        data.qpos[0] = np.radians(3)
        findings = mm.check(model, data).findings
        assert not findings if holds else "the limit of joint 'hinge' is too soft" in findings[0]
        with mm.magnetism():
            while data.time < 2 and least > 1e-3:
                mujoco.mj_step(model, data)
                least = min(least, 0.4 * abs(data.qpos[0]))
        assert (least > 0.005) == holds  # 0.0067 and 0.0007


def test_a_state_outside_of_the_limits_counts():
    """In MuJoCo, the door swings in through the frame's magnet."""
    model = load(FRAME.format(THROUGH) + DOOR.format("2 90", THROUGH))
    data = mujoco.MjData(model)
    data.qpos[0] = np.radians(-3)
    (finding,) = mm.check(model, data).findings
    assert "their dipoles coincide, since" in finding


LATCH = """
<body name="frame">
  <geom type="box" size=".01 .02 .05" pos=".125 0 0"/>
  <site pos=".1 0 0" zaxis="0 1 0" user=".54"/>
</body>
<body name="door">
  <joint name="hinge" axis="0 0 1" range="0 110" {}/>
  <geom type="box" pos=".05 .012 0" size=".05 .01 .1" mass=".1"/>
  <site pos=".1 .012 0" zaxis="0 1 0" user=".54"/>
</body>"""


def test_a_limit_is_judged_although_geoms_collide_that_do_not_enclose_the_dipoles():
    """With the proposed solreflimit, the door stays slow; with MuJoCo's, it passes the latch."""
    said = "the limit of joint 'hinge' is too soft"
    speeds, limit, findings = [], 'solreflimit=".02 1"', ()
    for _ in range(2):
        model = mujoco.MjModel.from_xml_string(
            MODEL.replace("1e-4", "2e-3").format(LATCH.format(limit))
        )
        findings, data, fastest = mm.check(model).findings, mujoco.MjData(model), 0.0
        data.qpos[0] = 0.1
        with mm.magnetism(), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that the door flies
            for _ in range(1000):
                mujoco.mj_step(model, data)
                fastest = max(fastest, abs(data.qvel[0]))
        speeds.append(fastest)
        if findings:
            assert said in findings[0]
            limit = findings[0].split("give joint 'hinge' ")[1]
    assert findings == ()
    assert limit == 'solreflimit="0.0042 1"'
    assert speeds[0] > 1e3  # 1e5
    assert speeds[1] < 20  # 13
