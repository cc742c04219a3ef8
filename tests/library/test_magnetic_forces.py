"""Forces and torques of dipoles, fields, coils, iron and images, against an energy in NumPy.

The truth is `tests/magnetic_energy.py`, differentiated by complex steps.
"""

import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy
from magnetic_energy import Body, Piece, energy, wrench
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.mjcf.field_and_energy import dipole_sites
from magmotor.numerics.iron import response

FLOOR = np.array([0.01, -0.02, -0.11]), Rotation.from_euler("xyz", [4, -7, 0], True)
CHI, WEAK, MIRROR = 1500.0, 0.8, 30.0
BACKGROUND = (0.02, -0.01, 0.03)
GRADIENT = (0.01, 0.02, -0.03, 1.0, 2.0, -1.0, 0.5, 0.7)
QUADRATIC = np.random.default_rng(5).normal(size=(3, 3, 3))
GRID = (5, 6, 7), np.array([-0.3, -0.35, -0.4]), np.array([0.15, 0.14, 0.13])
DRIVE, SATURATION = 0.7, 0.9
DRIVEN = DRIVE / np.sqrt(1 + (DRIVE / SATURATION) ** 2)

CURRENT = '<element objtype="actuator" objname="current" prm="0.9"/>'
MODEL = """
<mujoco>
  {extension}
  <option gravity="0 0 0" timestep="1e-4" integrator="RK4"/>
  <custom>
    <text name="magmotor" data="{words}"/>
    <numeric name="field_uniform" data="{uniform}"/>
    <numeric name="field_gradient" data="{gradient}"/>
    <numeric name="field_table" data="{table}"/>
    <numeric name="soft" data="{soft}"/>
    <numeric name="weak" data="{weak}"/>
    <numeric name="of_floor" data="{mirror}"/>
    <tuple name="field of the frame">
      <element objtype="numeric" objname="{carried}"/>
      <element objtype="site" objname="frame"/>
      {current}
    </tuple>
    <tuple name="coil"><element objtype="actuator" objname="current"/>
      <element objtype="body" objname="b"/></tuple>
    <tuple name="iron"><element objtype="numeric" objname="soft"/>
      <element objtype="geom" objname="ball"/><element objtype="geom" objname="egg"/></tuple>
    <tuple name="iron too"><element objtype="numeric" objname="weak"/>
      <element objtype="geom" objname="rod"/></tuple>
    <tuple name="iron floor"><element objtype="numeric" objname="of_floor"/>
      <element objtype="geom" objname="floor"/></tuple>
  </custom>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0.01 -0.02 -0.11" quat="{floor}"/>
    <site pos="0.05 0.12 0.02" zaxis="1 2 3" user="1.5"/>
    <body name="a" pos="0.1 0 0"><freejoint/>
      <geom name="ball" size="0.01"/>
      <site pos="0.02 0.01 0" zaxis="1 -1 0" user="0.2"/>
      <site pos="0.02 -0.01 0.01" zaxis="1 0 1" user="-0.3"/>
    </body>
    <body name="b" pos="-0.1 0.03 0"><freejoint/>
      <geom name="egg" type="ellipsoid" size="0.01 0.02 0.013" pos="0.03 0 0" quat="1 2 3 4"/>
      <site pos="0.02 0.03 0" zaxis="1 0 0" user="0.2"/>
    </body>
    <body name="c" pos="-0.05 -0.04 0.07"><freejoint/>
      <geom name="rod" type="capsule" size="0.01 0.02" quat="4 3 2 1"/>
      <site name="frame" pos="0.01 0.02 0.03" quat="1 0 2 0"/>
      <site pos="0.02 0.02 0" zaxis="0 1 1" user="0.2"/>
    </body>
  </worldbody>
  <actuator><general name="current" site="frame" gainprm="0" ctrllimited="true" ctrlrange="0 0.7"/>
  </actuator>
</mujoco>
"""
PLUGIN = '<extension><plugin plugin="magmotor.forces"><instance name="m"/></plugin></extension>'


def text(numbers):
    return " ".join(repr(float(number)) for number in np.ravel(numbers))


def quadratic(position):
    return np.einsum("kij,i,j->k", QUADRATIC, position, position)


def table():
    count, first, spacing = GRID
    nodes = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1)
    points = first + spacing * nodes
    values = np.einsum("kij,...i,...j->...k", QUADRATIC, points, points)
    return np.concatenate([count, first, spacing, values.ravel()])


def gradient(position):
    xx, xy, xz, yy, yz = GRADIENT[3:]
    return GRADIENT[:3] + np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]]) @ position


FIELDS = {
    "field_uniform": lambda position: np.array(BACKGROUND),
    "field_gradient": gradient,
    "field_table": quadratic,
}
"""The fields in their own frames."""


def placed(function, scale):
    """A field in the frame of a body."""
    return lambda position, origin, axes: scale * axes @ function(axes.T @ (position - origin))


def mjcf(
    words="dipoles fields coils iron", extension="", saturation="", *, carried="field_gradient",
    driven=True,
):  # fmt: skip
    return MODEL.format(
        carried=carried, current=CURRENT * driven,
        words=words, uniform=text(BACKGROUND), gradient=text(GRADIENT), table=text(table()),
        soft=f"{CHI} {saturation}", weak=WEAK, mirror=MIRROR, extension=extension,
        floor=text(FLOOR[1].as_quat(scalar_first=True)),
    )  # fmt: skip


def scene(words="dipoles fields coils iron", extension="", seed=1, saturation="", **fields):
    model = mujoco.MjModel.from_xml_string(mjcf(words, extension, saturation, **fields))
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, np.random.default_rng(seed).normal(size=18), 0.05)
    data.ctrl[:] = 2.0  # beyond the range
    mujoco.mj_forward(model, data)
    return model, data


def truth(model, data, words, *, carried="field_gradient", driven=True):
    """The bodies of the model, as the energy in NumPy knows them."""
    moments = model.site_user[:, 0].copy()
    if "coils" in words:
        moments[model.site_bodyid == model.body("b").id] *= DRIVE
    bodies = [Body(center) for center in data.xipos]
    if "dipoles" in words:
        for site in np.flatnonzero(moments):
            axis = data.site_xmat[site].reshape(3, 3)[:, 2]
            dipole = data.site_xpos[site], moments[site] * axis
            bodies[model.site_bodyid[site]].dipoles.append(dipole)
    if "fields" in words:
        frame = data.site("frame")
        for name, function in FIELDS.items():
            scale = DRIVEN if driven and name == carried else 1.0
            bodies[3 * (name == carried)].fields.append(placed(function, scale))
        bodies[3].origin, bodies[3].axes = frame.xpos, frame.xmat.reshape(3, 3)
    if "iron" not in words:
        return bodies, None
    for name, body, chi in (("ball", 1, CHI), ("egg", 2, CHI), ("rod", 3, WEAK)):
        kind, size = int(model.geom(name).type[0]), model.geom(name).size
        alone, geom = response.of_geom(kind, size, chi), data.geom(name)
        points = geom.xpos + alone.points @ geom.xmat.reshape(3, 3).T
        extent = float(model.geom(name).rbound[0])
        piece = Piece(points, alone.matrix, alone.radius, geom.xpos.copy(), extent)
        bodies[body].iron.append(piece)
    return bodies, (FLOOR[0], FLOOR[1].as_matrix()[:, 2], MIRROR / (MIRROR + 2))


WORDS = ("dipoles", "dipoles fields", "dipoles coils", "dipoles iron", "iron fields",
         "dipoles fields coils iron")  # fmt: skip


ALL = "dipoles fields coils iron"


@pytest.mark.parametrize(("words", "seed", "carried", "driven"), [
    *((words, seed, "field_gradient", True) for words in WORDS for seed in (1, 2)),
    (ALL, 1, "field_gradient", False),
    *((ALL, 1, carried, d) for carried in ("field_uniform", "field_table") for d in (True, False)),
])  # fmt: skip
def test_the_wrenches_are_derivatives_of_the_energy(words, seed, carried, driven):
    """Those on the body that carries one of the fields are the reactions."""
    model, data = scene(words, seed=seed, carried=carried, driven=driven)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    bodies, mirror = truth(model, data, words, carried=carried, driven=driven)
    expected = np.array([wrench(bodies, body, mirror) for body in (1, 2, 3)])
    found = data.xfrc_applied[1:4]
    for part in (slice(0, 3), slice(3, 6)):
        scale = np.linalg.norm(expected[:, part], axis=1).max()
        assert abs(found[:, part] - expected[:, part]).max() < 1e-13 * scale  # 3.8e-15
    assert mm.magnetic_energy(model, data) == pytest.approx(
        energy(bodies, mirror).real, rel=1e-14, abs=0  # 6e-16
    )  # fmt: skip


@pytest.mark.parametrize("words", WORDS)
def test_the_plugin_applies_the_same_forces(words):
    model, data = scene(words)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    model, other = scene(words, PLUGIN)
    np.testing.assert_allclose(other.qacc, data.qacc, rtol=0, atol=1e-15 * abs(data.qacc).max())


def test_the_wrenches_of_iron_that_saturates_are_derivatives_of_the_energy():
    """By central differences of fourth order, at an iron ball that is saturated by 59 %."""
    words = "dipoles fields coils iron"
    model, data = scene(words, saturation="6e5")
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    forces = np.zeros(model.nv)
    for body in (1, 2, 3):
        force, torque = data.xfrc_applied[body, :3], data.xfrc_applied[body, 3:]
        mujoco.mj_applyFT(model, data, force, torque, data.xipos[body], body, forces)
    _, moments, _ = dipole_sites(model, data)
    saturated = np.linalg.norm(moments[-3]) / (6e5 * 4 / 3 * np.pi * 0.01**3)
    assert saturated == pytest.approx(0.589, abs=0.01)
    near, far = (forces_by_energy(model, data, step) for step in (1e-5, 2e-5))
    errors = abs((4 * near - far) / 3 - forces).reshape(-1, 2, 3).max(axis=(0, 2))
    assert (errors < 1e-8 * abs(forces).reshape(-1, 2, 3)[:, :, 0].max(axis=0)).all()  # 1e-9


@pytest.mark.parametrize("words", ["dipoles", "dipoles iron", "dipoles fields coils iron"])
def test_free_bodies_act_on_each_other_with_opposite_wrenches(words):
    """In a model without what is fixed to the world: floor, fields and a dipole."""
    fixed = ('name="floor"', "field_uniform", "field_table", '<site pos="0.05 0.12', "iron floor",
             "of_floor", 'objname="floor"')  # fmt: skip
    lines = [line for line in mjcf(words).splitlines() if not any(word in line for word in fixed)]
    model = mujoco.MjModel.from_xml_string("\n".join(lines))
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    forces, torques = data.xfrc_applied[:, :3], data.xfrc_applied[:, 3:]
    assert abs(forces.sum(axis=0)).max() < 5e-15 * abs(forces).max()  # 2.3e-16
    moments = torques + np.cross(data.xipos, forces)
    assert abs(moments.sum(axis=0)).max() < 1e-14 * abs(moments).max()  # 6e-16
