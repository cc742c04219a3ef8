"""Pull across narrow gaps between pieces of iron, against finite elements.

The finite elements are axisymmetric, by NGSolve 6.2.2608: the scalar potential, of third order, in
a sphere of air of 1 m. Elements are as large as the gap is wide in the gap, at most 0.5 mm on the
surfaces, and 0.04 mm at edges. The force is that of Maxwell's stress in the air around what is
pulled. With elements half as large, forces change by at most 4e-4; with fourth order or twice the
radius of the air, by at most 2e-4. The winding is a sheet of current of J/mu0. All iron has a
susceptibility of 1000, and none saturates.
"""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.numerics.iron import response
from tests.library.test_coil_geoms import ROUND, body, rod

MODEL = """
<mujoco>
  <size nuser_geom="3" memory="30M"/>
  <option gravity="0 0 0"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <custom>
    <text name="magmotor" data="magnets fields coils iron"/>
    <numeric name="field" data="0 0 {field}"/>
    {custom}
  </custom>
  <worldbody><site name="fixed"/>{bodies}</worldbody>
  <actuator><general name="current" site="fixed" gainprm="0"/></actuator>
</mujoco>"""
COIL = """
<tuple name="coil"><element objtype="actuator" objname="current"/>
  <element objtype="geom" objname="coil"/></tuple>"""
MATERIAL = """
<numeric name="material_{name}" data="1000 0 {apart}"/>
<tuple name="iron_{name}"><element objtype="numeric" objname="material_{name}"/>{geoms}</tuple>"""
MAGNET = '<geom type="cylinder" size=".005 .005" pos="0 0 .045" user="0 0 1.3"/>'

BOBBIN = [(8, -21, 21), (14, -26, -21), (14, 21, 24)]
PAIRS = {
    "rods": ((5, 0, 60), [(5, -60, 0)]),
    "short rods": ((5, 0, 20), [(5, -20, 0)]),
    "thin rods": ((2, 0, 40), [(2, -40, 0)]),
    "plate": ((5, 0, 30), [(30, -5, 0)]),
    "core": ((6, 20, 26), [(8, -20, 20)]),
    "bobbin": ((6, 24, 30), BOBBIN),
    "wide disk": ((14, 24, 30), BOBBIN),
    "magnet": ((5, 0, 40), [(20, -20, 0)]),
}
"""The cylinder that is pulled, and what it faces: radius, bottom and top in mm, without the gap.

Rods are in a field of 0.02 T, also the one on a plate. The three disks are pulled by cores in a
coil. A magnet of 1.3 T is on the upper end of the last rod.
"""

CASES = [
    ("rods", 0.1, 54.596, 0.15, 0.12),  # 0.880, 0.902
    ("rods", 0.3, 33.245, 0.05, 0.12),  # 0.968, 1.095
    ("rods", 1, 11.786, 0.02, 0.1),  # 1.016, 0.928
    ("rods", 3, 2.9922, 0.02, 0.01),  # 0.991, 0.997
    ("short rods", 0.1, 3.0222, 0.15, 0.08),  # 0.883, 0.958
    ("short rods", 0.3, 2.0990, 0.1, 0.08),  # 1.070, 1.061
    ("thin rods", 0.1, 21.495, 0.12),  # 0.909
    ("thin rods", 0.3, 8.2556, 0.1),  # 1.083
    ("plate", 0.1, 6.71, 0.1),  # 0.918
    ("plate", 0.5, 2.3776, 0.12, 0.08),  # 1.088, 1.065
    ("plate", 2, 0.47289, 0.4, 0.05),  # 0.748, 1.026
    ("core", 0.3, 339.64, 0.05, 0.2),  # 1.036, 1.142
    ("core", 1, 192.16, 0.05, 0.08),  # 0.973, 0.941
    ("core", 3, 81.620, 0.03, 0.01),  # 1.022, 0.999
    ("bobbin", 1, 54.841, 0.15),  # 0.890
    ("bobbin", 10, 10.028, 0.01),  # 1.002
    ("wide disk", 0.3, 506.04, 0.02),  # 0.987
    ("wide disk", 3, 176.57, 0.02),  # 1.009
    ("magnet", 0.3, 3.5904, 0.25),  # 0.796
    ("magnet", 1, 1.1573, 0.25, 0.4),  # 0.813, 0.710
]
"""Pair, gap in mm, force in N, and bounds of the error with automatic nodes and, for some, with
half of their distance. Ratios of forces are beside them."""


def piece(name, parts, finer):
    """The material and geoms of a piece of iron."""
    radii, bottoms, tops = np.array(parts).T * 1e-3
    apart = 0.0
    if finer:
        found = response.cylinders(radii, (tops - bottoms) / 2, (tops + bottoms) / 2, 1000.0)
        apart = found.radius / response.RADIUS / 2
    names = [f"{name}_{k}" for k in range(len(parts))]
    geoms = "".join(f'<element objtype="geom" objname="{each}"/>' for each in names)
    bodies = "".join(rod(each, *part) for each, part in zip(names, parts, strict=True))
    return MATERIAL.format(name=name, apart=apart, geoms=geoms), bodies


def pull(pair, gap, finer):
    """The pull in N across a gap in mm."""
    upper, lower = PAIRS[pair]
    (custom, moves), (more, bodies) = piece("upper", [upper], finer), piece("lower", lower, finer)
    custom, wound = custom + more, pair in ("core", "bobbin", "wide disk")
    if wound:
        custom, bodies = custom + COIL, bodies + ROUND
    if pair == "magnet":
        moves += MAGNET
    bodies += body("pulled", moves, f'pos="0 0 {gap}e-3"')
    field = 0.0 if wound or pair == "magnet" else 0.02
    model = mujoco.MjModel.from_xml_string(MODEL.format(field=field, custom=custom, bodies=bodies))
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.0
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return -data.body("pulled").xfrc_applied[2]


@pytest.mark.parametrize(
    ("pair", "gap", "force", "bound", "finer"),
    [(*case[:3], bound, k == 1) for case in CASES for k, bound in enumerate(case[3:])],
)
def test_pull_across_a_gap(pair, gap, force, bound, finer):
    assert pull(pair, gap, finer) == pytest.approx(force, rel=bound)
