"""Magnets near pieces of iron on which others act: other pieces, fluxes through gaps, fields."""

import mujoco
import numpy as np
import pytest
from energy_slopes import wrenches_by_energy

import magmotor as mm
from tests.library.test_coil_geoms import box
from tests.library.test_magnets_on_faces import POINT, body, disk

MODEL = """
<mujoco>
  <size nuser_geom="3" memory="50M"/>
  <option gravity="0 0 0"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <custom>
    <text name="magmotor" data="{mark}"/>
    <numeric name="field" data="{field}"/>
    <numeric name="steel" data="1000 {saturation} {apart}"/>
    {iron}
  </custom>
  <worldbody>{bodies}</worldbody>
</mujoco>"""


def loaded(bodies, *iron, field="0 0 0", saturation=0.0, apart=0.0):
    """A model with pieces of iron, and its data with the magnetic forces."""
    pieces = "".join(
        f'<tuple name="iron{k}"><element objtype="numeric" objname="steel"/>'
        + "".join(f'<element objtype="geom" objname="{name}"/>' for name in names.split())
        + "</tuple>"
        for k, names in enumerate(iron)
    )
    mark = "magnets dipoles iron" + (" fields" if field != "0 0 0" else "")
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(
            mark=mark, field=field, saturation=saturation, apart=apart, iron=pieces, bodies=bodies
        )
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize(
    ("gap", "expected", "automatic", "finer"),
    [
        (0.1, 74.16, 0.3, 0.2),  # 0.756, 0.844
        (0.5, 24.78, 0.1, 0.03),  # 0.930, 0.991
        (2.0, 4.444, 0.2, 0.03),  # 0.855, 1.009
    ],
)
def test_a_magnet_between_two_legs_holds_a_keeper(gap, expected, automatic, finer):
    """Over finite elements, for automatic nodes and for those 2.5 mm apart.

    A magnet that is only lifted gives 0.51, 0.62 and 0.56 of the force, with the automatic nodes.
    The elements are those of `test_circuits.py`; two meshes agree to 1.5 %.
    """
    legs = box("left", (-15, -5), (-5, 5), (-30, 0)) + box("right", (5, 15), (-5, 5), (-30, 0))
    magnet = box("magnet", (-5, 5), (-5, 5), (-10, 0)).replace("/>", ' user="1.3 0 0"/>')
    keeper = body(box("keeper", (-15, 15), (-5, 5), (-38, -30)), place=f"0 0 {-1e-3 * gap}")
    iron = "left", "right", "keeper"
    for apart, bound in ((0.0, automatic), (0.0025, finer)):
        data = loaded(legs + magnet + keeper, *iron, apart=apart)[1]
        pull = data.xfrc_applied[1, 2]
        assert pull == pytest.approx(expected, rel=bound)


BLOCK = body(box("block", (-20, 20), (-15, 15), (-6, 6)), turn="1 2 3")
SHEET = body(box("block", (-20, 20), (-15, 15), (-0.6, 0.6)), place="0 0 .0054", turn="1 2 3")
PELLET = body(box("pellet", (-4, 4), (-5, 5), (-3, 3)), place=".0254 .002 .001", turn="5 0 20")
DISK = body(disk(0.005, 0.002, (0, 0, 0), ".3 0 1.32"), place=".012 .003 .0086", turn="3 6 0")
FAR = body(disk(0.004, 0.003, (0, 0, 0), "0 1.1 0"), place="-.03 .01 .012", turn="3 50 0")
DIPOLE = body(POINT, place="-.007 .002 .009", turn="3 -5 0")
PLANE = '<geom name="plane" type="plane" size="1 1 1" pos="0 0 -.012"/>'
FIELD = "0.03 0.01 0.05 0.4 0 0.1 0.3 -0.2"


@pytest.mark.parametrize("saturation", [0, 1.2e6])
@pytest.mark.parametrize(
    ("bodies", "iron", "field"),
    [
        (BLOCK, ["block"], FIELD),
        (BLOCK + PELLET, ["block", "pellet"], "0 0 0"),
        (PLANE + BLOCK, ["block", "plane"], "0 0 0"),
        (PLANE + BLOCK + PELLET, ["block", "pellet", "plane"], FIELD),
        (SHEET, ["block"], FIELD),
    ],
    ids=["field", "pellet", "plane", "all", "sheet"],
)
def test_wrenches_are_derivatives_of_the_energy(bodies, iron, field, saturation):
    """Of two magnets by their geom and a dipole near a block.

    The errors are at most 7e-8 of the largest force and 1.1e-7 of the largest torque. With the
    pellet at 25 mm, the small jump of a charge near an edge is within the steps.
    """
    model, data = loaded(bodies + DISK + DIPOLE + FAR, *iron, field=field, saturation=saturation)
    count = model.nbody - 1
    found = data.xfrc_applied[1:].reshape(-1, 2, 3)
    error = np.abs(found - wrenches_by_energy(model, data, count, (2e-7,) * 3 + (2e-5,) * 3))
    sizes = np.abs(found).max(axis=(0, 2))
    assert (error.max(axis=(0, 2)) < 1e-6 * sizes).all()


@pytest.mark.parametrize(("others", "field"), [(PELLET, "0 0 0"), ("", FIELD), (PELLET, FIELD)])
def test_the_field_is_that_of_the_energy(others, field):
    """Of a small dipole near a magnet and a block on which others act: B = -dE/dm, up to 0.14 T."""
    iron = ["block", "pellet"] if others else ["block"]
    for place in (".004 .002 .0075", ".0195 .004 .0068", "-.004 -.006 .0064"):
        for turn in ("0 0 0", "90 0 0", "0 90 0"):
            probe = (
                f'<body name="probe" pos="{place}" euler="{turn}"><freejoint/><geom size=".001"/>'
            )
            energies = []
            for moment in (1e-4, -1e-4):
                site = f'<site name="probe" user="{moment}"/></body>'
                model, data = loaded(BLOCK + DISK + others + probe + site, *iron, field=field)
                energies.append(mm.magnetic_energy(model, data))
            model.site_user[:] = 0
            flux = mm.field(model, data, data.site("probe").xpos[None])[0]
            along = flux @ data.site("probe").xmat.reshape(3, 3)[:, 2]
            slope = (energies[0] - energies[1]) / 2e-4
            assert -slope == pytest.approx(along, abs=2e-4)  # 5.8e-5
