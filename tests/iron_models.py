"""Models with iron in a uniform field, and demagnetizing factors by quadrature."""

import math

import mujoco
import numpy as np
from scipy.integrate import quad

import magmotor as mm

MODEL = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles fields iron couplings"/>
    <numeric name="field" data="{field}"/>
    <numeric name="material" data="{material}"/>
    <tuple name="iron"><element objtype="numeric" objname="material"/>{pieces}</tuple>
  </custom>
  <worldbody>{bodies}</worldbody>
</mujoco>
"""


def load(bodies, field="0 0 0.01", material="1000", pieces="piece"):
    """A model whose named geoms are pieces of iron."""
    elements = (f'<element objtype="geom" objname="{name}"/>' for name in pieces.split())
    text = MODEL.format(bodies=bodies, field=field, material=material, pieces="".join(elements))
    return mujoco.MjModel.from_xml_string(text)


def iron(bodies, field="0 0 0.01", material="1000", pieces="piece"):
    """The same, and its data with the magnetic forces of the first configuration."""
    model = load(bodies, field, material, pieces)
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return model, data


def free(geom, pos="0 0 0", name="piece"):
    """A free body of one geom."""
    return f'<body pos="{pos}"><freejoint/><geom name="{name}" {geom}/></body>'


def factors(axes):
    """Demagnetizing factors of an ellipsoid: abc/2 int dt/((t + a^2) sqrt(...)), t = u^2."""
    return np.array([
        np.prod(axes)
        * quad(
            lambda u, a=a: u / ((u * u + a * a) * math.prod(math.hypot(u, b) for b in axes)),
            0, math.inf, epsabs=0, epsrel=1e-13,
        )[0]
        for a in axes
    ])  # fmt: skip
