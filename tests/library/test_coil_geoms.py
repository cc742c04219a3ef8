"""Coils by their geom: their field, cores and plungers of iron, and magnets in the bore.

Forces on iron and energies are those of finite elements, by NGSolve 6.2.2608. The round ones are
axisymmetric: the vector potential, of third order with elements of 0.25 mm, of a sheet of current
J/mu0 on the side of the winding in a sphere of 0.25 m. The bent one is half of a cube of 0.24 m,
with elements of second order from 1.1 mm and 2.2e5 unknowns. Forces are those of Maxwell's stress
in the air around what is pulled. With elements twice as large, round ones differ by 0.01 to 0.4 %;
with 1.4 mm, the bent one by 0.9 %. All iron has a susceptibility of 1000.
"""

import math

import magpylib
import mujoco
import numpy as np
import pytest
from energy_slopes import wrenches_by_energy

import magmotor as mm
from tests.iron_models import factors

MODEL = """
<mujoco>
  <size nuser_geom="3" memory="10M"/>
  <option gravity="0 0 0"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <custom>
    <text name="magmotor" data="{act}"/>
    <tuple name="coil"><element objtype="actuator" objname="current" prm="{saturation}"/>
      <element objtype="geom" objname="coil"/></tuple>
    {iron}
  </custom>
  <worldbody><site name="fixed"/>{bodies}</worldbody>
  <actuator><general name="current" site="fixed" gainprm="0"/></actuator>
</mujoco>"""

ROUND = '<geom name="coil" type="cylinder" size=".01 .02" user="0 0 .3"/>'
SQUARE = '<geom name="coil" type="box" size=".01 .01 .01" user="0 0 .3"/>'
DRIVE = 2.0


def rod(name, radius, bottom, top):
    half, middle = (top - bottom) / 2, (top + bottom) / 2
    size = f'size="{radius:g}e-3 {half:g}e-3" pos="0 0 {middle:g}e-3"'
    return f'<geom name="{name}" type="cylinder" {size}/>'


def box(name, x, y, z):
    """A box between coordinates in mm."""
    half = " ".join(f"{(b - a) / 2:g}e-3" for a, b in (x, y, z))
    middle = " ".join(f"{(b + a) / 2:g}e-3" for a, b in (x, y, z))
    return f'<geom name="{name}" type="box" size="{half}" pos="{middle}"/>'


def body(name, elements, pose=""):
    return f'<body name="{name}" {pose}><freejoint/>{elements}</body>'


def load(bodies, iron="", act="magnets coils iron dipoles", saturation=0.0, spacing=0.0):
    """A model, in which these geoms are iron, with a distance of nodes in m, or automatic nodes."""
    elements = "".join(f'<element objtype="geom" objname="{name}"/>' for name in iron.split())
    if iron:
        iron = f'<tuple name="iron"><element objtype="numeric" objname="steel"/>{elements}</tuple>'
        iron += f'<numeric name="steel" data="1000 0 {spacing}"/>'
    text = MODEL.format(bodies=bodies, iron=iron, act=act, saturation=saturation)
    return mujoco.MjModel.from_xml_string(text)


def state(model, drive=DRIVE, qpos=None):
    """Data with the forces."""
    data = mujoco.MjData(model)
    data.ctrl[0] = drive
    if qpos is not None:
        data.qpos[:] = qpos
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return data


def field_of(shape, polarization, dimension, points):
    """The flux density of a magnet, by magpylib."""
    magnet = getattr(magpylib.magnet, shape)(polarization=polarization, dimension=dimension)
    return magnet.getB(points)


@pytest.mark.parametrize("shape", [ROUND, SQUARE], ids=["round", "square"])
def test_the_field_is_that_of_a_solenoid(shape):
    """Also inside, and of a drive that saturates."""
    ball = body("ball", '<geom name="ball" size=".001" user="0 0 1e-9"/>', 'pos="1 0 0"')
    model = load(shape + ball, saturation=1.5)
    points = np.random.default_rng(1).uniform(-0.018, 0.018, (200, 3))
    kind, size = ("Cylinder", (0.02, 0.04)) if shape == ROUND else ("Cuboid", (0.02, 0.02, 0.02))
    expected = field_of(kind, (0, 0, 0.3 * 2 / math.hypot(1, 2 / 1.5)), size, points)
    assert np.abs(mm.field(model, state(model), points) - expected).max() < 1e-14  # 1.7e-16


PLUNGERS = {20: (-244.9, 2.9072), 10: (-255.2, 5.5222), 30: (-143.8, 0.9215)}
"""Center in mm of a rod of 16 x 40 mm in a coil of 20 x 40 mm: force in N, and energy in J."""


@pytest.mark.parametrize("height", PLUNGERS)
def test_a_plunger(height):
    model = load(ROUND + body("rod", rod("rod", 8, -20, 20)), "rod")
    data = state(model, qpos=[0, 0, height * 1e-3, 1, 0, 0, 0])
    force, energy = PLUNGERS[height]
    assert data.body("rod").xfrc_applied[2] == pytest.approx(force, rel=0.02)  # 6.0e-3
    assert mm.magnetic_energy(model, data) == pytest.approx(-energy, rel=0.015)  # 3.9e-3


POST = rod("post", 8, -20, 20)
BOBBIN = rod("post", 8, -21, 21) + rod("low", 14, -26, -21) + rod("up", 14, 21, 24)
BENT = (
    box("post", (-7, 7), (-7, 7), (-10, 10)) + box("low", (-7, 18), (-7, 7), (-16, -10))
    + box("side", (14, 18), (-7, 7), (-10, 10))
)  # fmt: skip
DISK, KEEPER = rod("pellet", 6, 34, 40), box("pellet", (-7, 18), (-7, 7), (14, 18))

CORES = {
    "rod": (ROUND + POST, "post", DISK, 0, 4.230, 0.03),  # 6.7e-3
    "bobbin": (ROUND + BOBBIN, "post low up", DISK, 0.0055, 9.967, 0.04),  # 1.5e-2
    "bent": (SQUARE + BENT, "post low side", KEEPER, 0.006, 208.9, 0.08),  # 3.4e-2
}
"""Winding and core, its geoms, what is pulled, the distance of nodes in m, the force in N, and the
bound of its error."""


@pytest.mark.parametrize("core", CORES)
def test_an_electromagnet(core):
    coil, names, pellet, spacing, force, bound = CORES[core]
    model = load(coil + body("pellet", pellet), f"{names} pellet", spacing=spacing)
    pull = -state(model).body("pellet").xfrc_applied[2]
    assert pull == pytest.approx(force, rel=bound)


def test_an_ellipsoid_in_a_long_coil():
    """The field in its middle is uniform, and so is the magnetization."""
    axes = (0.002, 0.002, 0.006)
    long = '<geom name="coil" type="box" size=".02 1 .02" user="0 .01 0"/>'
    piece = '<geom name="piece" type="ellipsoid" size=".002 .002 .006" euler="90 0 0"/>'
    model = load(long + body("piece", piece), "piece")
    field = field_of("Cuboid", (0, 2 * 0.01, 0), (0.04, 2, 0.04), (0, 0, 0))[1]
    volume, factor = 4 / 3 * math.pi * math.prod(axes), factors(axes)[2]
    moment = 1000 / (1 + 1000 * factor) * volume * field / (4e-7 * math.pi)
    energy = mm.magnetic_energy(model, state(model))
    assert energy == pytest.approx(-moment * field / 2, rel=1e-4)  # 0


MAGNET = '<geom type="cylinder" size=".004 .003" user="0 0 1.2"/>'
CAPSULE = '<geom name="rod" type="capsule" size=".004 .01"/>'
DIPOLE = '<geom size=".001"/><site user=".1"/>'
EVERYTHING = (
    body("hand", ROUND + rod("low", 14, -26, -20) + rod("post", 6, -20, -12), 'euler="20 30 0"')
    + body("rod", CAPSULE, 'pos=".013 -.008 .02" euler="25 20 0"')
    + body("magnet", MAGNET, 'pos=".0015 .001 .003" euler="60 30 0"')
    + body("dipole", DIPOLE, 'pos="-.0025 .0041 -.0057" euler="10 50 0"')
    + body("ball", '<geom name="ball" size=".008" user="0 0 1"/>', 'pos=".021 .01 .03"')
)  # fmt: skip


def test_forces_are_derivatives_of_the_energy():
    """Of a coil with a core, iron, a magnet and a dipole in its bore, and a magnet outside."""
    model = load(EVERYTHING, "low post rod")
    data = state(model)
    wrenches = data.xfrc_applied[1:]
    forces, torques = wrenches[:, :3], wrenches[:, 3:]
    about = torques + np.cross(data.xipos[1:] - data.xpos[1:], forces)
    expected = wrenches_by_energy(model, data, len(wrenches), [5e-6])
    assert np.abs(np.stack([forces, about], axis=1) - expected).max() < 3e-5  # 1.9e-6
    total = torques + np.cross(data.xipos[1:], forces)
    assert np.abs([forces.sum(axis=0), total.sum(axis=0)]).max() < 1e-11 * np.abs(wrenches).max()


@pytest.mark.parametrize("place", [(0, 0, 0.003), (0.003, 0.001, 0.018), (0.001, 0, 0.024)])
def test_a_magnet_in_the_bore(place):
    """Its charges are on its ends, in the field of magpylib; it may be on the way out."""
    model = load(ROUND + body("magnet", MAGNET))
    data = state(model, qpos=[*place, 1, 0, 0, 0])
    x, w = np.polynomial.legendre.leggauss(12)
    radii, turns = 0.002 * (1 + x), np.arange(24) * math.pi / 12
    r, t = (each.ravel() for each in np.meshgrid(radii, turns, indexing="ij"))
    charges = 1.2 * np.repeat(0.002 * w * radii, 24) * math.pi / 12 / (4e-7 * math.pi)
    force = np.zeros(3)
    for side in (1, -1):
        points = np.stack([r * np.cos(t), r * np.sin(t), np.full_like(r, side * 0.003)], axis=-1)
        flux = field_of("Cylinder", (0, 0, 0.6), (0.02, 0.04), points + place)
        force += side * charges @ flux
    scale = 0.6 * 1.2 * math.pi * 0.004**2 / (4e-7 * math.pi)
    assert np.abs(data.body("magnet").xfrc_applied[:3] - force).max() < 1e-8 * scale  # 4e-10


def test_nothing_jumps_where_iron_or_a_magnet_enters():
    model = load(ROUND + body("rod", rod("rod", 8, -20, 20)), "rod")
    data, heights = mujoco.MjData(model), 0.04 + np.array([-2e-6, 2e-6])
    data.ctrl[0] = DRIVE
    energies = []
    for height in heights:
        data.qpos[2] = height
        mujoco.mj_kinematics(model, data)
        energies.append(mm.magnetic_energy(model, data))
    force = state(model, qpos=[0, 0, 0.04, 1, 0, 0, 0]).body("rod").xfrc_applied[2]
    assert energies[1] - energies[0] == pytest.approx(-4e-6 * force, rel=1e-6)  # 5e-8


@pytest.mark.parametrize("moves", ["rod", "magnet"])
def test_the_center_of_a_coil(moves):
    """Where a dipole would have no field."""
    inside = {"rod": rod("rod", 8, -15, 15), "magnet": MAGNET}[moves]
    model = load(ROUND + body(moves, inside), "rod" if moves == "rod" else "")
    assert np.abs(state(model).xfrc_applied).max() < 3e-6  # 1.2e-7
    off = state(model, drive=0.0)
    assert not off.xfrc_applied.any()
    assert mm.magnetic_energy(model, off) == 0


def test_without_the_word_coils_it_is_a_magnet():
    model = load(ROUND + body("rod", rod("rod", 8, 25, 40)), "rod", act="magnets iron")
    off, on = (state(model, drive).body("rod").xfrc_applied for drive in (0.0, 5.0))
    assert off[2] == on[2] < 0


def test_a_ring_through_the_coil_is_refused():
    sides = (
        box("up", (-5, 25), (-5, 5), (10, 16)) + box("side", (18, 25), (-5, 5), (-16, 16))
        + box("low", (-5, 25), (-5, 5), (-16, -10)) + box("post", (-5, 5), (-5, 5), (-10, 10))
    )  # fmt: skip
    bodies = SQUARE + sides + body("ball", '<geom name="ball" size=".005"/>', 'pos="0 0 .03"')
    state(load(bodies, "side low post ball", spacing=0.01))
    with pytest.raises(mujoco.FatalError, match="form a ring through the coil of geom 0 'coil'"):
        state(load(bodies, "up side low post ball", spacing=0.01))


def test_what_fits_may_be_in_a_coil():
    """Neither a core nor a plunger is a finding; iron that is wider than the bore is one."""
    slide = '<joint type="slide" axis="0 0 1" range="0 .02" limited="true"/>'
    plunger = f'<body pos="0 0 .01">{slide}{rod("rod", 8, -20, 20)}</body>'
    report = mm.check(load(ROUND + plunger, "rod"))
    assert not report.findings
    assert any("is a coil, a cylinder" in note for note in report.notes)
    cored = load(ROUND + POST + body("pellet", DISK), "post pellet")
    assert not any("overlap" in finding for finding in mm.check(cored).findings)
    wide = f"<body>{slide}{rod('rod', 12, -20, 20)}</body>"
    assert "overlap" in mm.check(load(ROUND + wide, "rod")).findings[0]


def test_a_coil_that_is_added_to_a_spec_acts():
    spec = mujoco.MjSpec.from_string(
        "<mujoco><size nuser_geom='3'/><option gravity='0 0 0'/><worldbody><site name='fixed'/>"
        f"{ROUND}{body('rod', rod('rod', 8, 25, 40))}</worldbody>"
        "<actuator><general name='current' site='fixed' gainprm='0'/></actuator></mujoco>"
    )
    mm.add_coil(spec, spec.actuator("current"), [spec.geom("coil")])
    mm.add_iron(spec, [spec.geom("rod")], 1000)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[0] = DRIVE
    mujoco.mj_forward(model, data)
    expected = state(load(ROUND + body("rod", rod("rod", 8, 25, 40)), "rod"))
    assert data.qfrc_passive[2] == expected.body("rod").xfrc_applied[2] < 0
    assert mm.describe(model).coils == {"coil": ("current", 1)}
