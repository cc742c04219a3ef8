"""What `check` takes as the reach of joints: never too little, and no more than it must."""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf.checking.frequencies import frequencies
from magmotor.mjcf.checking.reach import common_ancestor, reach
from magmotor.mjcf.checking.swept import limited_joints

HINGE, BALL = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)

TREE = "<mujoco><worldbody>{}</worldbody></mujoco>"
BODY = '<body pos="{}" euler="{}">{}<geom size="0.01"/>'


def numbers(generator, scale=0.3):
    return " ".join(f"{x:.6f}" for x in generator.uniform(-scale, scale, 3))


def joints(generator, kinds, axis):
    """Joints of one body; slides have a range, and hinges the axis if there is one."""
    text = ""
    for kind in kinds:
        way = axis or numbers(generator)
        limits = 'range="-0.1 0.2"' if kind == "slide" else ""
        direction = "" if kind == "ball" else f'axis="{way}"'
        text += f'<joint type="{kind}" pos="{numbers(generator, 0.1)}" {direction} {limits}/>'
    return text


def random_tree(generator):
    """Two chains that hang on one body; in some, all hinges are parallel, and nothing is turned."""
    axis = generator.choice(["", "", "1 2 2"])
    allowed = ["hinge", "hinge", "slide", "ball"][: 3 if axis else 4]
    bodies = ""
    for depth in generator.integers(1, 4, 2):
        for _ in range(depth):
            turn = "0 0 0" if axis else numbers(generator, 90)
            kinds = generator.choice(allowed, generator.integers(0, 3)).tolist()
            if "ball" in kinds:
                kinds = ["ball"]
            bodies += BODY.format(numbers(generator), turn, joints(generator, kinds, axis))
        bodies += "</body>" * depth
    return mujoco.MjModel.from_xml_string(TREE.format("<body>" + bodies + "</body>"))


def shuffle(model, data, generator):
    """Set all joints at random, slides within their limits."""
    for joint in range(model.njnt):
        place, kind = model.jnt_qposadr[joint], model.jnt_type[joint]
        if kind == BALL:
            turn = generator.normal(size=4)
            data.qpos[place : place + 4] = turn / np.linalg.norm(turn)
        elif kind == HINGE:
            data.qpos[place] = generator.uniform(-np.pi, np.pi)
        else:
            data.qpos[place] = generator.uniform(*model.jnt_range[joint])
    mujoco.mj_kinematics(model, data)


def gaps_and_nearest(model, bodies, offsets, generator, samples):
    """The bounds of two bodies' points, and their least distances in random poses."""
    data = mujoco.MjData(model)
    shuffle(model, data, generator)
    ancestor = common_ancestor(model, *bodies)
    walls = limited_joints(model, *bodies)

    def places(body, own):
        return data.xpos[body] + own @ data.xmat[body].reshape(3, 3).T

    first, second = (reach(model, data, body, ancestor, places(body, own), walls)
                     for body, own in zip(bodies, offsets, strict=True))  # fmt: skip
    nearest = np.full((len(offsets[0]), len(offsets[1])), np.inf)
    for _ in range(samples):
        shuffle(model, data, generator)
        one, other = (places(*each) for each in zip(bodies, offsets, strict=True))
        apart = np.linalg.norm(one[:, np.newaxis] - other, axis=2)
        nearest = np.minimum(nearest, apart)
    return first.gaps(second), nearest


def test_no_pose_is_nearer_than_the_bound():
    """Of 80 random trees, with points of two bodies each, in 100 poses each."""
    generator, positive, ratios = np.random.default_rng(1), 0, []
    for _ in range(80):
        model = random_tree(generator)
        bodies = generator.choice(np.arange(1, model.nbody), 2, replace=False)
        offsets = generator.uniform(-0.5, 0.5, (2, 3, 3))
        gaps, nearest = gaps_and_nearest(model, bodies, offsets, generator, 100)
        assert gaps.shape == (3, 3)
        assert (gaps <= nearest * (1 + 1e-12)).all()
        positive += (gaps > 0).any()
        ratios.append((gaps / nearest).max())
    assert positive > 30  # 58
    assert max(ratios) > 0.99


@pytest.mark.parametrize(("place", "limits", "nearest"), [
    (0.0, "1 2", 0.0), (0.5, "1 2", 0.5), (1.5, "1 2", 1.0), (3.0, "1 2", 1.0),
    (-0.5, "-2 -1", 0.5), (0.0, "-2 -1", 0.0),
])  # fmt: skip
def test_a_slide_outside_of_its_limits_can_be_where_it_is(place, limits, nearest):
    """The least distance from the world's origin, on the way from there to the limits too."""
    joint = f'<joint type="slide" axis="1 0 0" range="{limits}"/>'
    model = mujoco.MjModel.from_xml_string(
        TREE.format(BODY.format("0 0 0", "0 0 0", joint) + "</body>")
    )
    data = mujoco.MjData(model)
    data.qpos[0] = place
    mujoco.mj_kinematics(model, data)
    moved, fixed = (reach(model, data, body, 0, data.xpos[[body]], [0]) for body in (1, 0))
    np.testing.assert_allclose(moved.gaps(fixed), nearest, rtol=1e-15)  # 0


@pytest.mark.parametrize("joint", [
    '<joint axis="1 2 3"/>', '<joint type="ball"/>',
    '<joint type="slide" axis="0 0 1" range="-0.1 0.2"/>',
])  # fmt: skip
def test_two_links_come_as_near_as_the_bound(joint):
    inner = BODY.format("0.1 0.2 0.3", "0 0 0", joint)
    text = TREE.format(BODY.format("0 0 0", "0 0 0", "") + inner + "</body></body>")
    model = mujoco.MjModel.from_xml_string(text)
    generator = np.random.default_rng(2)
    offsets = generator.uniform(-0.5, 0.5, (2, 5, 3))
    gaps, nearest = gaps_and_nearest(model, [1, 2], offsets, generator, 5000)
    assert gaps.min() > 0
    assert (nearest - gaps).min() > -1e-12
    assert (nearest - gaps).max() < 0.02  # of lengths up to 1 m; 0.01


ROD = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <default><geom type="capsule" fromto="0 0 0 0 0 -.1" size=".005" {}/></default>
  <worldbody>{}</worldbody>
</mujoco>"""


def rod(number, site, joint='<joint axis="0 1 0"/>', geom='contype="0" conaffinity="0"'):
    link = f'<body name="{{}}" pos="0 0 {{}}">{joint}<geom/><site pos="{site}" user=".1"/>'
    links = "".join(link.format(k, -0.1 * (k > 0)) for k in range(number))
    return mujoco.MjModel.from_xml_string(ROD.format(geom, links + "</body>" * number))


@pytest.mark.parametrize(("number", "site", "joint", "pairs"), [
    (2, "0 0 -.1", "<joint/>", 0),
    (2, "0 0 -.1", '<joint type="ball"/>', 0),
    (20, "0 0 -.1", '<joint axis="0 1 0"/>', 171),  # all but neighbors
    (2, "0 0 -.05", '<joint axis="0 1 0"/>', 1),  # folded
    (2, "0 0 -.06", '<joint axis="0 1 0"/>', 0),
    (2, "0 0 -.05", '<joint axis="0 1 0" pos="0 0 0.02"/>', 0),
    (3, "0 0.02 -.05", '<joint axis="0 1 0"/>', 3),
])  # fmt: skip
def test_links_whose_dipoles_joints_keep_apart(number, site, joint, pairs):
    """Neighbors in a rod of hinged links have a constant distance, and others can fold."""
    found = [each for each in mm.check(rod(number, site, joint)).findings if "coincide" in each]
    assert len(found) == (pairs > 0)
    if pairs > 1:
        assert f"(and {pairs - 1} more like them)" in found[0]


STEP = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos=".1 0 -.001" user=".1"/>
    <body name="arm" euler="0 0 {}"><joint axis="0 0 1"/>
      <geom type="capsule" fromto="0 0 0 .1 0 0" size=".005" contype="0" conaffinity="0"/>
      <site pos=".1 0 {}" user=".1"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(("height", "found"), [(0, True), (0.02, False)])
def test_dipoles_that_only_joints_keep_apart_may_be_fast(height, found):
    """They pass each other at 1 mm, or at 21 mm."""
    model = mujoco.MjModel.from_xml_string(STEP.format(90, height))
    findings = mm.check(model).findings
    assert len(findings) == found
    if found:
        assert "can swing or turn" in findings[0]
        assert "where their joints let them come nearest" in findings[0]
        near = mujoco.MjModel.from_xml_string(STEP.format(0, height))
        data = mujoco.MjData(near)
        mujoco.mj_fwdPosition(near, data)
        (omega,) = frequencies(near, data).values()
        said = float(findings[0].split("omega = ")[1].split(" rad/s")[0])
        assert 0.9 < said / omega < 3  # a bound that does not know the axes


@pytest.mark.parametrize(
    ("equality", "said"),
    [
        ('<weld body1="one" body2="other"/>', True),
        ('<connect body1="other" anchor="0 0 0"/>', True),
        ('<weld body1="one" body2="other" active="false"/>', False),
        ('<weld body1="third"/>', False),
    ],
)
def test_equality_constraints_are_said_not_to_count(equality, said):
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <custom><text name="magmotor" data="dipoles"/></custom>
      <worldbody>
        <body name="one"><freejoint/><geom size=".01" contype="0"/><site user="1"/></body>
        <body name="other" pos=".1 0 0"><freejoint/><geom size=".01" contype="0"/><site user="1"/>
        </body>
        <body name="third" pos="0 0 9"><freejoint/><geom size=".01"/></body>
      </worldbody>
      <equality>{equality}</equality>
    </mujoco>""")
    (finding,) = [each for each in mm.check(model).findings if "coincide" in each]
    assert ("coincide unless equality constraints keep them apart, since" in finding) == said


def test_a_model_on_which_nothing_acts_is_warned_of_by_its_findings_only(recwarn):
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <extension><plugin plugin="magmotor.forces"><instance name="m"/></plugin></extension>
      <worldbody><body><freejoint/><geom size=".01"/></body></worldbody>
    </mujoco>""")
    recwarn.clear()
    assert "nothing acts" in str(mm.check(model))
    assert not recwarn


PENDULUM = """
<mujoco>
  <extension><plugin plugin="magmotor.forces">
    <instance name="magnets"><config key="act" value="dipoles"/></instance></plugin></extension>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="base" pos=".05 0 .01">
      <geom type="cylinder" size=".01 .004"/><site user="-1"/></body>
    <body name="bob" pos="0 0 {}"><joint {} damping="1e-4"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.36" size=".002" mass=".01"/>
      <geom pos="0 0 -.36" size=".008" density="7500"/><site pos="0 0 -.36" user=".8"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize("joint", ['type="ball"', 'axis="0 1 0"', 'axis="0 1 0" range="-90 90"'])
@pytest.mark.parametrize(("height", "found"), [(0.41, False), (0.37, True)])
def test_geoms_that_joints_keep_apart_do_not_touch(joint, height, found):
    """The bob swings 2 cm above a magnet on the floor, or can touch it."""
    findings = mm.check(mujoco.MjModel.from_xml_string(PENDULUM.format(height, joint))).findings
    assert any("once they touch" in each for each in findings) == found
    assert bool(findings) == found
