"""`check` of magnets that other geoms of their body, or wheels on it, keep off a plane of iron."""

import itertools

import mujoco
import numpy as np
import pytest
from only_meeting import meeting

import magmotor as mm
from magmotor.mjcf.checking.closest_approach import meetings
from magmotor.mjcf.checking.covers import Covers
from magmotor.mjcf.checking.geoms import touching_geoms
from magmotor.mjcf.checking.poses import Freedom
from magmotor.mjcf.checking.stand_off import stand
from magmotor.mjcf.checking.strengths import magnets_of

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

SCENE = """
<mujoco>
  <option {option}/>
  <custom>
    <text name="magmotor" data="dipoles iron coils"/><numeric name="steel" data="1000"/>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/><element objtype="geom" objname="wall"/>
    </tuple>{custom}
  </custom>
  <worldbody><geom name="wall" {wall}/>{bodies}</worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""
PLANE = 'type="plane" size="1 1 1"'


def load(bodies, wall=PLANE, custom="", actuators="", option='gravity="0 0 0"'):
    text = SCENE.format(bodies=bodies, wall=wall, custom=custom, actuators=actuators, option=option)
    return mujoco.MjModel.from_xml_string(text)


# A robot on a vertical wall -----------------------------------------------------------------------

RADIUS, STAND_OFF, THICKNESS = 0.02, 3.4e-3, 5e-3
ROBOT = """
<body name="robot" pos="{} 0 0" xyaxes="0 0 1 0 -1 0"><freejoint/>
  <geom name="chassis" type="box" size=".05 .03 .01" pos="0 0 .005" mass="2"/>{}{}
</body>"""
WHEEL = """
<body pos="{} {} 0"><joint name="axle {}" axis="0 1 0" armature="2e-4" damping="1e-4"/>
  <geom name="wheel {}" type="cylinder" size="{} .005" euler="90 0 0" mass=".02"/></body>"""
VERTICAL = 'type="plane" size="1 1 1" euler="0 90 0"'
SLAB = 'type="box" size=".005 1 1" pos="-.005 0 0"'


def robot(wheels=True, wall=VERTICAL):
    """Its wheels keep two magnets, clusters of dipoles in cylinders, off the wall."""
    magnet = mm.magnet("cylinder", (0.02, THICKNESS), grade="N42").mjcf(0.1, 5e-3)
    height = STAND_OFF + THICKNESS / 2 - RADIUS
    magnets = "".join(f'<body pos="{x} 0 {height}">{magnet}</body>' for x in (-0.03, 0.03))
    corners = [*itertools.product((-0.05, 0.05), (-0.04, 0.04))]
    parts = [WHEEL.format(x, y, k, k, RADIUS) for k, (x, y) in enumerate(corners)]
    motors = "".join(f'<velocity joint="axle {k}" kv=".05"/>' for k in range(4))
    return load(
        ROBOT.format(RADIUS, magnets, "".join(parts) if wheels else ""),
        wall=wall, actuators=motors if wheels else "", option="",
    )  # fmt: skip


def test_a_robot_that_climbs_is_not_said_to_fall():
    """The force is that of the model at touch, and what is said of its rest is what happens."""
    model = robot()
    found = mm.check(model)
    (finding,) = found.findings
    assert "fly apart" not in finding
    assert "will stick" in finding
    assert found.timestep == model.opt.timestep
    data, heights = mujoco.MjData(model), []
    with mm.magnetism():
        mujoco.mj_forward(model, data)
        force = -data.xfrc_applied[:, 0].sum()
        for speed in (0, 5):
            data.ctrl[:] = speed
            mujoco.mj_step(model, data, nstep=500)
            heights.append(data.qpos[:3].copy())
    said = float(finding.split("with up to about ")[1].split(" N")[0])
    assert said == pytest.approx(force, rel=2e-3)  # 3 digits
    rest = float(finding.split("by up to ")[1].split(" %")[0]) / 100
    dipole = STAND_OFF + 2.5e-3
    assert 0.5 * rest < (RADIUS - heights[0][0]) / dipole < rest  # 0.041 of 0.059
    assert heights[1][2] > heights[0][2] + 0.03  # it climbs by 0.042 m
    assert heights[1][0] == pytest.approx(RADIUS, abs=1e-3)


def test_fix_softens_no_robot_and_shortens_no_timestep():
    model = robot()
    found = mm.check(model, fix=True)
    assert model.opt.timestep == 0.002
    assert {f"geom 'wheel {k}'" for k in range(4)} <= {*found.solref}
    assert mm.check(model).findings == ()


def test_a_chassis_without_wheels_is_found():
    found = mm.check(robot(wheels=False))
    assert "fly apart or fall through once they touch" in found.findings[0]
    assert found.timestep < 1.5e-3  # 1.2e-3


# What counts --------------------------------------------------------------------------------------

CART = '<body name="cart" pos="0 0 .1"><freejoint/><geom size=".005"/><site user=".01"/>{}</body>'
ON_AXLE = '<body pos="{}"><joint {}/><geom type="{}" size="{}" euler="{}" {}/></body>'
OFF = 'contype="0" conaffinity="0"'


@pytest.mark.parametrize(("joint", "kind", "size", "euler", "off", "counts"), [
    ('axis="0 1 0"', "sphere", ".03", "0 0 0", "", True),
    ('axis="0 1 0"', "cylinder", ".03 .01", "90 0 0", "", True),
    ('axis="0 1 0"', "capsule", ".03 .01", "90 0 0", "", True),
    ('axis="0 1 0"', "ellipsoid", ".03 .03 .01", "90 0 0", "", True),
    ('axis="0 1 0"', "ellipsoid", ".03 .02 .01", "90 0 0", "", False),
    ('axis="0 1 0"', "cylinder", ".03 .01", "0 0 0", "", False),
    ('axis="0 1 0"', "box", ".03 .03 .01", "90 0 0", "", False),
    ('axis="0 1 0" pos="0 0 .01"', "sphere", ".03", "0 0 0", "", False),
    ('axis="0 1 0" pos="0 .01 0"', "sphere", ".03", "0 0 0", "", True),
    ('type="ball"', "sphere", ".03", "0 0 0", "", True),
    ('type="ball"', "cylinder", ".03 .01", "90 0 0", "", False),
    ('type="slide"', "sphere", ".03", "0 0 0", "", False),
    ('axis="0 1 0"', "sphere", ".03", "0 0 0", OFF, False),
])  # fmt: skip
def test_only_what_joints_leave_in_place_keeps_magnets_off(joint, kind, size, euler, off, counts):
    """The wheel is about the dipole, 5 mm from its own surface."""
    wheel = ON_AXLE.format("0 0 0", joint, kind, size, euler, off)
    model = load(CART.format(wheel))
    _, found = meeting(model)
    assert found.approach is not None
    nearest = 0.01 if kind != "sphere" else 0.03  # half the width of a wheel, or its radius
    if kind == "capsule":
        nearest = 0.03
    assert found.approach.depth == pytest.approx(nearest if counts else 5e-3, rel=1e-3)


def test_carts_with_and_without_wheels_are_not_alike():
    wheel = ON_AXLE.format("0 0 0", 'axis="0 1 0"', "sphere", ".03", "0 0 0", "")
    bare = CART.format("").replace("cart", "bare").replace("0 0 .1", ".2 0 .1")
    model = load(CART.format(wheel) + bare)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    depths = {
        pair.magnets[0].name(model): pair.approach.depth
        for pair in meetings(model, data) if pair.magnets[1].images and pair.approach
    }  # fmt: skip
    assert depths == pytest.approx({"body 'cart'": 0.03, "body 'bare'": 5e-3})


def set_down(data, direction):
    """Turn the free body so that what is in a direction now points down."""
    axis = np.cross(direction, [0, 0, -1])
    size = np.linalg.norm(axis)
    axis = axis / size if size > 1e-9 else np.array([1.0, 0, 0])
    mujoco.mju_axisAngle2Quat(data.qpos[3:7], axis, np.arctan2(size, -direction[2]))


def random_body(generator):
    """A body with three geoms, two dipoles among them, and three wheels."""

    def numbers(scale):
        return " ".join(f"{x:.6f}" for x in generator.uniform(-scale, scale, 3))  # fmt: skip

    kinds = generator.choice(["sphere", "capsule", "cylinder", "ellipsoid", "box"], 3)
    parts = [f'<geom type="{kind}" size=".01 .02 .03" pos="{numbers(0.05)}" euler="{numbers(90)}"/>'
             for kind in kinds]  # fmt: skip
    parts += [f'<site pos="{numbers(0.03)}" user="1e-3"/>' for _ in range(2)]
    for kind in generator.choice(["sphere", "capsule", "cylinder"], 3):
        geom = f'<geom type="{kind}" size=".03 .01"/>'
        parts.append(f'<body pos="{numbers(0.06)}" euler="{numbers(90)}"><joint axis="0 0 1"/>'
                     f"{geom}</body>")  # fmt: skip
    return load('<body name="b" pos="0 0 1"><freejoint/>' + "".join(parts) + "</body>")


def test_no_orientation_brings_a_dipole_nearer_to_the_plane():
    """Of 20 random bodies with wheels, in 300 orientations each, by MuJoCo's distances."""
    generator, ratios = np.random.default_rng(1), []
    for _ in range(20):
        model = random_body(generator)
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        magnet, plane = magnets_of(model, data)
        rows = touching_geoms(model)
        covers = Covers(model, data)
        assert len(covers.rows(magnet, plane, rows)) == 3
        freedom = Freedom(model, data, (magnet, plane), [])
        geoms = np.arange(1, model.ngeom)
        found = stand(model, data, (magnet, plane), geoms, 0.0, covers, freedom)
        assert found is not None
        lowest, bound = np.full(2, np.inf), found.heights.min(axis=0)
        directions = [
            *found.directions[found.heights.argmin(axis=0)],
            *generator.normal(size=(300, 3)),
        ]
        for direction in directions:
            set_down(data, direction)
            data.qpos[7:] = generator.uniform(-np.pi, np.pi, 3)
            mujoco.mj_kinematics(model, data)
            nearest = min(mujoco.mj_geomDistance(model, data, 0, geom, 9.0, None)
                          for geom in range(1, model.ngeom))  # fmt: skip
            lowest = np.minimum(lowest, data.site_xpos[:, 2] - nearest)
        assert (lowest > bound - 3e-12 * abs(bound)).all()
        ratios.append(abs(lowest / bound - 1).max())
    assert max(ratios) < 3e-12  # 1.3e-13


# The force ----------------------------------------------------------------------------------------

CLUSTER = '<body name="b" pos="0 0 {}" quat="{}"><freejoint/>{}</body>'


def test_no_orientation_has_a_stronger_force_than_is_said():
    """Six clusters of dipoles in boxes and cylinders, in more than 500 orientations each."""
    generator, ratios = np.random.default_rng(1), []
    for kind, number in itertools.product(("box", "cylinder"), (1, 3, 8)):
        sites = "".join(
            f'<site pos="{x} {y} {z}" zaxis="{u} {v} {w}" user="{generator.uniform(-1, 1)}"/>'
            for x, y, z, u, v, w in zip(*generator.uniform(-5e-3, 5e-3, (6, number)), strict=True)
        )
        body = f'<geom type="{kind}" size=".012 .012 .012"/>{sites}'
        model = load(CLUSTER.format(0.1, "1 0 0 0", body))
        data, found = meeting(model)
        freedom, covers = Freedom(model, data, found.magnets, []), Covers(model, data)
        best = stand(model, data, found.magnets, np.array([1]), 0.0, covers, freedom)
        assert best is not None
        largest, others = 0.0, generator.normal(size=(200, 3))
        for direction in (*best.directions, *others):
            set_down(data, direction)
            data.qpos[2] = 0.1
            mujoco.mj_kinematics(model, data)
            data.qpos[2] -= mujoco.mj_geomDistance(model, data, 0, 1, 9.0, None)
            with mm.magnetism():
                mujoco.mj_forward(model, data)
            largest = max(largest, -data.xfrc_applied[1, 2])
        ratios.append(largest / found.approach.force)
    assert ratios == pytest.approx([1] * 6, rel=1e-13)  # 6e-15


def test_the_force_of_free_dipoles_on_a_plane_is_about_what_is_said():
    """Balls with dipoles in random directions, in 2000 random orientations each."""
    ratios = []
    for number, seed in ((3, 0), (5, 1), (8, 2)):
        generator = np.random.default_rng((number, seed))
        sites = "".join(
            f'<site pos="{x} {y} {z}" zaxis="{u} {v} {w}" user="0.01"/>'
            for x, y, z, u, v, w in generator.normal(scale=1.5e-3, size=(number, 6))
        )
        model = load(CLUSTER.format(5e-3, "1 0 0 0", f'<geom size=".005"/>{sites}'))
        data, found = meeting(model)
        forces = []
        with mm.magnetism():
            for quaternion in generator.normal(size=(2000, 4)):
                data.qpos[3:] = quaternion
                mujoco.mj_forward(model, data)
                forces.append(-data.xfrc_applied[1, 2])
        ratios.append(max(forces) / found.approach.pull)
        assert "attract each other with up to about" in str(mm.check(model))
    assert 1 < max(ratios) < 1.03  # 1.008


def test_dipoles_that_several_coils_drive_count_as_aligned():
    sites = '<site name="u" pos=".003 0 0" user="1"/><site name="v" pos="-.003 0 0" user="-1"/>'
    body = CLUSTER.format(0.1, "1 0 0 0", f'<geom type="box" size=".005 .005 .005"/>{sites}')
    coil = """<tuple name="coil {0}"><element objtype="actuator" objname="{0}" prm="0"/>
    <element objtype="site" objname="{0}"/></tuple>"""
    motor = '<general name="{0}" site="{0}" gainprm="0" ctrlrange="-1 1"/>'
    forces = []
    for names in ("", "uv"):
        custom, motors = ("".join(map(text.format, names)) for text in (coil, motor))
        forces.append(meeting(load(body, custom=custom, actuators=motors))[1].approach.force)
    assert forces[1] > 1.2 * forces[0]
