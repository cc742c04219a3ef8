"""`check` of magnets with many dipoles, or that touch at a distance.

The true force of magnets that touch is magpylib's, by cells, with an error of a few percent.
"""

from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor import dipoles
from magmotor.mjcf.checking.closest_approach import meetings

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MODEL = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <custom><text name="magmotor" data="dipoles iron"/>{custom}</custom>
  <worldbody>
    {world}
    <body name="left"><freejoint/>{left}</body>
    <body name="right" pos="0 0 {height}"><freejoint/>{right}</body>
  </worldbody>
</mujoco>
"""


def load(left, right=None, height=1.0, option="", custom="", world=""):
    text = MODEL.format(left=left, right=left if right is None else right, height=height,
                        option=option, custom=custom, world=world)  # fmt: skip
    return mujoco.MjModel.from_xml_string(text)


def approach_of(model) -> Any:
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.approach
    return found


def true_force(magnet, offset, turn):
    """Force of two touching magnets along the offset."""
    size, kind = magnet.size, magpylib.magnet
    polarization = (0, 0, magnet.remanence)
    make = kind.Cuboid if magnet.shape == "cuboid" else kind.Cylinder
    source, target = (make(dimension=size, polarization=polarization) for _ in range(2))
    target.rotate_from_angax(turn, "y").move(offset)
    cells = (20, 20, 20) if magnet.shape == "cuboid" else (60, 12, 20)
    force, _ = magpylib.getFT(source, target, meshing=cells, eps=1e-7)
    return force @ offset / np.linalg.norm(offset)


def ratios(magnet, layout):
    """Force of a layout over the true one, on top of each other and side by side.

    The same dipoles face each other.
    """
    points, moments = layout
    width, height = magnet.size[0], magnet.size[-1]
    found = []
    for offset, turn in ((np.array([0, 0, height]), 0), (np.array([width, 0, 0]), 180)):
        flip = np.array([-1, 1, -1]) if turn else np.ones(3)
        force, _ = dipoles.wrench(points * flip + offset, moments * flip, points, moments)
        along = force.sum(axis=0) @ offset / np.linalg.norm(offset)
        found.append(float(along / true_force(magnet, offset, turn)))
    return found


TOUCHING = [
    ("cuboid", (10, 10, 10), 0.5, 0.3, 1.18, 1.18),
    ("cuboid", (10, 10, 2), 0.5, 0.3, 1.60, 1.12),
    ("cuboid", (20, 10, 5), 0.5, 0.3, 1.53, 1.17),
    ("cylinder", (10, 5), 0.5, 0.3, 1.02, 1.34),
    ("cylinder", (10, 2), 0.5, 0.3, 1.78, 1.16),
    ("cylinder", (5, 20), 0.5, 0.5, 1.42, 1.39),
    ("cuboid", (10, 10, 10), 0.1, 0.5, 6.4, 1.12),
    ("cuboid", (10, 10, 10), 0.01, 1.0, 4.4, 4.4),
    ("cuboid", (10, 10, 2), 0.01, 5.0, 9.0, 1.27),
    ("cuboid", (20, 10, 5), 0.01, 1.0, 21, 6.1),
    ("cylinder", (10, 5), 0.01, 1.0, 9.0, 4.8),
    ("cylinder", (5, 20), 0.5, 0.3, 2.4, 18),
]
"""Shapes in mm, errors, gaps over the smallest length, and forces over the true ones at touch."""


@pytest.mark.parametrize(("shape", "size", "error", "gap", "stacked", "beside"), TOUCHING)
def test_layouts_that_are_too_strong_at_touch_are_found(shape, size, error, gap, stacked, beside):
    """The table of docs/contact.md."""
    magnet = mm.magnet(shape, 1e-3 * np.array(size), grade="N42")
    gap *= 1e-3 * min(size)
    assert ratios(magnet, magnet.dipoles(error, gap)) == pytest.approx([stacked, beside], rel=0.05)
    found = mm.check(load(magnet.mjcf(error, gap)))
    assert ("attract each other too strongly" in str(found)) == (max(stacked, beside) > 2)


def test_layouts_above_a_plane_of_iron():
    custom = """<numeric name="steel" data="1000"/><tuple name="iron">
    <element objtype="numeric" objname="steel"/><element objtype="geom" objname="table"/></tuple>"""
    table = '<geom name="table" type="plane" size="1 1 1"/>'
    magnet = mm.magnet("cuboid", (0.01, 0.01, 0.002), grade="N42")
    outcomes = []
    for error, gap in ((0.5, 0.6e-3), (0.01, 0.01)):
        model = load(magnet.mjcf(error, gap), '<geom size="0.01"/>', custom=custom, world=table)
        outcomes.append("from their images, and 0.0038 m from others" in str(mm.check(model)))
    assert outcomes == [False, True]


DUMBBELL = """<geom size="0.005" pos="-0.02 0 0"/><site pos="-0.02 0 0" user="0.01"/>
<geom size="0.005" pos="0.02 0 0"/><site pos="0.02 0 0" user="0.01"/>{}"""
SHAFT = '<geom type="capsule" fromto="-0.02 0 0 0.02 0 0" size="0.001"/>'


@pytest.mark.parametrize("shaft", ["", SHAFT])
def test_balls_of_one_dipole_each_have_no_spacing(shaft):
    found = approach_of(load(DUMBBELL.format(shaft)))
    assert found.spacing.within == 0
    assert "too strongly" not in str(mm.check(load(DUMBBELL.format(shaft))))


def test_two_magnets_in_one_geom_that_point_in_different_directions_are_no_layout():
    sites = '<site pos="0 0.007 0" user="0.1"/><site pos="0 -0.007 0" zaxis="0 0 -1" user="0.1"/>'
    found = approach_of(load(f'<geom type="box" size="0.004 0.012 0.004"/>{sites}'))
    assert found.spacing.within == 0


def test_the_spacing_of_a_layout_is_that_of_its_rows():
    """Rows 3 mm apart, of dipoles that are 1 mm apart."""
    sites = "".join(
        f'<site pos="{x / 1e3} {y / 1e3} 0" user="1e-3"/>' for x in (-3, 0, 3) for y in range(-4, 5)
    )
    found = approach_of(load(f'<geom type="box" size="0.0045 0.0045 0.001"/>{sites}'))
    assert found.spacing.within == pytest.approx(3e-3, rel=1e-14)
    assert found.spacing.apart == pytest.approx(1e-3, rel=1e-14)  # at the edges


# Contact at a distance ---------------------------------------------------------------------------

BALL = '<geom name="{0}" size="0.005" density="7500" margin="{1}" gap="{2}"/><site user="{3}"/>'


def balls(remanence, margins, height=0.03, gap=0.0):
    moment = remanence * 4 / 3 * np.pi * 5e-3**3 / (4e-7 * np.pi)
    left, right = (BALL.format(name, margin, gap, moment)
                   for name, margin in zip(("left", "right"), margins, strict=True))  # fmt: skip
    return load(left, right, height)


@pytest.mark.parametrize("margins", [(0, 0), (1e-3, 0), (1e-3, 2e-3)])
def test_the_margins_of_geoms_keep_magnets_apart(margins):
    """MuJoCo adds the margins of both geoms, and their gaps change nothing."""
    model = balls(1.0, margins, gap=5e-3)
    assert approach_of(model).approach.distance == pytest.approx(0.01 + sum(margins), rel=1e-14)
    data = mujoco.MjData(model)
    data.qpos[9] = 0.0101
    mujoco.mj_forward(model, data)
    assert data.contact[0].includemargin == pytest.approx(sum(margins), rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(("margin", "sticks"), [(0.0, False), (2.5e-3, True)])
def test_at_the_defaults_a_margin_changes_what_happens(margin, sticks):
    model = balls(0.1, (margin, margin), height=0.01 + 2 * margin)
    finding = mm.check(model).findings[0]
    data, distances = mujoco.MjData(model), []
    with mm.magnetism():
        while data.time < 1:
            mujoco.mj_step(model, data)
            distances.append(np.linalg.norm(data.xpos[2] - data.xpos[1]))
    assert ("will fly apart once they touch" in finding) == (not sticks)
    assert (max(distances) < 0.02) == sticks
    if sticks:
        says = float(finding.split("penetrate each other by ")[1].split(" %")[0]) / 100
        assert (0.01 + 2 * margin - distances[-1]) / 5e-3 == pytest.approx(says, abs=0.01)
