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


def wrenches_by_energy(model, data, bodies):
    """Forces and torques (bodies, 2, 3) on the first bodies, all free, by differences of 1 um."""
    slopes = []
    for k in range(6 * bodies):
        energies = []
        for step in (1e-6, -1e-6):
            moved, velocity = mujoco.MjData(model), np.zeros(model.nv)
            velocity[k] = step
            mujoco.mj_integratePos(model, moved.qpos, velocity, 1.0)
            mujoco.mj_kinematics(model, moved)
            energies.append(mm.magnetic_energy(model, moved))
        slopes.append((energies[1] - energies[0]) / 2e-6)
    # MuJoCo's torques on free bodies are along their own axes.
    turns, found = data.xmat[1 : 1 + bodies].reshape(-1, 3, 3), np.reshape(slopes, (-1, 2, 3))
    found[:, 1] = np.einsum("bij,bj->bi", turns, found[:, 1])
    return found


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
