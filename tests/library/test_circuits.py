"""Closed magnetic circuits, in which iron and gaps are in series, against finite elements.

The scalar potential, with H = T - grad phi for coils, is of second order on hexahedra in a quarter
of the model, whose edges are graded from the gap to 0.4 m, or axisymmetric and of third order for
bars; iron saturates by M = chi H/sqrt(1 + (chi H/M_s)^2). Forces are those of Maxwell's stress.
With finer meshes, they change by at most 0.6 %, and at 200 A by 0.1 % where iron saturates; others
there and those of the pot have one mesh. Bars at 0.5 T are just below saturated ones by magpylib.
"""

import math

import mujoco
import pytest

import magmotor as mm
from tests.library.test_coil_geoms import body, box, rod

MU0 = 4e-7 * math.pi
MODEL = """
<mujoco>
  <size nuser_geom="3" memory="50M"/>
  <option gravity="0 0 0"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <custom>
    <text name="magmotor" data="magnets fields coils iron"/>
    <numeric name="field" data="0 0 {field}"/>
    <numeric name="steel" data="{chi} {saturation} {apart}"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>{iron}</tuple>
    {coil}
  </custom>
  <worldbody><site name="fixed"/>{bodies}</worldbody>
  <actuator><general name="current" site="fixed" gainprm="0"/></actuator>
</mujoco>"""
COIL = """
<tuple name="coil"><element objtype="actuator" objname="current"/>
  <element objtype="geom" objname="coil"/></tuple>"""

CORE = (
    box("back", (-20, 20), (-5, 5), (-5, 5)) + box("left", (-20, -10), (-5, 5), (-35, -5))
    + box("right", (10, 20), (-5, 5), (-35, -5))
)  # fmt: skip
KEEPER = box("keeper", (-20, 20), (-5, 5), (-43, -35))
MIRROR = (
    box("keeper", (-20, 20), (-5, 5), (-75, -65)) + box("one", (-20, -10), (-5, 5), (-65, -35))
    + box("two", (10, 20), (-5, 5), (-65, -35))
)  # fmt: skip
POT = (
    box("post", (-6, 6), (-6, 6), (-20, 0)) + box("flange", (-20, 20), (-20, 20), (-26, -20))
    + box("west", (-20, -16), (-20, 20), (-20, 0)) + box("east", (16, 20), (-20, 20), (-20, 0))
    + box("south", (-16, 16), (-20, -16), (-20, 0)) + box("north", (-16, 16), (16, 20), (-20, 0))
)  # fmt: skip
AROUND_BACK = (box("coil", (-10, 10), (-6, 6), (-6, 6)), 0.02, (1, 0, 0))
AROUND_POST = (box("coil", (-8, 8), (-8, 8), (-19, -1)), 0.018, (0, 0, 1))
"""Windings, their lengths in m, and their axes."""


def pull(core, keeper, gap, winding=None, current=0.0, *, field=0.0, chi=1000, flux=0.0, apart=0.0):
    """The force in N between a fixed piece and one that is a gap in mm away from it.

    `flux` is mu0 M_s in T, `field` is along z, in T, and `apart` is the distance of nodes in m.
    """
    names = [part.split('"')[0] for part in (core + keeper).split('name="')[1:]]
    iron = "".join(f'<element objtype="geom" objname="{name}"/>' for name in names)
    if winding:
        geom, length, axis = winding
        user = " ".join(str(MU0 / length * part) for part in axis)
        core += geom.replace("/>", f' user="{user}"/>')
    away = gap * (-1e-3 if winding is AROUND_BACK else 1e-3)
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(
            field=field,
            chi=chi,
            saturation=flux / MU0,
            apart=apart,
            iron=iron,
            coil=COIL if winding else "",
            bodies=core + body("pulled", keeper, f'pos="0 0 {away}"'),
        )
    )
    data = mujoco.MjData(model)
    data.ctrl[0] = current
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return abs(data.body("pulled").xfrc_applied[2])


LINEAR = {
    ("keeper", 1000): [
        (0.05, 86.06, 0.4),  # 0.734
        (0.1, 41.2, 0.25),  # 0.806
        (0.3, 8.537, 0.03),  # 0.983
        (0.5, 3.664, 0.08),  # 1.049
        (1, 1.103, 0.08),  # 0.950
        (3, 0.1552, 0.02),  # 1.005
    ],
    ("keeper", 200): [
        (0.05, 6.738, 0.2),  # 0.854
        (0.1, 4.893, 0.2),  # 0.877
        (0.3, 2.061, 0.02),  # 0.997
        (0.5, 1.163, 0.1),  # 1.070
        (1, 0.4628, 0.03),  # 0.976
        (3, 0.08457, 0.02),  # 1.008
    ],
    ("mirror", 1000): [
        (0.1, 30.59, 0.3),  # 0.796
        (0.5, 3.259, 0.08),  # 1.062
        (2, 0.2964, 0.1),  # 0.920
    ],
    ("pot", 1000): [
        (0.1, 163.6, 0.3),  # 0.783
        (0.3, 26.65, 0.03),  # 1.022
        (1, 3.053, 0.15),  # 1.114
    ],
}
"""Core and what is pulled, and the susceptibility; gaps in mm, forces in N at 200 A, and bounds of
their errors."""

PARTS = {
    "keeper": (CORE, KEEPER, AROUND_BACK, 0.0),
    "mirror": (CORE, MIRROR, AROUND_BACK, 0.0),
    "pot": (POT, box("plate", (-20, 20), (-20, 20), (0, 6)), AROUND_POST, 0.006),
}
"""Cores, what they pull, windings, and distances of nodes: that of the pot is nearly automatic."""


@pytest.mark.parametrize("case", LINEAR)
def test_iron_and_gaps_in_series(case):
    core, keeper, winding, apart = PARTS[case[0]]
    for gap, force, bound in LINEAR[case]:
        found = pull(core, keeper, gap, winding, 200.0, chi=case[1], apart=apart)
        assert found == pytest.approx(force, rel=bound)


SATURATED = [
    (200, 0.1, 34.45, 0.2),  # 0.854
    (1000, 0.1, 90.22, 0.08),  # 1.063
    (4000, 0.1, 102.5, 0.7),  # 0.463
    (200, 0.5, 3.618, 0.08),  # 1.052
    (1000, 0.5, 34.14, 0.7),  # 1.578
    (4000, 0.5, 44.32, 0.5),  # 0.674
    (200, 2, 0.3216, 0.08),  # 0.945
    (1000, 2, 6.216, 0.2),  # 1.139
    (4000, 2, 8.78, 0.15),  # 0.904
]
"""Current in A, gap in mm, force in N, and bound of the error. One reluctivity of a whole core
fails most at the onset, when its back alone saturates, and far above."""


def test_a_circuit_that_saturates():
    for current, gap, force, bound in SATURATED:
        found = pull(CORE, KEEPER, gap, AROUND_BACK, current, flux=1.5)
        assert found == pytest.approx(force, rel=bound)


BARS = [
    (0.02, 0.1, 48.66, 0.1),  # 0.929
    (0.04, 0.1, 62.37, 0.4),  # 1.242
    (0.06, 0.1, 63.1, 0.25),  # 1.173
    (0.1, 0.1, 63.51, 0.1),  # 1.069
    (0.5, 0.1, 64.41, 0.6),  # 0.571
    (0.02, 0.3, 31.29, 0.02),  # 0.988
    (0.04, 0.3, 51.47, 0.4),  # 1.260
    (0.06, 0.3, 53.58, 0.25),  # 1.184
    (0.1, 0.3, 55.11, 0.12),  # 1.095
    (0.5, 0.3, 57.31, 0.3),  # 0.774
    (0.02, 1, 11.51, 0.03),  # 1.023
    (0.04, 1, 29.03, 0.4),  # 1.266
    (0.06, 1, 32.79, 0.25),  # 1.193
    (0.1, 1, 36.29, 0.15),  # 1.113
    (0.5, 1, 41.96, 0.4),  # 1.300
]
"""Field in T, gap in mm, force in N, and bound of the error."""


def test_bars_that_saturate():
    """Of 10 x 60 mm, end to end: their pull never exceeds that of saturated ends by much."""
    lower, upper = rod("lower", 5, -60, 0), rod("upper", 5, 0, 60)
    for field, gap, force, bound in BARS:
        found = pull(lower, upper, gap, field=field, flux=1.5)
        assert found == pytest.approx(force, rel=bound)
