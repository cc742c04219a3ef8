"""Permanent magnets: moment, dipoles and MJCF, compared with magpylib's closed forms.

magpylib's field is exact. Its force between two magnets is a sum over cells, whose error is of the
second order in the size of the cells.
"""

import itertools
import math
import re
from functools import cache
from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor import dipoles
from magmotor.numerics.magnet_shapes import cuboid, cylinder

Z, X, OBLIQUE = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 2.0, -1.5)
MARK = '<custom><text name="magmotor" data="dipoles"/></custom>'


def exact(magnet):
    """The same magnet by magpylib."""
    polarization = magnet.remanence * np.array(magnet.direction)
    if magnet.shape == "cuboid":
        return magpylib.magnet.Cuboid(dimension=magnet.size, polarization=polarization)
    if magnet.shape == "cylinder":
        return magpylib.magnet.Cylinder(dimension=magnet.size, polarization=polarization)
    if magnet.shape == "sphere":
        return magpylib.magnet.Sphere(diameter=magnet.size[0], polarization=polarization)
    inner, outer, height = magnet.size
    dimension = (inner / 2, outer / 2, height, 0, 360)
    return magpylib.magnet.CylinderSegment(dimension=dimension, polarization=polarization)


def tube(magnet):
    """Inner and outer diameter and height."""
    return magnet.size if magnet.shape == "ring" else (0, *magnet.size)


def distance(magnet, points):
    """Distance of points outside from the surface."""
    if magnet.shape == "cuboid":
        beyond = abs(points) - np.array(magnet.size) / 2
    else:
        inner, outer, height = tube(magnet)
        radius = np.hypot(points[:, 0], points[:, 1])
        wall = np.maximum(radius - outer / 2, inner / 2 - radius)
        beyond = np.stack([wall, abs(points[:, 2]) - height / 2], axis=-1)
    return np.linalg.norm(np.maximum(beyond, 0), axis=1)


def shell(magnet, gap, count=1000):
    """Random points whose distance from the surface is the gap, or at most 2 % more."""
    rng = np.random.default_rng(3)
    size = magnet.size if magnet.shape == "cuboid" else (*(2 * [tube(magnet)[1]]), magnet.size[-1])
    found = np.empty((0, 3))
    while len(found) < count:
        points = rng.uniform(-1, 1, (400_000, 3)) * (np.array(size) / 2 + 1.02 * gap)
        away = distance(magnet, points)
        found = np.concatenate([found, points[(away > gap) & (away < 1.02 * gap)]])
    return found[:count]


def field_error(magnet, layout, points):
    """Largest relative error of the field at points of about the same distance."""
    true = exact(magnet).getB(points)
    strength = np.linalg.norm(true, axis=1)
    difference = np.linalg.norm(dipoles.field(points, *layout) - true, axis=1)
    return (difference / np.maximum(strength, 0.1 * strength.max())).max()


@pytest.mark.parametrize(
    ("shape", "size", "volume"),
    [
        ("cuboid", (0.01, 0.012, 0.005), 6e-7),
        ("cylinder", (0.01, 0.005), math.pi * 1.25e-7),
        ("ring", (0.004, 0.01, 0.005), math.pi * 1.05e-7),
        ("sphere", 0.01, math.pi / 6 * 1e-6),
    ],
)
def test_moment_and_mass(shape, size, volume):
    magnet = mm.magnet(shape, size, grade="N42", direction=(0, 3, 4))
    assert magnet.remanence == 1.3
    assert magnet.volume == pytest.approx(volume, rel=1e-14, abs=0)  # 4e-16
    assert magnet.mass == pytest.approx(7500 * volume, rel=1e-14, abs=0)
    true = exact(magnet).dipole_moment
    # magpylib has the measured mu0, which differs from 4e-7 pi by 1.3e-10.
    assert magnet.moment * np.array([0, 0.6, 0.8]) == pytest.approx(
        true, rel=2e-9, abs=0
    )  # 1.3e-10


def test_the_mass_is_that_of_the_material():
    edges = (0.01, 0.01, 0.01)
    assert mm.magnet("cuboid", edges, grade="C5").mass == pytest.approx(4.9e-3)
    assert mm.magnet("cuboid", edges, remanence=1).mass == pytest.approx(7.5e-3)
    assert mm.magnet("cuboid", edges, grade="C5", density=5000).mass == pytest.approx(5e-3)


CASES = [
    ("cuboid", (10, 10, 10), Z, 3, 0.05),
    ("cuboid", (10, 10, 10), OBLIQUE, 10, 1e-4),
    ("cuboid", (10, 10, 2), Z, 3, 0.01),
    ("cuboid", (10, 10, 2), X, 2, 0.05),
    ("cuboid", (40, 10, 10), OBLIQUE, 10, 0.01),
    ("cuboid", (20, 10, 5), Z, 10, 0.01),
    ("cylinder", (10, 10), Z, 3, 0.05),
    ("cylinder", (10, 2), Z, 3, 0.05),
    ("cylinder", (10, 2), X, 2, 0.05),
    ("cylinder", (10, 30), Z, 10, 0.01),
    ("ring", (5, 10, 3), Z, 1.5, 0.05),
    ("ring", (8, 10, 3), OBLIQUE, 3, 0.01),
    ("ring", (3, 10, 10), Z, 10, 0.01),
    ("ring", (9, 10, 20), X, 3, 0.05),
]
"""Shapes in mm, magnetization, gaps in mm, errors."""


@pytest.mark.parametrize(("shape", "size", "direction", "gap", "error"), CASES)
def test_the_field_is_as_accurate_as_required(shape, size, direction, gap, error):
    magnet = mm.magnet(shape, 1e-3 * np.array(size), remanence=1.2, direction=direction)
    layout = magnet.dipoles(error, 1e-3 * gap)
    assert layout[1].sum(axis=0) == pytest.approx(
        magnet.moment * np.array(magnet.direction), rel=1e-13, abs=1e-16
    )
    found = [field_error(magnet, layout, shell(magnet, 1e-3 * gap * f)) for f in (1, 1.5, 4)]
    assert max(found) < error  # 0.31 to 0.88 of it


@pytest.mark.parametrize(
    ("shape", "size", "gap", "error", "count"),
    [
        ("cuboid", (10, 10, 2), 10, 0.01, 9),
        ("cuboid", (20, 10, 5), 10, 0.01, 8),
        ("cylinder", (10, 2), 10, 0.01, 6),
        ("cylinder", (10, 2), 3, 0.05, 13),
        ("ring", (5, 10, 3), 10, 0.01, 5),
        ("ring", (8, 10, 3), 10, 0.01, 12),
    ],
)
def test_no_smaller_layout_would_do(shape, size, gap, error, count):
    magnet = mm.magnet(shape, 1e-3 * np.array(size), remanence=1.2)
    assert len(magnet.dipoles(error, 1e-3 * gap)[0]) == count
    points = shell(magnet, 1e-3 * gap)
    found = []
    few = range(1, count)
    for i, j, k, even in itertools.product(few, few, few, (False, True)):
        if shape == "cuboid":
            x, y, z = magnet.size
            places, parts = cuboid((x, y, z), (i, j, k), even)
        else:
            inner, outer, height = tube(magnet)
            places, parts = cylinder(height, outer / 2, inner / 2, (i, j, k), even)
            places = places[:, [1, 2, 0]]
        if len(places) < count:
            layout = places, magnet.moment * np.outer(parts, Z)
            found.append(field_error(magnet, layout, points))
    assert len(found) > 10
    assert min(found) > error  # 1.13 of it, or more


def test_a_sphere_is_one_dipole():
    ball = mm.magnet("sphere", 0.01, remanence=1.3, direction=OBLIQUE)
    positions, moments = ball.dipoles(1e-6, 1e-9)
    assert positions.tolist() == [[0, 0, 0]]
    points = shell(mm.magnet("cuboid", (0.01, 0.01, 0.01), remanence=1), 1e-3, 100)
    true = exact(ball).getB(points)
    found = dipoles.field(points, positions, moments)
    assert abs(found - true).max() < 3e-9 * abs(true).max()  # 1.3e-10, the measured mu0


def test_the_layout_depends_on_proportions_only():
    small, large = (mm.magnet("cuboid", (a, a, a / 4), remanence=1) for a in (1e-9, 0.64))
    points, moments = small.dipoles(0.01, 1e-9)
    others, stronger = large.dipoles(0.01, 0.64)
    assert np.allclose(others, 6.4e8 * points, rtol=1e-12, atol=1e-14)
    assert np.allclose(stronger, 6.4e8**3 * moments, rtol=1e-12, atol=0)


def test_far_away_one_dipole_suffices():
    needle = mm.magnet("cylinder", (0.001, 0.02), remanence=1)
    assert len(needle.dipoles(0.01, 0.5)[0]) == 1
    assert len(needle.dipoles(1e-6, 1e9)[0]) <= 2


# Forces ------------------------------------------------------------------------------------------

PAIRS = [
    ("cuboid", (10, 12, 5), (0, 0, 10), 0),
    ("cuboid", (10, 12, 5), (16, 3, 2), 30),
    ("cylinder", (10, 5), (0, 0, 10), 0),
    ("cylinder", (10, 5), (17, 0, 2), 40),
    ("ring", (4, 10, 5), (0, 0, 10), 0),
    ("ring", (4, 10, 5), (17, 0, 2), 40),
    ("sphere", 10, (12, 0, 2), 40),
]
"""Shapes in mm, offsets of an identical magnet in mm, and its turn about y in degrees.

The distance between the surfaces is 5 mm or a little more, except between the spheres.
"""


@cache
def reference(magnet, offset, turn):
    """Force and torque by magpylib on successively finer cells, and their extrapolation."""
    source, target = exact(magnet), exact(magnet)
    target.rotate_from_angax(turn, "y").move(offset)
    found = []
    for n in (4, 8, 16):
        cells = {"cuboid": (n, n, n), "sphere": None}.get(magnet.shape, (4 * n, n, n))
        wrench: Any = magpylib.getFT(source, target, meshing=cells, eps=1e-6)
        found.append(np.concatenate(wrench))
    return found, found[2] + (found[2] - found[1]) / 3


def relative(wrench, true):
    """Relative difference of the force, and of the torque if there is one."""
    force = np.linalg.norm(wrench[:3] - true[:3]) / np.linalg.norm(true[:3])
    size = np.linalg.norm(true[3:])
    return max(force, np.linalg.norm(wrench[3:] - true[3:]) / size) if size > 1e-9 else force


@pytest.mark.parametrize(("shape", "size", "offset", "turn"), PAIRS)
def test_forces_and_torques_in_mujoco_are_those_of_magpylib(shape, size, offset, turn):
    magnet = mm.magnet(shape, 1e-3 * np.array(size), grade="N42")
    offset = tuple(1e-3 * np.array(offset))
    (coarse, medium, _), true = reference(magnet, offset, turn)
    assert relative(medium + (medium - coarse) / 3, true) < 1e-3  # 4e-6 to 3.2e-4
    text = magnet.mjcf(error=0.01, gap=5e-3)
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>{MARK}
      <option timestep="1e-4"/><worldbody>{text}
      <body pos="{offset[0]} {offset[1]} {offset[2]}" euler="0 {turn} 0"><freejoint/>{text}</body>
    </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    assert relative(data.xfrc_applied[1], true) < 0.01  # 7e-5 to 2.5e-3


def wrench_of(layout, offset, turn=0):
    """Force and torque on a magnet at an offset from another one like it."""
    points, moments = layout
    frame = Rotation.from_euler("y", turn, degrees=True)
    places, turned = frame.apply(points), frame.apply(moments)
    force, torque = dipoles.wrench(places + np.array(offset), turned, points, moments)
    torque = torque + np.cross(places, force)
    return np.concatenate([force.sum(axis=0), torque.sum(axis=0)])


@pytest.mark.parametrize(("shape", "size", "offset", "turn"), PAIRS)
def test_an_accurate_layout_has_accurate_forces(shape, size, offset, turn):
    magnet = mm.magnet(shape, 1e-3 * np.array(size), grade="N42")
    offset = tuple(1e-3 * np.array(offset))
    found = wrench_of(magnet.dipoles(1e-3, 5e-3), offset, turn)
    assert relative(found, reference(magnet, offset, turn)[1]) < 1e-3  # 3e-5 to 2.3e-4


@pytest.mark.parametrize(
    ("shape", "size", "gap", "error"),
    [
        ("cylinder", (10, 10), 10, 0.05),
        ("cylinder", (10, 5), 10, 0.01),
        ("cylinder", (10, 20), 10, 0.05),
        ("ring", (9, 10, 20), 3, 0.05),
        ("cuboid", (10, 10, 2), 1.5, 0.05),
    ],
)
def test_forces_on_an_identical_magnet_above_or_beside_are_as_accurate_as_required(
    shape, size, gap, error
):
    """Smaller layouts have accurate fields here but not forces, for the cylinders."""
    magnet = mm.magnet(shape, 1e-3 * np.array(size), grade="N42")
    layout = magnet.dipoles(error, 1e-3 * gap)
    width = size[1] if shape == "ring" else size[0]
    found = []
    for offset in ((0, 0, size[-1] + gap), (width + gap, 0, 0)):
        offset = tuple(1e-3 * np.array(offset))
        true = reference(magnet, offset, 0)[1][:3]  # to 1e-3
        force = wrench_of(layout, offset)[:3]
        found.append(np.linalg.norm(force - true) / np.linalg.norm(true))
    assert max(found) < error  # 0.06 to 0.72 of it


# MJCF --------------------------------------------------------------------------------------------


def model_of(text, pose=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco>{MARK}<worldbody><body {pose}><freejoint/>{text}</body></worldbody></mujoco>"
    )


@pytest.mark.parametrize(
    ("shape", "size", "direction"),
    [
        ("cuboid", (10, 12, 5), OBLIQUE),
        ("cylinder", (10, 5), Z),
        ("ring", (4, 10, 5), X),
        ("ring", (9.7, 10, 5), Z),
        ("sphere", 10, X),
    ],
)
def test_the_model_has_the_mass_the_inertia_and_the_field(shape, size, direction):
    magnet = mm.magnet(shape, 1e-3 * np.array(size), grade="SmCo26", direction=direction)
    model = model_of(magnet.mjcf(0.01, 5e-3, name="a <magnet>"), 'pos="0.1 0.2 0.3"')
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.body_mass[1] == pytest.approx(magnet.mass, rel=3e-12, abs=0)  # 4e-13
    if shape == "cuboid":
        x, y, z = np.array(magnet.size) ** 2 / 12
        inertia = [y + z, x + z, x + y]
    elif shape == "sphere":
        inertia = 3 * [magnet.size[0] ** 2 / 10]
    else:
        inner, outer, height = tube(magnet)
        across = (inner**2 + outer**2) / 16 + height**2 / 12
        inertia = [across, across, (inner**2 + outer**2) / 8]
    found = np.sort(model.body_inertia[1]) / magnet.mass
    assert found == pytest.approx(np.sort(inertia), rel=1e-11, abs=0)
    points = 0.05 * np.random.default_rng(1).normal(size=(50, 3)) + [0.1, 0.2, 0.3]
    positions, moments = magnet.dipoles(0.01, 5e-3)
    expected = dipoles.field(points - [0.1, 0.2, 0.3], positions, moments)
    assert abs(mm.field(model, data, points) - expected).max() < 1e-10 * abs(expected).max()
    assert model.geom(0).name == "a <magnet>"
    assert model.site(model.nsite - 1).name == f"a <magnet> {model.nsite - 1}"


@pytest.mark.parametrize("inner", [4, 9.7])
def test_a_ring_can_be_touched_from_inside_and_outside(inner):
    """A peg of the hole's radius fits, a wider one does not, nor does one inside the wall."""
    ring = mm.magnet("ring", (1e-3 * inner, 0.01, 5e-3), grade="N42").mjcf(0.1, 0.02)
    outer = 5e-3 - 0.5e-3 * inner

    def contacts(x, radius, angle=0.0):
        place = f"{x * math.cos(angle)} {x * math.sin(angle)} 0"
        peg = f'<body pos="{place}"><geom type="cylinder" size="{radius} 0.02"/></body>'
        text = f"<mujoco><worldbody><body><freejoint/>{ring}</body>{peg}</worldbody></mujoco>"
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return data.ncon

    assert contacts(0, 0.499e-3 * inner) == 0
    assert contacts(0, 0.52e-3 * inner) > 0
    assert contacts(5e-3 - outer / 2, outer / 4) > 0
    for angle in np.linspace(0, math.pi / 8, 7):  # outside, also at the corners of the boxes
        assert contacts(6.03e-3, 1e-3, angle) == 0
    assert contacts(5.9e-3, 1e-3, math.pi / 16) > 0


def test_a_magnet_joins_a_body_of_another_model():
    text = mm.magnet("cylinder", (0.01, 0.005), grade="N42").mjcf(0.01, 0.02, name="disk")
    spec = mujoco.MjSpec.from_string(
        f"<mujoco>{MARK}<worldbody><body name='arm'/></worldbody></mujoco>"
    )
    piece = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    spec.attach(piece, prefix="left ", frame=spec.body("arm").add_frame(pos=[0, 0, 1]))
    model = spec.compile()
    assert model.nbody == 2
    assert (model.site_bodyid == model.body("arm").id).all()
    assert model.site_user.sum() == pytest.approx(1.3 * math.pi * 1.25e-7 / (4e-7 * math.pi))
    assert model.site("left disk 0").pos[2] == pytest.approx(1, abs=0.003)


# Bad input ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "size", "count"),
    [
        ("cuboid", (0.01, 0.01, 0.002), 30),
        ("cuboid", (0.02, 0.01, 0.005), 8),
        ("cylinder", (0.01, 0.005), 5),
        ("cylinder", (0.005, 0.02), 5),
        ("cuboid", (0.005, 0.005, 0.02), 5),
    ],
)
def test_too_small_a_gap_leads_to_the_layout_for_contact(shape, size, count):
    """With the numbers of dipoles of the table in docs/contact.md."""
    magnet = mm.magnet(shape, size, grade="N42")
    with refused("error") as caught:
        magnet.dipoles(0.01, 1e-5)
    error, gap = re.findall(r"error=([\d.]+) and gap=([\d.e-]+)", str(caught.value))[0]
    assert len(magnet.dipoles(float(error), float(gap))[0]) == count


def test_sizes_that_may_be_millimeters_are_doubted():
    with pytest.warns(UserWarning, match="millimeters") as warned:
        mm.magnet("cylinder", (10, 5), grade="N42")
    assert warned[0].filename == __file__
    mm.magnet("cylinder", (0.99, 0.5), grade="N42")
