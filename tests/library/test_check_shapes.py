"""`check` of magnets and iron by their geom: pull at touch, overlaps, and how they are described.

The judge of the pull is a sum of magpylib's field over the magnetic charges on the faces of the
other magnet. Measured deviations stand beside the bounds.
"""

import re

import magpylib
import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

DISK = '<geom name="{}" type="cylinder" size=".00635 .0015875" density="7500" user="0 0 1.32"/>'
BLOCK = '<geom name="block" type="box" size=".02 .02 .01"/>'
SIDES = np.array([[x, y, z] for x in (0, 8) for y in (0, 6) for z in (0, 5)])


def load(bodies, custom="", assets="", steel=1000):
    """A model in which a geom named `block`, if there is one, is iron."""
    if 'name="block"' in bodies:
        custom += f"""
          <numeric name="steel" data="{steel}"/>
          <tuple name="iron"><element objtype="numeric" objname="steel"/>
          <element objtype="geom" objname="block"/></tuple>"""
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0" timestep="1e-5"/>
      <custom><text name="magmotor" data="dipoles magnets iron"/>{custom}</custom>
      <asset>{assets}</asset>
      <worldbody>{bodies}</worldbody>
    </mujoco>""")


def free(geom, place="0 0 0", more=""):
    return f'<body pos="{place}" {more}><freejoint/>{geom}</body>'


def pull_of(model):
    """The pull that a finding quotes, in N."""
    (found,) = [each for each in mm.check(model).findings if "attract" in each]
    return float(re.search(r"with (?:at most|up to about) ([\d.]+) N", found)[1])


def true_pull(shape, sizes, polarization):
    """The force between two equal magnets, one on the other, polarized along z, in N."""
    gauss, weights = np.polynomial.legendre.leggauss(60)
    if shape == "box":
        source = magpylib.magnet.Cuboid(polarization=(0, 0, polarization), dimension=sizes)
        x, y = (half.ravel() for half in np.meshgrid(gauss * sizes[0] / 2, gauss * sizes[1] / 2))
        parts = np.outer(weights, weights).ravel() / 4
    else:
        source = magpylib.magnet.Cylinder(polarization=(0, 0, polarization), dimension=sizes)
        x, y = sizes[0] / 2 * np.sqrt((1 + gauss) / 2), 0 * gauss
        parts = weights / 2
    charge = polarization / VACUUM_PERMEABILITY * np.pi / 4 * sizes[0] ** 2
    if shape == "box":
        charge = polarization / VACUUM_PERMEABILITY * sizes[0] * sizes[1]
    height, force = sizes[-1], 0.0
    for z, sign in ((height / 2 + 1e-9, -1), (1.5 * height, 1)):
        field = source.getB(np.column_stack([x, y, np.full(len(x), z)]))[:, 2]
        force += sign * charge * parts @ field
    return -force


def _mesh(turn=""):
    vertices = " ".join(map(str, (1e-3 * SIDES).ravel().tolist()))
    return f'<mesh name="hull" vertex="{vertices}"/>'


@pytest.mark.parametrize(
    ("geom", "shape", "sizes", "polarization", "deviation"),
    [
        (DISK.format(""), "cylinder", (0.0127, 0.003175), 1.32, 7.5e-3),  # 6e-4
        ('<geom type="cylinder" size=".003 .015" user="0 0 1.2"/>', "cylinder", (0.006, 0.03), 1.2, 7.5e-3),
        ('<geom type="box" size=".004 .003 .0025" user="0 0 1.3"/>', "box", (0.008, 0.006, 0.005), 1.3, 7.5e-3),
        ('<geom type="mesh" mesh="hull" user="0 0 1.3"/>', "box", (0.008, 0.006, 0.005), 1.3, 7.5e-3),
    ],
)  # fmt: skip
def test_the_pull_at_touch_is_that_of_the_shapes(geom, shape, sizes, polarization, deviation):
    geom = geom.replace('name="" ', "")
    model = load(free(geom) + free(geom, "0 .1 0", 'euler="20 30 40"'), assets=_mesh())
    expected = true_pull(shape, sizes, polarization)
    assert pull_of(model) == pytest.approx(expected, rel=deviation)
