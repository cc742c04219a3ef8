"""`check` predicts what touching magnets do at any settings, and at its own settings they stick."""

import itertools
import re

import mujoco
import numpy as np
import pytest
from pairwise import pairwise
from refusals import refused

import magmotor as mm
from magmotor.mjcf.checking.closest_approach import meetings
from magmotor.mjcf.checking.contact_rule import softness
from magmotor.mjcf.checking.depth import depth_and_normal
from magmotor.mjcf.checking.frequencies import frequencies

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MU0 = 4e-7 * np.pi
NEODYMIUM, STRONGEST = 7500.0, 1.45
"""Density in kg/m^3 and largest remanence in T."""

MODEL = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>{bodies}</worldbody>
  <contact>{contact}</contact>
</mujoco>
"""


def magnet(name, place, radius, *, remanence, density, free=True, axis=(0, 0, 1), shape="sphere"):
    """A body of one material: a ball with one dipole, a box with eight, or a cylinder with three.

    `radius` is half the length of all edges.
    """
    volume = {"sphere": 4 / 3 * np.pi, "box": 8, "cylinder": 2 * np.pi}[shape] * radius**3
    near = radius / 2
    points = {
        "sphere": [(0, 0, 0)],
        "box": [*itertools.product((-near, near), repeat=3)],
        "cylinder": [(x * near, y * near, 0) for x, y in ((1, 0), (-0.5, 0.866), (-0.5, -0.866))],
    }[shape]
    moment = remanence * volume / MU0 / len(points)
    zaxis = "{} {} {}".format(*axis)
    sites = "".join(
        f'<site pos="{x} {y} {z}" zaxis="{zaxis}" user="{moment}"/>' for x, y, z in points
    )
    return f"""<body name="{name}" pos="0 0 {place}">{"<freejoint/>" * free}
      <geom name="{name}" type="{shape}" size="{radius} {radius} {radius}" density="{density}"/>
      {sites}</body>"""


def pair(radius=5e-3, *, other=None, gap=0.0, fixed=False, pose="head-on", option="", contact="",
         remanence=STRONGEST, density=NEODYMIUM, shape="sphere"):  # fmt: skip
    """A model of two magnets `gap` apart that attract each other."""
    other = other or radius
    axes = {"head-on": [(0, 0, 1)] * 2, "side by side": [(1, 0, 0), (-1, 0, 0)]}[pose]
    common = {"remanence": remanence, "density": density, "shape": shape}
    bodies = [
        magnet("left", 0, radius, free=not fixed, axis=axes[0], **common),
        magnet("right", radius + other + gap, other, axis=axes[1], **common),
    ]
    text = MODEL.format(option=option, bodies="".join(bodies), contact=contact)
    return mujoco.MjModel.from_xml_string(text)


def own_time(radius, remanence, density, fixed):
    """sqrt(d m/F) of two equal balls that touch."""
    mass = density * 4 / 3 * np.pi * radius**3
    moment = remanence * 4 / 3 * np.pi * radius**3 / MU0
    distance = 2 * radius
    force = 3 * MU0 * moment**2 / (2 * np.pi * distance**4)
    return np.sqrt(distance * (mass if fixed else mass / 2) / force), force * distance / 3


def motion(model, duration, spin=0.0, every=4):
    """Distances of two magnets at each step, and some of the energies, kinetic and magnetic."""
    data = mujoco.MjData(model)
    data.qvel[-3:] = spin * np.array([0.6, 0, 0.8])
    mujoco.mj_forward(model, data)
    energies, distances = [energy(model, data)], []
    for step in range(int(duration / model.opt.timestep)):
        try:
            mujoco.mj_step(model, data)
        except mujoco.FatalError as error:
            if "coincide" not in str(error):
                raise
            distances.append(0.0)
            break
        distances.append(float(np.linalg.norm(data.xpos[2] - data.xpos[1])))
        if step % every == 0:
            energies.append(energy(model, data))
    return np.array(distances), np.array(energies)


def energy(model, data):
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_energyVel(model, data)
    return mm.magnetic_energy(model, data) + data.energy[1]


def growth_after_touch(penetrations, energies):
    """How much an energy exceeds an earlier one, after the first touch and outside of impacts."""
    later = np.arange(len(penetrations)) >= (penetrations > 0).argmax()
    held = energies[later & (penetrations < 0.05)]
    return (held - np.minimum.accumulate(held)).max()


POSES, FIXED, METHODS = ("head-on", "side by side"), (False, True), ("Euler", "implicitfast", "RK4")

MATERIALS = [
    (size, factor, remanence)
    for size in (1e-3, 5e-3, 20e-3)
    for factor, remanence in ((1, STRONGEST), (0.3, STRONGEST), (10, STRONGEST), (1, 0.3))
]


@pytest.mark.parametrize(
    ("material", "integrator", "gap", "spin", "pose", "fixed"),
    pairwise(MATERIALS, METHODS, (0, 2), (0, 1), POSES, FIXED),
)
def test_at_the_proposed_settings_balls_stick(material, integrator, gap, spin, pose, fixed):
    """`gap` is in radii, `spin` in units of their own rate."""
    radius, factor, remanence = material
    density = factor * NEODYMIUM
    model = pair(radius, gap=gap * radius, fixed=fixed, pose=pose, remanence=remanence,
                 density=density, option=f'integrator="{integrator}"')  # fmt: skip
    assert mm.check(model, fix=True).findings
    again = mm.check(model)
    assert again.findings == ()
    time, depth_of_well = own_time(radius, remanence, density, fixed)
    with mm.magnetism():
        distances, energies = motion(model, (30 + 20 * gap) * time, spin / time)
    penetrations = (2 * radius - distances) / radius
    assert -0.005 < penetrations[-1] < 0.05  # -0.0009 .. 0.021
    assert penetrations.max() < (0.25 if gap else 0.05)  # 0.24, 0.045
    assert energies.max() - energies[0] < 0.02 * depth_of_well  # 0.005
    growth = growth_after_touch(penetrations[::4], energies[1:])
    assert growth < 0.1 * depth_of_well  # 0.052; a contact that pushes 5 % back works 0.045
    assert str(again).startswith("nothing to fix")


@pytest.mark.parametrize(
    ("material", "integrator", "gap", "pose", "shape", "fixed"),
    pairwise(MATERIALS[::5], METHODS, (0, 2), POSES, ("box", "cylinder"), FIXED),
)
def test_at_the_proposed_settings_magnets_with_flat_faces_stick(
    material, integrator, gap, pose, shape, fixed
):
    radius, factor, remanence = material
    model = pair(radius, gap=gap * radius, fixed=fixed, pose=pose, remanence=remanence,
                 density=factor * NEODYMIUM, shape=shape,
                 option=f'integrator="{integrator}"')  # fmt: skip
    mm.check(model, fix=True)
    again = mm.check(model)
    assert again.findings == ()
    time, depth_of_well = own_time(radius, remanence, factor * NEODYMIUM, fixed)
    with mm.magnetism():
        distances, energies = motion(model, (30 + 20 * gap) * time, 0.1 / time * (gap == 0))
    penetrations = (2 * radius - distances) / radius
    assert 0 < penetrations[-1] < 0.05  # 0.0001 .. 0.0011
    assert penetrations.max() < 0.25  # 0.09
    assert energies.max() - energies[0] < 6e-4 * depth_of_well  # 3e-5


def predicted(finding):
    """What a finding says will happen: the penetration at rest over the radius, or infinity."""
    if "fly apart once they touch" in finding:
        return np.inf
    share = re.search(r"penetrate each other by ([\d.]+) %", finding)
    assert share
    return float(share[1]) / 100


@pytest.mark.parametrize("radius", [1e-3, 5e-3, 20e-3])
@pytest.mark.parametrize("remanence", [1.45, 0.2, 0.1, 0.06, 0.03, 0.01, 0.005])
def test_at_the_defaults_magnets_do_what_is_said(radius, remanence):
    model = pair(radius, remanence=remanence)
    findings = mm.check(model).findings
    says = predicted(findings[0]) if findings else 0.05
    time, _ = own_time(radius, remanence, NEODYMIUM, False)
    with mm.magnetism():
        distances, _ = motion(model, 5 * time + 1, every=10**6)
    rest = (2 * radius - distances[-1]) / radius
    flew = distances.max() > 8 * radius or distances.min() < radius / 2
    assert flew == (says == np.inf)
    if not flew:
        # The text has two digits, and sliding along the grid of penetrations rounds up.
        assert rest < says + 0.004  # 0.0002
        assert not findings or rest > says - 0.01  # 0.003


def test_both_outcomes_are_in_the_grid():
    outcomes = [predicted(found) for remanence in (1.45, 0.06)
                for found in mm.check(pair(remanence=remanence)).findings[:1]]  # fmt: skip
    assert outcomes == [np.inf, 0.13]


def test_what_falls_from_far_away_may_tear_a_contact_that_would_hold_it():
    """Touching at rest they stick, and from a distance they do not."""
    outcomes = []
    for gap in (0, 0.04):
        model = pair(20e-3, remanence=0.3, gap=gap)
        assert "may fly apart if they meet at speed" in mm.check(model).findings[0]
        with mm.magnetism():
            distances, _ = motion(model, 2.0, every=10**6)
        outcomes.append(distances.max() > 8 * 20e-3 or distances.min() < 10e-3)
    assert outcomes == [False, True]


@pytest.mark.parametrize("friction", [0.3, 1, 2])
@pytest.mark.parametrize("other", [2, 5, 20])
def test_a_small_magnet_on_a_large_one(other, friction):
    """Penetrations are in units of the smaller radius."""
    model = pair(1e-3, other=other * 1e-3, gap=2e-3)
    model.geom_friction[:, 0] = friction
    mm.check(model, fix=True)
    assert mm.check(model).findings == ()
    with mm.magnetism():
        distances, _ = motion(model, 1500 * model.opt.timestep, every=10**6)
    penetrations = 1 + other - distances / 1e-3
    assert penetrations.max() < 0.25  # 0.22
    assert 0 < penetrations[-1] < 0.05  # 0.049


GEOMS = """
<mujoco>
  <option gravity="0 0 0" timestep="1e-4" {option}/>
  <worldbody>
    <body><freejoint/><geom name="one" size="0.1" {one}/></body>
    <body pos="0.19 0 0"><freejoint/><geom name="other" size="0.1" mass="7" {other}/></body>
  </worldbody>
  <contact>{contact}</contact>
</mujoco>
"""
PARAMETERS = [
    {},
    {"one": 'solref="0.01 0.8" friction="0.4"', "other": 'solref="0.03 2" friction="0.7"'},
    {"one": 'solref="0.01 0.8" solmix="3"', "other": 'solref="0.03 2" solimp="0.5 0.99 0.1 0.3 4"'},
    {"one": 'solref="0.01 0.8" solmix="0"', "other": 'solref="0.03 2" solmix="0"'},
    {"one": 'solref="0.01 0.8" solmix="0"', "other": 'solref="0.03 2" solmix="2"'},
    {"one": 'solref="0.01 0.8" priority="2" condim="1"', "other": 'condim="6" solref="0.03 2"'},
    {"one": 'solref="-500 -30"', "other": 'solref="0.03 2"'},
    {"one": 'solref="-500 -30"', "other": 'solref="-400 -80"'},
    {"one": 'condim="4" friction="2"', "other": 'condim="1"'},
    {"option": 'impratio="3"', "one": 'friction="0.5"', "other": 'friction="0.2"'},
    {"option": 'cone="elliptic" impratio="3"', "one": 'friction="0.5"'},
    {"contact": '<pair geom1="one" geom2="other" solref="0.04 0.7" condim="1"/>'},
    {"contact": '<pair geom1="one" geom2="other" friction="3 3 1 1 1" solimp="0.2 0.3 0.05"/>'},
    {"option": 'o_solref="0.07 0.6" o_solimp="0.3 0.4 0.01 0.5 2"', "override": True},
]


@pytest.mark.parametrize("parameters", PARAMETERS)
def test_the_contact_that_mujoco_makes_of_two_geoms(parameters):
    """The regularization R of all rows of a contact together is that of its normal."""
    text = {"option": "", "one": "", "other": "", "contact": ""} | parameters
    model = mujoco.MjModel.from_xml_string(GEOMS.format(**text))
    if parameters.get("override"):
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
        model.opt.o_friction[:] = 0.4
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    contact = data.contact[0]
    found = softness(model, 0, 1, 0 if model.npair else -1)
    np.testing.assert_allclose(found.solref, contact.solref, rtol=1e-15, atol=0)  # 1e-16
    np.testing.assert_allclose(found.solimp, contact.solimp, rtol=1e-15, atol=0)
    rows = 1 if contact.dim == 1 or model.opt.cone else 2 * (contact.dim - 1)
    stiffness, _, impedance, _ = data.efc_KBIP[0] if data.efc_KBIP.ndim == 2 else data.efc_KBIP[:4]
    assumed = model.body_invweight0[1:, 0].sum()
    softening = data.efc_R[0] / rows / assumed
    compliance = softening / (stiffness * impedance)
    expected = found.compliance(np.array(0.01)) * found.stiffness_time(2e-4) ** 2
    assert compliance == pytest.approx(expected, rel=1e-13)  # 4e-15


SHAPES = [
    '<geom type="sphere" size="0.3"/>',
    '<geom type="capsule" size="0.2 0.4"/>',
    '<geom type="box" size="0.2 0.3 0.5"/>',
    '<geom type="cylinder" size="0.3 0.4"/>',
    '<geom type="plane" size="1 1 1"/>',
]
PROBE = """
<mujoco>
  <asset><mesh name="brick" vertex="-.2 -.3 -.5 .2 -.3 -.5 -.2 .3 -.5 .2 .3 -.5
    -.2 -.3 .5 .2 -.3 .5 -.2 .3 .5 .2 .3 .5"/></asset>
  <worldbody>
    <body pos="0.1 0 0.2" euler="20 30 40">{}</body>
    <body mocap="true"><geom size="1e-9"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("shape", SHAPES)
def test_the_depth_is_what_mujoco_finds_for_a_tiny_sphere(shape):
    if "plane" in shape:
        text = PROBE.format("").replace("<body pos", shape + "<body pos")
    else:
        text = PROBE.format(shape)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    points = np.random.default_rng(1).uniform(-0.6, 0.6, (200, 3))
    distances = []
    for point in points:
        data.mocap_pos[0] = point
        mujoco.mj_forward(model, data)
        distances.append(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))
    depths, normals = depth_and_normal(model, data, 0, points)
    assert min(distances) < -0.05 < 0.05 < max(distances)
    np.testing.assert_allclose(depths, -np.array(distances), rtol=0, atol=3e-8)  # 1e-9
    nearer, _ = depth_and_normal(model, data, 0, points + 1e-3 * normals)
    np.testing.assert_allclose(depths - nearer, 1e-3, rtol=0, atol=3e-15)  # 1e-16


def test_a_mesh_without_data_has_no_depth():
    """A damaged binary can have one; nothing is inside it."""
    model = mujoco.MjModel.from_xml_string(PROBE.format('<geom size="0.1"/>'))
    model.geom_type[0] = mujoco.mjtGeom.mjGEOM_MESH
    depths, _ = depth_and_normal(model, mujoco.MjData(model), 0, np.zeros((1, 3)))
    assert depths == -np.inf


def depths_in(shape, points):
    model = mujoco.MjModel.from_xml_string(PROBE.format(shape))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    local = (points - data.geom_xpos[0]) @ data.geom_xmat[0].reshape(3, 3)
    return depth_and_normal(model, data, 0, points)[0], local


def test_the_depth_in_a_mesh_is_that_in_its_hull():
    points = np.random.default_rng(1).uniform(-0.6, 0.6, (200, 3))
    mesh, _ = depths_in('<geom type="mesh" mesh="brick"/>', points)
    box, _ = depths_in('<geom type="box" size="0.2 0.3 0.5"/>', points)
    inside = box > 0
    assert 10 < inside.sum() < 100
    # The vertices of a mesh have single precision.
    np.testing.assert_allclose(mesh[inside], box[inside], rtol=0, atol=3e-7)  # 1.2e-8
    assert (mesh[~inside] < 1e-7).all()


def test_the_depth_in_an_ellipsoid_is_not_overestimated():
    generator, axes = np.random.default_rng(1), np.array([0.2, 0.3, 0.5])
    points = generator.uniform(-0.6, 0.6, (200, 3))
    depths, local = depths_in('<geom type="ellipsoid" size="0.2 0.3 0.5"/>', points)
    directions = generator.normal(size=(20000, 3))
    surface = directions / np.linalg.norm(directions / axes, axis=1, keepdims=True)
    for depth, point in zip(depths, local, strict=True):
        outside = np.sum((point / axes) ** 2) > 1
        assert (depth < 0) == outside
        assert outside or depth <= np.linalg.norm(surface - point, axis=1).min()


IRON = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles iron coils fields"/>
    <numeric name="steel" data="1000 {saturation}"/>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/><element objtype="geom" objname="right"/>
    </tuple>
    {custom}
  </custom>
  <worldbody>
    <body name="left">{joint}<geom name="left" size="{one}" density="7500"/>
      <site name="left" user="{moment}"/></body>
    <body name="right" pos="0 0 {place}">
      <freejoint/><geom name="right" size="{other}" density="7800"/>
    </body>
  </worldbody>
  <actuator>{actuator}</actuator>
</mujoco>
"""
COIL = """<tuple name="coil"><element objtype="actuator" objname="coil" prm="{}"/>
<element objtype="site" objname="left"/></tuple>"""


def iron(one=5e-3, other=5e-3, *, gap=0.0, moment=0.6, saturation=1.7e6, joint="<freejoint/>",
         custom="", actuator=""):  # fmt: skip
    """A model of a magnet and a ball of iron."""
    text = IRON.format(one=one, other=other, moment=moment, saturation=saturation, joint=joint,
                       place=one + other + gap, custom=custom, actuator=actuator)  # fmt: skip
    return mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("joint", ["<freejoint/>", ""])
@pytest.mark.parametrize("saturation", [1e4, 1.7e6])
@pytest.mark.parametrize(("one", "other"), [(5e-3, 5e-3), (9e-3, 3e-3)])
def test_iron_sticks_to_a_magnet_at_the_proposed_settings_only(one, other, saturation, joint):
    moment = 1.45 * 4 / 3 * np.pi * one**3 / MU0
    for gap in (0, 2e-3):
        model = iron(one, other, gap=gap, moment=moment, saturation=saturation, joint=joint)
        with mm.magnetism():
            before, _ = motion(model, 1.0, every=10**6)
            found = mm.check(model, fix=True)
            after, _ = motion(model, 0.05, every=10**6)
        assert "will fly apart once they touch" in found.findings[0]
        assert before.max() > 0.5
        penetrations = (one + other - after) / min(one, other)
        assert mm.check(model).findings == ()
        assert penetrations.max() < 0.25  # 0.17
        assert 0 < penetrations[-1] < 0.05  # 0.04


@pytest.mark.parametrize(("saturation", "power"), [(0, 8), (1e4, 4)])
def test_the_force_of_iron_is_that_of_a_plane_unless_it_is_saturated(saturation, power):
    """F = 3 mu0 m^2/(32 pi h^4), which falls with h, or F = 3 mu0 m1 m2/(2 pi d^4)."""
    model = iron(saturation=saturation)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    distance = 0.01
    second = 4 / 3 * np.pi * 5e-3**3 * saturation
    force = 3 * MU0 * 0.6 * second / (2 * np.pi * distance**4)
    if not saturation:
        force = 3 * MU0 * 0.6**2 / (32 * np.pi * 5e-3**4)
    assert found.approach is not None
    assert found.approach.force == pytest.approx(force, rel=6e-15)  # 2e-16
    assert found.approach.distance == pytest.approx(4 / power * distance, rel=6e-15)


@pytest.mark.parametrize(
    ("saturation", "actuator", "drive"),
    [
        (0, "", 1.0),
        (0, 'ctrlrange="-3 2"', 3.0),
        (4, 'ctrlrange="-3 2"', 3 / np.hypot(1, 3 / 4)),
        (4, "", 4.0),
        (0, 'dyntype="integrator" actrange="-1 5"', 5.0),
    ],
)
def test_coils_are_as_strong_as_their_actuators_allow(saturation, actuator, drive):
    """Iron that is saturated, so that the force is proportional to the moment."""
    forces = []
    for custom, joints in ((COIL.format(saturation), actuator), ("", None)):
        given = "" if joints is None else f'<general name="coil" site="left" {joints}/>'
        model = iron(saturation=1e3, custom=custom, actuator=given, joint="")
        (finding,) = mm.check(model).findings
        forces.append(float(finding.split(" N")[0].split()[-1]))
    assert forces[0] / forces[1] == pytest.approx(drive, rel=0.01)  # three digits


def test_the_frequency_in_a_applied_field():
    """m B = 0.6 A m^2 x 0.5 T against the inertia of a ball; the iron is far away.

    The inertia about the moment does not matter, since the field cannot turn the body about it.
    """
    custom = '<numeric name="field" data="0.3 0.4 0"/>'
    model = iron(gap=1.0, custom=custom)
    model.body_inertia[1, 2] *= 1e-4
    model.dof_M0[5] *= 1e-4
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    expected = np.sqrt(0.3 * model.dof_invweight0[3])
    assert frequencies(model, data)[1] == pytest.approx(expected, rel=1e-6)  # 6e-8


EXPOSED = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body name="left"><freejoint/><geom size="0.01" {left}/>{site}</body>
    <body name="right" pos="0 0 0.1">{joint}<geom size="0.01"/><site user="1e-3"/></body>
  </worldbody>
  <contact>{exclude}</contact>
</mujoco>
"""
INSIDE = '<site user="1e-3"/>'


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({}, None),
        ({"left": 'contype="0" conaffinity="0"'}, "no geoms of theirs collide"),
        ({"exclude": '<exclude body1="left" body2="right"/>'}, "no geoms of theirs collide"),
        ({"site": '<site pos="0 0 0.01" user="1e-3"/>'}, None),  # the other is 10 mm deep
        ({"site": '<site pos="0 0 0.021" user="1e-3"/>'}, "is on or outside the surface"),
        ({"joint": ""}, None),
        ({"left": 'contype="0" conaffinity="0"', "joint": ""}, "no geoms of theirs collide"),
    ],
)
def test_dipoles_that_no_contact_keeps_apart(parts, reason):
    text = {"left": "", "site": INSIDE, "joint": "<freejoint/>", "exclude": ""} | parts
    model = mujoco.MjModel.from_xml_string(EXPOSED.format(**text))
    findings = mm.check(model).findings
    if reason is None:
        assert findings == ()
    else:
        (finding,) = findings
        assert " can come so near that their dipoles coincide" in finding
        assert reason in finding


CARTS = """
<mujoco>
  <option timestep="1e-5"/>
  <default><joint solreflimit="2e-5 1"/></default>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body><joint type="slide" axis="1 0 0" range="-0.1 0.02"/><geom size="0.01"/>{site}</body>
    <body pos="0.07 0 {height}">
      <joint type="slide" axis="1 0 0" range="-{range} 0.1"/><geom size="0.01"/>{site}
    </body>
    <body pos="0.04 1 0">
      <joint type="hinge" axis="0 0 1" pos="0 -0.03 0"/><geom size="0.01"/>{site}
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(
    ("distance", "height", "number"), [(0.029, 0, 0), (0.031, 0, 1), (0.04, 0.021, 0)]
)
def test_what_cannot_meet_is_not_checked(distance, height, number):
    text = CARTS.format(range=distance, height=height, site='<site zaxis="1 0 0" user="1"/>')
    found = mm.check(mujoco.MjModel.from_xml_string(text))
    assert len(found.findings) == number


def test_magnets_that_overlap_at_the_start():
    model = pair(gap=-1e-3, remanence=1e-3)
    assert mm.check(model).findings == (
        "geom 'left' and geom 'right' of magnets overlap by 0.001 m at the start; move them apart",
    )
    data = mujoco.MjData(model)
    data.qpos[2] = -0.01
    assert mm.check(model, data).findings == ()


NEEDLE = """
<mujoco>
  <option timestep="{}"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0.1 0" zaxis="0 1 0" user="50"/>
    <body name="needle">
      <joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 4e-7"/>
      <geom type="capsule" fromto="0 -0.03 0 0 0.03 0" size="0.003"/>
      <site zaxis="0.1 1 0" user="0.1"/>
    </body>
  </worldbody>
</mujoco>"""


def test_the_frequency_of_a_needle_in_a_field_is_exact():
    """A hinge, m B = 1e-3 N m, and the timestep just below and above omega h = 2."""
    omega, outcomes = 50.0, []
    for product in (1.9, 2.1):
        model = mujoco.MjModel.from_xml_string(NEEDLE.format(product / omega))
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        assert frequencies(model, data)[1] == pytest.approx(omega, rel=3e-15)  # 1e-16
        found = mm.check(model)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=60)
        outcomes.append((len(found.findings), abs(data.qpos[0]) < 0.5))
    assert outcomes == [(0, True), (1, False)]
    assert found.findings[0].startswith("body 'needle' can swing or turn with omega = 50 rad/s")
    assert found.timestep == 0.01


def test_noise_that_does_not_match_the_damping():
    text = """
    <mujoco>
      <custom><text name="magmotor" data="noise"/></custom>
      <worldbody>
        <body name="upper" user="0 0 0 0 0 0.6">
          <joint type="hinge" damping="0.2"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
          <body pos="1 0 0" {}>
            <joint type="hinge" damping="{}"/>
            <geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
          </body>
        </body>
      </worldbody>
    </mujoco>"""
    matched = mujoco.MjModel.from_xml_string(text.format("", 0))
    assert mm.check(matched).findings == ()
    model = mujoco.MjModel.from_xml_string(text.format('user="0 0 0 0 0 0.6"', 0.2))
    (finding,) = mm.check(model).findings
    assert finding.startswith("noise and damping differ by ")
    assert "range from 0.344 J to 2.36 J; take the noise from mm.brownian_rows" in finding


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({}, ["geom 'left'", "geom 'right'"]),
        ({"contact": '<pair name="both" geom1="left" geom2="right"/>'}, ["pair 'both'"]),
        ({"priority": 1}, ["geom 'left'"]),
        ({"override": True}, ["option o_solref"]),
        ({"direct": True}, ["geom 'left'", "geom 'right'"]),
        ({"unsafe": True}, ["geom 'left'", "geom 'right'"]),
    ],
)
def test_fix_sets_what_has_the_parameters(change, named):
    model = pair(contact=change.get("contact", ""), gap=0.01)
    model.geom_priority[0] = change.get("priority", 0)
    if "override" in change:
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    if "direct" in change:
        model.geom_solref[:] = -500, -40
    if "unsafe" in change:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    before = model.geom_solref.copy(), model.opt.timestep
    found = mm.check(model)
    assert [*found.solref] == named
    assert (model.geom_solref == before[0]).all()
    assert model.opt.timestep == before[1]
    assert found.settings[1] == f"proposed: timestep {found.timestep:g} s"
    fixed = mm.check(model, fix=True)
    assert fixed.solref == found.solref
    assert fixed.settings[0].startswith('set: solref="0.00028 1" of ')
    assert model.opt.timestep == fixed.timestep == 0.00014
    assert mm.check(model).findings == ()
    with mm.magnetism():
        distances, _ = motion(model, 0.05, every=10**6)
    assert 0 < 1e-2 - distances[-1] < 2.5e-4  # 1e-4


@pytest.mark.parametrize(
    ("contact", "option"),
    [("", ""), ('<pair geom1="left" geom2="right"/>', ""), ("", '<flag override="enable"/>')],
)
def test_fix_sets_the_same_in_a_spec(contact, option):
    """The order of a spec's geoms is not that of the compiled ones."""
    bodies = [
        magnet(name, place, 5e-3, remanence=STRONGEST, density=NEODYMIUM)
        for name, place in (("left", 0), ("right", 0.02))
    ]
    spec = mujoco.MjSpec.from_string(
        MODEL.format(option="", bodies="".join(bodies), contact=contact).replace(
            "<custom>", f"<option>{option}</option><custom>"
        )
    )
    spec.bodies[1].add_geom(size=[1e-3] * 3, pos=[0.2, 0, 0], contype=0, conaffinity=0)
    model = spec.compile()
    proposed = mm.check(spec)
    assert spec.option.timestep == 2e-3
    assert spec.compile().geom_solref.tolist() == model.geom_solref.tolist()
    assert mm.check(spec, mujoco.MjData(model), fix=True).solref == proposed.solref
    fixed = mm.check(model, fix=True)
    assert fixed.solref == proposed.solref
    for compiled in (spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())):
        assert compiled.opt.timestep == model.opt.timestep == fixed.timestep
        assert compiled.geom_solref.tolist() == model.geom_solref.tolist()
        assert compiled.pair_solref.tolist() == model.pair_solref.tolist()
        assert compiled.opt.o_solref.tolist() == model.opt.o_solref.tolist()
        assert mm.check(compiled).findings == ()


@pytest.mark.parametrize(("solref", "longest"), [((-2e8, -40000), 2.5e-5), ((1e-4, 1), 5e-5)])
def test_a_contact_that_is_stiff_enough_may_need_a_shorter_timestep(solref, longest):
    model = pair(gap=0.01)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    model.opt.timestep, model.geom_solref[:] = 1e-4, solref
    found = mm.check(model)
    assert "meet in a contact that moves within" in found.findings[0]
    assert found.timestep == longest
    assert found.solref == {}


def test_pairs_that_are_alike_are_one_sentence():
    bodies = [magnet(f"ball {k}", 0.02 * k, 5e-3, remanence=1, density=7500) for k in range(20)]
    text = MODEL.format(option="", bodies="".join(bodies), contact="")
    model = mujoco.MjModel.from_xml_string(text)
    found = mm.check(model, fix=True)
    assert found.findings[0].startswith(
        "bodies 'ball 0' and 'ball 1' (and 189 more like them) will"
    )
    assert len(found.findings) == 2
    assert len(found.solref) == 20
    assert found.settings[0].endswith("of geom 'ball 0', geom 'ball 1', geom 'ball 2', geom "
                                      "'ball 3' and 16 more")  # fmt: skip
    assert mm.check(model).findings == ()


ONE_JOINT = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"


def test_the_data_of_another_model_are_rejected():
    with refused("shape of data.qpos"):
        mm.check(pair(), mujoco.MjData(mujoco.MjModel.from_xml_string(ONE_JOINT)))


def test_a_fix_makes_no_contact_softer_and_converges():
    """A soft geom is to blame, not the stiff ones that it touches."""
    ball = (
        '<body pos="{0} 0 0"><freejoint/><geom name="{1}" size=".005" density="7500" {2}/>'
        '<site user="{3}"/></body>'
    )
    balls = ball.format(0, "stiff", "", 0.001) + ball.format(0.02, "soft", 'solref="0.5 1"', 0.001)
    balls += ball.format(0.04, "strong", "", 0.05)
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><custom><text name="magmotor" data="dipoles"/></custom><worldbody>'
        f"{balls}</worldbody></mujoco>"
    )
    before = model.geom_solref[:, 0].copy()
    mm.check(model, fix=True)
    assert (model.geom_solref[:, 0] <= before).all()
    assert model.geom_solref[1, 0] < 0.03
    assert mm.check(model).settings == ()


@pytest.mark.parametrize("seed", range(3))
def test_one_fix_is_enough(seed):
    """The first seed has a model of which one proposal needs another one."""
    rng = np.random.default_rng(seed)
    for _ in range(12):
        step, bodies = 10 ** rng.uniform(-4, -1.7), ""
        for number in range(2):
            radius, stiffness = 10 ** rng.uniform(-3, -1.5), 10 ** rng.uniform(2, 7)
            solref = ["0.02 1", f"{10 ** rng.uniform(-4.5, -1.5)} 0.5", f"{-stiffness} -30"]
            bodies += (
                f'<body pos="{number} 0 0"><freejoint/><geom size="{radius}" density="7500"'
                f' solref="{rng.choice(solref)}"/><site user="{3e6 * radius**3}"/></body>'
            )
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="{step}"/><custom><text name="magmotor" data="dipoles"/>'
            f"</custom><worldbody>{bodies}</worldbody></mujoco>"
        )
        before = mm.check(model)
        found = mm.check(model, fix=True)
        assert [each.replace("set:", "proposed:") for each in found.settings] == [*before.settings]
        assert mm.check(model).settings == ()


def test_many_findings_are_counted():
    bodies = "".join(
        f'<body pos="{k} 0 0"><freejoint/><geom size="{0.004 + 1e-4 * k}" density="7500"/>'
        '<site user="0.5"/></body>'
        for k in range(8)
    )
    text = f'<mujoco><custom><text name="magmotor" data="dipoles"/></custom>{{}}{bodies}</mujoco>'
    text = text.format("<worldbody>").replace("</mujoco>", "</worldbody></mujoco>")
    found = mm.check(mujoco.MjModel.from_xml_string(text))
    lines = str(found).splitlines()
    assert len(found.findings) == 48
    assert lines[:20] == [*found.findings[:20]]
    assert lines[20] == "and 28 more findings"
    assert lines[21].startswith("proposed: ")
