"""Geoms of iron that touch are one piece: cut bars; brackets, tubes and cups by finite elements.

NGSolve 6.2.2608 solved for the scalar potential with elements of second order, in a sphere of
0.3 m, and summed the Maxwell stress over a layer around the magnet: 1.0e5 to 1.6e5 unknowns. With
0.66e5 to 1.0e5, forces differ by 0.4 to 0.9 %, and elements of third order change them by 0.3 %.
The magnet is a box of 10 x 10 x 5 mm with 1.3 T along z.
"""

import math

import mujoco
import numpy as np
import pytest
from energy_slopes import wrenches_by_energy

import magmotor as mm
from magmotor.mjcf.checking.touching_iron import unions_of
from magmotor.numerics.iron import response
from magmotor.numerics.iron.unions import Union

MODEL = """
<mujoco>
  <option gravity="0 0 0"/>
  <size nuser_geom="3" memory="10M"/>
  <custom>
    <text name="magmotor" data="magnets iron"/>
    <numeric name="steel" data="1000"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>{names}</tuple>
  </custom>
  <worldbody>
    <body name="iron" pos=".003 -.002 .001" euler="20 30 50"><freejoint/>{geoms}</body>
    <body name="magnet"><freejoint/>
      <geom type="box" size=".005 .005 .0025" user="0 0 1.3" contype="0" conaffinity="0"/></body>
  </worldbody>
</mujoco>
"""

BRACKET = [[20, 10, 2, 0, 0, 0], [2, 10, 15, -18, 0, 17]]
TUBE = [[15, 2, 30, 0, y, 0] for y in (13, -13)] + [[2, 11, 30, x, 0, 0] for x in (13, -13)]
CUP = [
    [15, 15, 2, 0, 0, 0],
    *([15, 2, 8, 0, y, 10] for y in (13, -13)),
    *([2, 11, 8, x, 0, 10] for x in (13, -13)),
]
"""Boxes: half of their edges, and their centers, in mm."""


def box(half_x, half_y, half_z, x, y, z):
    sizes = " ".join(f"{length}e-3" for length in (half_x, half_y, half_z))
    return f'type="box" size="{sizes}" pos="{x}e-3 {y}e-3 {z}e-3"'


def rod(radius, half, x, y, z):
    return f'type="cylinder" size="{radius}e-3 {half}e-3" pos="{x}e-3 {y}e-3 {z}e-3"'


def load(geoms):
    """A model; a geom may start a body, which is fixed to the one of iron."""
    names = "".join(f'<element objtype="geom" objname="{k}"/>' for k in range(len(geoms)))
    text = "".join(
        f'<body {geom[5:]}><geom name="{k}" type="box" size=".005 .005 .01"/></body>'
        if geom.startswith("body ")
        else f'<geom name="{k}" {geom} contype="0" conaffinity="0"/>'
        for k, geom in enumerate(geoms)
    )
    return mujoco.MjModel.from_xml_string(MODEL.format(names=names, geoms=text))


def with_magnet(model, place, turn=(0, 0, 0)):
    """Data with the magnet at a place in mm, and turned, both relative to the body of iron."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    frame = data.body("iron").xmat.reshape(3, 3)
    data.qpos[7:10] = data.body("iron").xpos + frame @ np.array(place) * 1e-3
    start, own, whole = data.qpos[3:7].copy(), np.zeros(4), np.zeros(4)
    mujoco.mju_euler2Quat(own, np.radians(turn), "xyz")
    mujoco.mju_mulQuat(whole, start, own)
    data.qpos[10:14] = whole
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return data


def wrench(model, place):
    """Force in N and torque in mN m on the magnet, along the axes of iron, and the energy in J."""
    data = with_magnet(model, place)
    frame = data.body("iron").xmat.reshape(3, 3)
    force, torque = data.body("magnet").xfrc_applied.reshape(2, 3) @ frame
    return np.concatenate([force, 1e3 * torque]), mm.magnetic_energy(model, data)


@pytest.fixture(scope="module")
def bracket():
    return load([box(*each) for each in BRACKET])


@pytest.fixture(scope="module")
def cup():
    return load([box(*each) for each in CUP])


def assert_same(found, expected):
    """Rounding decides which panels are as near as others, and have more points of quadrature."""
    assert np.abs(found[0] - expected[0]).max() < 2e-5 * np.abs(expected[0]).max()  # 2.4e-6
    assert found[1] == pytest.approx(expected[1], rel=3e-5)  # 7.8e-6


CUTS = {
    "two": [box(5, 5, 15, 0, 0, -15), box(5, 5, 15, 0, 0, 15)],
    "three, one turned": [
        box(5, 5, 10, 0, 0, -20),
        box(5, 10, 5, 0, 0, 0) + ' euler="90 0 0"',
        box(5, 5, 10, 0, 0, 20),
    ],
    "overlapping": [box(5, 5, 20, 0, 0, -10), box(5, 5, 20, 0, 0, 10)],
    "one inside": [box(5, 5, 30, 0, 0, 0), box(2, 2, 3, 0, 1, 0)],
    "of two bodies": [box(5, 5, 20, 0, 0, -10), 'body pos="0 0 .02" euler="0 0 90"'],
}


@pytest.mark.parametrize("cut", CUTS)
def test_a_bar_is_the_same_if_it_is_cut(cut):
    whole, parts = load([box(5, 5, 30, 0, 0, 0)]), load(CUTS[cut])
    for place in ([1, 2, 37], [11, -1, 3], [5.5, 0, 31]):
        assert_same(wrench(parts, place), wrench(whole, place))


def test_a_rod_is_the_same_if_it_is_cut():
    whole = load([rod(5, 20, 0, 0, 0)])
    parts = load([rod(5, 12, 0, 0, 8), rod(5, 10, 0, 0, -10) + ' euler="180 0 30"'])
    assert_same(wrench(parts, [1, 2, 24]), wrench(whole, [1, 2, 24]))


KNOWN = {
    "over the floor": ((-6, 1, 8), (-0.545, -0.013, -4.016), 0.05),
    "over the wall": ((-17, 0, 38), (-0.302, -0.001, -2.827), 0.06),
    "on the floor": ((5, 0, 5), (-0.09, 0.0, -22.61), 0.02),
    "in the corner": ((-10.5, 0, 5), (-7.92, 0.0, -25.77), 0.015),
}
"""Places near the bracket, in mm: forces in N, and the bound of the error over the force."""


def judge(model, place, force, bound):
    found = wrench(model, place)[0][:3]
    assert np.linalg.norm(found - force) < bound * np.linalg.norm(force)


@pytest.mark.parametrize("where", KNOWN)
def test_a_bracket_by_finite_elements(bracket, where):
    judge(bracket, *KNOWN[where])  # 0.039, 0.039, 0.011, 0.006


def test_a_tube_by_finite_elements():
    tube = load([box(*each) for each in TUBE])
    judge(tube, (0, 20.5, 5), (0.0, -10.63, 0.0), 0.01)  # 0.0033


def test_a_cup_by_finite_elements(cup):
    judge(cup, (0, 0, 5), (0.0, 0.0, -23.62), 0.05)  # 0.033


@pytest.mark.parametrize("place", [(5, 0, 12), (-8, 3, 8.5), (-10, 8, 6), (-15, 0, 36)])
def test_forces_on_a_union_are_derivatives_of_the_energy(bracket, place):
    data = with_magnet(bracket, place, (10, 20, 5))
    force = data.xfrc_applied.reshape(-1, 2, 3)
    arms = data.xipos[1:, None]
    total = force[1:].sum(axis=0)
    total[1] += np.cross(arms, force[1:, :1]).sum(axis=(0, 1))
    assert np.abs(total).max() < 1e-14 * np.abs(force).max()  # 1e-15
    found = wrenches_by_energy(bracket, data, 2, 3 * [5e-7] + 3 * [5e-5])[1]
    assert found[0] == pytest.approx(force[2, 0], abs=1e-4)  # 1.2e-5
    assert found[1] == pytest.approx(force[2, 1], abs=5e-6)  # 5.5e-7


@pytest.mark.parametrize(
    ("geoms", "expected"),
    [
        ([box(5, 5, 5, 0, 0, 0), box(5, 5, 5, 10, 10, 0)], [0, 1]),  # an edge only
        ([box(5, 5, 5, 0, 0, 0), box(5, 5, 5, 10.0001, 0, 0)], [0, 1]),
        ([box(5, 5, 5, 0, 0, 0), box(5, 5, 5, 9, 9, 9)], [0, 0]),
        ([box(5, 5, 5, 0, 0, 0), box(5, 5, 5, 10, 0, 0) + ' euler="0 0 0.001"'], [0, 1]),
        ([box(5, 5, 5, 0, 0, 0), box(5, 5, 5, 20, 0, 0), box(6, 5, 5, 10, 0, 0)], [0, 0, 0]),
        ([box(5, 5, 5, 0, 0, 0), rod(5, 5, 0, 0, 10)], [0, 1]),
        ([rod(5, 5, 0, 0, 0), rod(3, 5, 0, 0, 10)], [0, 0]),
        ([rod(5, 5, 0, 0, 0), rod(3, 5, 0.001, 0, 10)], [0, 1]),
        ([rod(5, 5, 0, 0, 0), rod(3, 5, 0, 0, 10.001)], [0, 1]),
        ([rod(5, 5, 0, 0, 0), rod(3, 5, 0, 0, 10) + ' euler="0.01 0 0"'], [0, 1]),
    ],
)
def test_what_is_one_piece(geoms, expected):
    model = load(geoms)
    assert unions_of(model, len(geoms))[0].tolist() == expected
    said = "touches geom '0' of its rigid body but is not one piece with it"
    assert (said in str(mm.check(model))) == (expected[-1] != 0)


def union(boxes):
    sizes = np.array(boxes, dtype=float)
    return Union(sizes[:, 3:] - sizes[:, :3], sizes[:, 3:] + sizes[:, :3], 1e-6)


@pytest.mark.parametrize(
    ("boxes", "count", "area"),
    [
        ([[1, 2, 3, 0, 0, 0]], 6, 88),
        (BRACKET, 10, 2080 + 1600 - 2 * 80),
        (TUBE, 16, 2 * 4320 + 2 * 3296 - 8 * 240),
        (CUP, 14, 2280 + 2 * 1328 + 2 * 1008 - 4 * 120 - 4 * 88 - 8 * 64),
        ([[1, 1, 1, 0, 0, 0], [1, 1, 1, 1, 1, 1]], 18, 42),
    ],
)
def test_the_surface_is_that_of_the_whole(boxes, count, area):
    found = union(boxes).rectangles()
    areas = [math.prod(np.delete(each.upper - each.lower, each.axis)) for each in found]
    assert (len(found), sum(areas)) == (count, pytest.approx(area, rel=1e-12))
    normals = np.zeros(3)
    for each, size in zip(found, areas, strict=True):
        normals[each.axis] += each.side * size
    assert np.abs(normals).max() < 1e-9


def test_a_disk_between_disks_is_a_rod_with_a_flange():
    """The volume is exact, and no charge is left over."""
    found = response.cylinders(
        np.array([3.0, 10.0]), np.array([15.0, 2.0]), np.array([1.0, 9.0]), 1000.0
    )
    assert found.volume == pytest.approx(np.pi * (9 * 30 + 91 * 4), rel=1e-12)
    assert found.center == pytest.approx([0, 0, 1.0], abs=1e-12)
    assert np.abs(found.matrix.sum(axis=0)).max() < 1e-12 * np.abs(found.matrix).max()


def test_a_fixed_body_that_moves_needs_no_new_response():
    from magmotor.mjcf.forces import responses

    text = MODEL.replace('pos=".003 -.002 .001" euler="20 30 50"><freejoint/>', ">")
    names = "".join(f'<element objtype="geom" objname="{k}"/>' for k in range(2))
    geoms = "".join(f'<geom name="{k}" {box(*each)}/>' for k, each in enumerate(BRACKET))
    model = mujoco.MjModel.from_xml_string(text.format(names=names, geoms=geoms))
    data = mujoco.MjData(model)
    model.body("magnet").pos[:] = 0, 0, 0.05
    with mm.magnetism():
        mujoco.mj_forward(model, data)
        before = len(responses.kept())
        for shift in (0.1234567, 1e-3, -0.777):
            model.body("iron").pos[:] = shift
            mujoco.mj_forward(model, data)
    assert len(responses.kept()) == before


MAGNETS = {
    "a site": '<site user=".4"/>',
    "sites": "".join(f'<site pos="{k}e-5 0 0" user=".02"/>' for k in range(-10, 11)),
    "a geom": '<geom type="cylinder" size=".004 .002" user="0 0 1.2" contype="0"/>',
}


@pytest.mark.parametrize("magnet", MAGNETS)
def test_the_center_of_a_tube_is_not_in_iron(magnet):
    """A magnet may be there, where by symmetry nothing pulls it, and the field is known there."""
    names = "".join(f'<element objtype="geom" objname="{k}"/>' for k in range(4))
    walls = "".join(f'<geom name="{k}" {box(*each)}/>' for k, each in enumerate(TUBE))
    text = MODEL.format(names=names, geoms=walls).replace('data="', 'data="dipoles ', 1)
    start, end = text.index('<geom type="box" size=".005'), text.index("</body>\n  </worldbody>")
    core = '<geom size=".001" contype="0"/>' + MAGNETS[magnet]
    model = mujoco.MjModel.from_xml_string(text[:start] + core + text[end:])
    pulls = [
        np.linalg.norm(with_magnet(model, [0, 0, height]).body("magnet").xfrc_applied[:3])
        for height in (0, 1)
    ]
    assert pulls[0] < 1e-4 * pulls[1]  # 8e-6
    data = with_magnet(model, [0, 0, 40])
    center = data.body("iron").xpos
    at, beside = (mm.field(model, data, center + height) for height in (0.0, 1e-7))
    assert np.linalg.norm(at - beside) < 1e-4 * np.linalg.norm(at)  # 2e-5
