"""Whether limits of joints keep magnets apart: what `check` says, and what MuJoCo does."""

import math

import mujoco
import pytest

import magmotor as mm

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MODEL = """
<mujoco>
  <option gravity="0 0 0" timestep="{step}"/>
  <default><geom density="7500"/>
    <joint type="slide" axis="0 0 1" solreflimit="{limit}" solimplimit="{impedance}"/></default>
  <custom><text name="magmotor" data="dipoles iron"/>{custom}</custom>
  <worldbody>{bodies}</worldbody>
</mujoco>"""
MAGNET = '<geom size=".005"/><site user=".54"/>'
FIXED = f'<body name="a">{MAGNET}</body>'
RAIL = '<joint name="rail" range="{} 1"/>'
ACROSS = '<joint name="across" axis="1 0 0" range="-.01 .01" solreflimit=".5 1"/>'
ONE = FIXED + f'<body name="b" pos="0 0 .03">{{}}{RAIL.format(-0.019)}{MAGNET}</body>'
CARRIAGE = (
    FIXED
    + f"""
<body name="carriage" pos="0 0 .03">{RAIL.format(-0.019)}
  <geom type="box" size=".02 .02 .002" pos="0 0 .1" density="1e5"/>
  <body name="b"><joint type="hinge" axis="0 1 0" pos="0 0 .1"/>{MAGNET}</body>
</body>"""
)
TWO = f"""
<body name="a"><joint name="lower" range="-1 .0095"/>{MAGNET}</body>
<body name="b" pos="0 0 .03">{RAIL.format(-0.0095)}{MAGNET}</body>"""
PLANE = f"""<geom name="plane" type="plane" size="1 1 1"/>
<body name="b" pos="0 0 .015">{RAIL.format(-0.0095)}{MAGNET}</body>"""
IRON = """<numeric name="steel" data="1000"/>
<tuple name="iron"><element objtype="numeric" objname="steel"/>
<element objtype="geom" objname="plane"/></tuple>"""
TOUCH, LIMIT = 0.01, 0.011
"""Distances of the centers, or of a center from its image, in m."""


def load(constant, bodies, custom="", impedance=".9 .95 .001", ratio=1.0):
    """A model whose limits have a time constant, and whose timestep resolves them."""
    text = MODEL.format(
        step=constant / 20 / max(ratio, 1 / ratio),
        limit=f"{constant} {ratio}",
        impedance=impedance,
        custom=custom,
        bodies=bodies,
    )
    return mujoco.MjModel.from_xml_string(text)


def room_left(model):
    """Least distance from touch of magnets that fall, over that of their limits; 0: they touch."""
    data, nearest, images = mujoco.MjData(model), math.inf, 2 if "plane" in str(model.names) else 1
    with mm.magnetism():
        while data.time < 0.05 * max(1, model.body_subtreemass[0] / 0.004) ** 0.5:
            mujoco.mj_step(model, data)
            height = data.body("b").xpos[2] - (data.xpos[1][2] if images == 1 else 0)
            nearest = min(nearest, images * height)
            if data.ncon or data.warning.number.any():
                return 0.0
    return (nearest - TOUCH) / (LIMIT - TOUCH)


@pytest.mark.parametrize(("geometry", "left"), [
    ({"bodies": ONE.format("")}, 0.81),
    ({"bodies": ONE.format(ACROSS)}, 0.81),
    ({"bodies": CARRIAGE}, 0.81),
    ({"bodies": TWO}, 0.88),
    ({"bodies": PLANE, "custom": IRON}, 0.81),
    ({"bodies": ONE.format(""), "impedance": ".5 .6 .01"}, 0.78),
    ({"bodies": ONE.format(""), "ratio": 4.0}, 0.94),
    ({"bodies": ONE.format(""), "ratio": 0.3}, 0.75),
])  # fmt: skip
def test_the_softest_limit_that_check_accepts(geometry, left):
    """It gives a quarter of the distance from touch at most; much softer ones let magnets touch.

    Of several slides, each may give an equal part. `left` is measured.
    """
    low, high = 1e-6, 0.1
    while high / low > 1.01:
        constant = math.sqrt(low * high)
        holds = not mm.check(load(constant, **geometry)).findings
        low, high = (constant, high) if holds else (low, constant)
    assert room_left(load(low, **geometry)) == pytest.approx(left, abs=0.03)
    assert room_left(load(32 * low, **geometry)) == 0


def test_limits_are_judged_again_without_those_that_are_too_soft():
    """Without its soft neighbor, a limit must hold magnets that come nearer to each other."""
    body = """
    <body name="b" pos=".03 0 .0111">
      <joint axis="1 0 0" range="-.005 1" solreflimit="{} 1"/>
      <joint axis="0 0 1" range="0 1" solreflimit="{} 1"/>
      <joint type="ball"/><geom size=".005"/><site user=".54"/>
    </body>"""
    one, other, soft = (
        load(1e-4, FIXED + body.format(*each)) for each in ((1, 1e-4), (5e-4, 3e-3), (1, 3e-3))
    )
    assert mm.check(one).findings == mm.check(other).findings == ()
    assert "the limit of joint 0 is too soft" in mm.check(soft).findings[0]


ELBOW = """
<body name="part" pos=".4 0 0"><geom contype="0"/><site user=".05"/></body>
<body><joint name="one" type="hinge" range="3 90" solreflimit="{} 1"/>
  <geom size=".01" pos=".1 0 0" contype="0"/>
  <body pos=".2 0 0"><joint name="two" type="hinge" range="0 170" solreflimit="{} 1"/>
    <geom pos=".2 0 0" contype="0"/>
    <site pos=".2 0 0" zaxis="0 0 -1" user=".05"/></body></body>"""


@pytest.mark.parametrize(("one", "two", "named"), [
    (0.02, 0.02, 'limit of joint \'two\' is too soft; give joint \'two\' solreflimit="0.017 1"'),
    (0.02, 0.017, ""),
    (0.2, 0.01, "limit of joint 'one' is too soft"),
])  # fmt: skip
def test_the_limit_is_named_whose_remedy_is_mildest(one, two, named):
    model = load(1e-2, ELBOW.format(one, two).replace("<geom ", '<geom size=".005" ', 1)
                 .replace('<geom pos', '<geom size=".005" pos'))  # fmt: skip
    data = mujoco.MjData(model)
    data.qpos[:] = 0.06
    findings = mm.check(model, data).findings
    assert [named in each for each in findings] == [True] * bool(named)


TELESCOPE = """
<body name="frame" pos=".4 0 0"><geom size=".005" contype="0"/><site user=".05"/></body>
<body><joint name="hinge" type="hinge" range="2 90"/><geom size=".02" contype="0"/>
  <body pos=".001 0 0">
    <joint name="slide" axis="1 0 0" range="0 .399" solreflimit="1e-3 1"/>
    <geom size=".005" contype="0"/><site zaxis="0 0 -1" user=".05"/></body></body>"""


@pytest.mark.parametrize("out", [0.0, 0.399])
def test_a_limit_must_hold_the_longest_arm(out):
    """A hand that is drawn in may move out: the verdict is that of all poses."""
    model = load(2e-2, TELESCOPE.replace("/>", "/>", 1))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.1, out
    (finding,) = mm.check(model, data).findings
    assert "the limit of joint 'hinge' is too soft; give joint 'hinge' solreflimit=" in finding
