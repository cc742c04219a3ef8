"""`check` on a plane of iron: what it says happens, and at its settings magnets stick to it."""

import itertools

import mujoco
import numpy as np
import pytest
from only_meeting import meeting
from pairwise import pairwise

import magmotor as mm
from magmotor.mjcf.checking.closest_approach import meetings
from magmotor.mjcf.checking.frequencies import frequencies, frequency_at_touch

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MU0 = 4e-7 * np.pi
IMAGES = 1000 / 1002

TABLE = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <custom>
    <text name="magmotor" data="dipoles iron"/>
    <numeric name="steel" data="1000"/>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/><element objtype="geom" objname="table"/>
      {iron}
    </tuple>
  </custom>
  <worldbody>
    {world}
    <body name="table">{table}<geom name="table" type="plane" size="1 1 1" mass="1" {plane}/></body>
    {bodies}
  </worldbody>
</mujoco>
"""
BODY = """
<body name="magnet" pos="0 0 {height}">{joint}
  <geom name="magnet" type="{shape}" size="{r} {r} {r}" density="{density}"/>{keeper}{sites}
</body>"""


def load(height=5e-3, r=5e-3, *, moment=0.5, shape="sphere", density=7500, joint="<freejoint/>",
         axis="0 0 1", points=((0, 0, 0),), keeper="", **parts):  # fmt: skip
    """A magnet above a table; `moment` is that of all its dipoles, and points are in units of r."""
    sites = "".join(
        f'<site pos="{x * r} {y * r} {z * r}" zaxis="{axis}" user="{moment / len(points)}"/>'
        for x, y, z in points
    )
    body = BODY.format(height=height, joint=joint, shape=shape, r=r, density=density,
                       sites=sites, keeper=keeper)  # fmt: skip
    text = {"option": "", "iron": "", "world": "", "table": "", "plane": ""} | parts
    return mujoco.MjModel.from_xml_string(TABLE.format(bodies=body, **text))


def run(model, duration):
    """Heights of the magnet at each step, and energies, kinetic and magnetic."""
    data = mujoco.MjData(model)
    heights, energies = [], []
    with mm.magnetism():
        for step in range(int(duration / model.opt.timestep)):
            if step % 4 == 0:
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                mujoco.mj_energyVel(model, data)
                energies.append(mm.magnetic_energy(model, data) + data.energy[1])
            mujoco.mj_step(model, data)
            heights.append(data.body("magnet").xpos[2] - data.body("table").xpos[2])
    return np.array(heights), np.array(energies)


def test_force_and_gradient_at_touch_are_those_of_the_image():
    """Against 3 mu0 k m^2/(32 pi h^4), whose gradient is 4 F/h."""
    _, found = meeting(load())
    force = 3 * MU0 * IMAGES * 0.5**2 / (32 * np.pi * 5e-3**4)
    assert found.approach.force == pytest.approx(force, rel=1e-14)  # 4e-16
    assert found.approach.distance == pytest.approx(5e-3, rel=1e-14)
    assert found.approach.mass == pytest.approx(7500 * 4 / 3 * np.pi * 5e-3**3, rel=1e-14)


def test_the_force_on_several_dipoles_is_that_which_acts():
    """Two dipoles above each other: their distances from all images are exact."""
    points = ((0, 0, -0.5), (0, 0, 0.5))
    model = load(r=5e-3, points=points, shape="cylinder")
    data, found = meeting(model)
    forces = []
    for height in (5e-3, 5e-3 - 1e-8):
        data.qpos[2] = height
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        forces.append(-data.xfrc_applied[model.body("magnet").id, 2])
    slope = (forces[1] - forces[0]) / 1e-8
    assert found.approach.force == pytest.approx(forces[0], rel=6e-15)  # 2e-16
    assert found.approach.distance == pytest.approx(4 * forces[0] / slope, rel=1e-4)  # 1e-5


def test_iron_of_a_magnet_is_attracted_too():
    """The dipole and its image magnetize a ball of iron, whose image attracts both."""
    iron, points = '<element objtype="geom" objname="keeper"/>', [(0, 0, -0.4)]
    keeper = '<geom name="keeper" pos="0 0 0.0015" size="0.001" contype="0" conaffinity="0"/>'
    model = load(iron=iron, keeper=keeper, shape="cylinder", points=points)
    data, found = meeting(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    force = -data.xfrc_applied[model.body("magnet").id, 2]
    _, alone = meeting(load(shape="cylinder", points=points))
    assert force > 1.01 * alone.approach.force
    # What `check` says takes the ball for a dipole.
    assert found.approach.force == pytest.approx(force, rel=0.1)


def test_the_frequency_above_a_plane():
    """The stiffness of the force, 4 F/h."""
    model = load(height=8e-3)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    force = 3 * MU0 * IMAGES * 0.5**2 / (32 * np.pi * 8e-3**4)
    mass = model.body_mass[model.body("magnet").id]
    (found,) = frequencies(model, data).values()
    assert found == pytest.approx(np.sqrt(4 * force / 8e-3 / mass), rel=1e-14)


def test_the_frequency_of_a_needle_above_a_plane_is_exact():
    """The energy -mu0 k m^2 (1 + cos^2)/(64 pi h^3), and timesteps around omega h = 2."""
    joint = '<joint axis="1 0 0"/>'
    model = load(height=5.1e-3, joint=joint, axis="0 0.02 1")
    body = model.body("magnet").id
    stiffness = MU0 * IMAGES * 0.5**2 / (32 * np.pi * 5.1e-3**3)
    omega, outcomes = np.sqrt(stiffness / model.body_inertia[body, 0]), []
    for product in (1.9, 2.1):
        model.opt.timestep = product / omega
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        assert frequencies(model, data)[body] == pytest.approx(omega, rel=1e-14)
        found = mm.check(model)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=60)
        outcomes.append(("can swing or turn" in str(found), abs(data.qpos[0]) < 0.2))
    assert outcomes == [(False, True), (True, False)]


def test_the_frequency_of_turns_at_touch():
    """The same energy, and a small inertia."""
    model = load()
    body = model.body("magnet").id
    model.body_inertia[body] *= 0.01
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data, found = meeting(model)
    stiffness = MU0 * IMAGES * 0.5**2 / (32 * np.pi * 5e-3**3)
    omega = frequency_at_touch(model, data, found.magnets, found.approach)
    assert omega == pytest.approx(np.sqrt(stiffness / model.body_inertia[body, 0]), rel=1e-14)


SHAPES = {
    "sphere": ((0, 0, 0),),
    "box": [*itertools.product((-0.5, 0.5), repeat=3)],
    "cylinder": ((0.5, 0, 0), (-0.25, 0.433, 0), (-0.25, -0.433, 0)),
}
VOLUMES = {"sphere": 4 / 3 * np.pi, "box": 8, "cylinder": 2 * np.pi}
MATERIALS = [(1e-3, 7500, 1.45), (5e-3, 2250, 1.45), (20e-3, 75000, 1.45), (5e-3, 7500, 0.3)]


INTEGRATORS = "Euler", "implicitfast", "RK4"


@pytest.mark.parametrize(
    ("material", "integrator", "shape", "gap"), pairwise(MATERIALS, INTEGRATORS, [*SHAPES], (0, 2))
)
def test_at_the_proposed_settings_magnets_stick_to_a_plane(material, integrator, shape, gap):
    """From touch, or from twice the distance at touch above; `MATERIALS` also have sizes."""
    r, density, remanence = material
    model = load(
        r, r, moment=remanence * VOLUMES[shape] * r**3 / MU0, shape=shape,
        density=density, points=SHAPES[shape], option=f'integrator="{integrator}"',
    )  # fmt: skip
    approach = meeting(model)[1].approach
    model.qpos0[2] += gap * approach.distance
    assert mm.check(model, fix=True).findings
    assert mm.check(model).findings == ()
    heights, energies = run(model, (20 + 10 * gap) * approach.time)
    penetrations = 1 - heights / r
    assert 0 < penetrations[-1] < 0.05  # 0.0024 .. 0.045
    assert penetrations.max() < (0.3 if gap else 0.1)  # 0.26, 0.08
    assert energies.max() - energies[0] < 0.01 * approach.force * approach.distance / 3  # 4e-4


def outcome(model, duration):
    """What happens to a magnet on a plane: it sticks at a penetration, or does not."""
    r = model.geom("magnet").size[0]
    try:
        heights, _ = run(model, duration)
    except (mujoco.FatalError, ValueError) as error:  # at a step, or from the energy
        if "is below the plane of iron" not in str(error):
            raise
        return np.inf
    return np.inf if heights.max() > 8 * r else 1 - heights[-1] / r


@pytest.mark.parametrize("r", [1e-3, 5e-3, 20e-3])
@pytest.mark.parametrize("remanence", [1.45, 0.3, 0.1, 0.06, 0.03, 0.01])
def test_at_the_defaults_magnets_on_a_plane_do_what_is_said(r, remanence):
    model = load(r, r, moment=remanence * VOLUMES["sphere"] * r**3 / MU0)
    findings = mm.check(model).findings
    says = 0.05
    if findings and "will fly apart or fall through once they touch" in findings[0]:
        says = np.inf
    elif findings and "may fly apart or fall through if they meet at speed" in findings[0]:
        return  # it starts at rest, and sticks or not
    elif findings:
        says = float(findings[0].split("penetrate each other by ")[1].split(" %")[0]) / 100
    found = outcome(model, 1 + 5 * meeting(model)[1].approach.time)
    assert (found == np.inf) == (says == np.inf)
    if found < np.inf:
        assert found < says + 0.004  # -0.0003
        assert not findings or found > says - 0.01  # 0.0004


SLIDE = '<joint type="slide" axis="{}" range="{} 0.01" solreflimit="2e-5 1"/>'


@pytest.mark.parametrize(("axis", "lowest", "pairs"), [
    ("0 0 1", -0.014, 0), ("0 0 1", -0.016, 1), ("0 0 -1", -0.016, 0), ("1 0 0", -0.016, 0),
])  # fmt: skip
def test_magnets_that_cannot_reach_the_plane_are_not_checked(axis, lowest, pairs):
    joint = SLIDE.format(axis, lowest)
    found = mm.check(load(height=0.02, joint=joint, option='timestep="1e-5"'))
    assert len(found.findings) == pairs


@pytest.mark.parametrize(("lowest", "pairs"), [(-0.012, 0), (-0.014, 1)])
def test_a_floor_above_the_plane_may_be_within_reach(lowest, pairs):
    joint = SLIDE.format("0 0 1", lowest)
    floor = '<geom type="plane" size="1 1 1" pos="0 0 0.002"/>'
    model = load(height=0.02, joint=joint, world=floor, plane='contype="0" conaffinity="0"',
                 option='timestep="1e-5"')  # fmt: skip
    assert ("once they touch" in str(mm.check(model))) == pairs


def test_a_box_does_not_cover_the_whole_plane():
    box = '<geom type="box" size="0.05 0.05 0.01"/>'
    found = mm.check(load(height=0.03, world=box, plane='contype="0" conaffinity="0"'))
    assert "since no geoms of theirs collide" in found.findings[0]


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({}, None),
        ({"plane": 'contype="0" conaffinity="0"'}, "no geoms of theirs collide"),
        ({"points": [(0, 0, -1.1)]}, "is on or outside the surface"),
        # A floor 2 mm above keeps magnets away.
        ({"plane": 'contype="0" conaffinity="0"',
          "world": '<geom type="plane" size="1 1 1" pos="0 0 0.002"/>'}, None),
    ],
)  # fmt: skip
def test_what_nothing_keeps_above_the_plane(parts, reason):
    found = mm.check(load(height=0.02, moment=1e-3, **parts)).findings
    if reason is None:
        assert found == ()
    else:
        assert found[0].startswith("body 'magnet' and geom 'table' can come so near that a dipole "
                                   "is in the plane of iron, since ")  # fmt: skip
        assert reason in found[0]


def test_a_floor_above_the_plane_is_what_a_magnet_touches():
    floor = '<geom type="plane" size="1 1 1" pos="0 0 0.002"/>'
    _, found = meeting(load(world=floor))
    assert found.approach.distance == pytest.approx(7e-3, rel=1e-14)


def test_a_magnet_fixed_beside_the_plane_is_another_partner():
    world = '<geom name="post" pos="0.1 0 0.01" size="0.01"/><site pos="0.1 0 0.01" user="0.5"/>'
    model = load(world=world)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    names = {frozenset(m.name(model) for m in pair.magnets) for pair in meetings(model, data)}
    assert names == {frozenset({"body 'magnet'", "geom 'table'"}),
                     frozenset({"body 'magnet'", "geom 'post'"})}  # fmt: skip


def test_a_magnet_in_the_table_at_the_start():
    findings = mm.check(load(height=4e-3)).findings
    assert findings[0].startswith(
        "geom 'table' and geom 'magnet' of magnets overlap by 0.001 m at "
    )
