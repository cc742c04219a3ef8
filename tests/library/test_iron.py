"""Iron: magnetized pieces and a mirror plane, against closed forms and a series of multipoles."""

import math
from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest
from iron_models import free, iron
from scipy.optimize import brentq
from scipy.special import comb

import magmotor as mm
from magmotor.mjcf.field_and_energy import dipole_sites
from magmotor.numerics.demagnetization import demagnetizing_factors
from magmotor.numerics.iron import response

MU0 = 4e-7 * math.pi


@pytest.mark.parametrize("chi", [-1, -0.5, 1e-6, 1, 3000, 1e12])
def test_a_sphere_in_a_uniform_field(chi):
    """m = 4 pi a^3/mu0 chi/(chi + 3) B."""
    model, data = iron(free('size="0.02"'), "0.01 -0.02 0.03", str(chi))
    _, moments, _ = dipole_sites(model, data)
    expected = 4 * math.pi * 0.02**3 / MU0 * chi / (chi + 3) * np.array([0.01, -0.02, 0.03])
    np.testing.assert_allclose(moments, [expected], rtol=5e-14)  # 3e-15


@pytest.mark.parametrize("ratio", [1.001, 1.5, 4, 30, 1000])
def test_demagnetizing_factors_of_spheroids(ratio):
    """Osborn's closed forms, which cancel near a sphere."""
    e = math.sqrt(1 - ratio**-2)
    prolate = (1 - e**2) / e**3 * (math.atanh(e) - e)
    oblate = 1 / e**2 * (1 - math.sqrt(1 - e**2) / e * math.asin(e))
    lost = 1e-15 / e**2
    assert demagnetizing_factors(1.0, 1.0, ratio)[2] == pytest.approx(prolate, rel=30 * lost)
    assert demagnetizing_factors(ratio, 1.0, ratio)[1] == pytest.approx(oblate, rel=30 * lost)
    for axes in ((1.0, 1.0, ratio), (ratio, 1.0, ratio), (1.0, 2.0, ratio)):
        assert sum(demagnetizing_factors(*axes)) == pytest.approx(1, abs=4e-16)


@pytest.mark.parametrize(
    "shape",
    ['type="ellipsoid" size="0.01 0.02 0.03"', 'type="capsule" size="0.01 0.03"',
     'type="cylinder" size="0.01 0.03"', 'type="box" size="0.01 0.02 0.03"'],
)  # fmt: skip
def test_other_shapes_have_the_moments_of_their_responses(shape):
    """`test_iron_shapes.py` says that these are right."""
    model, data = iron(free(f'{shape} quat="1 2 3 4"'), "0.01 0.02 0.03", "50")
    axis, geom = data.geom("piece").xmat.reshape(3, 3), model.geom("piece")
    found = response.of_geom(int(geom.type[0]), geom.size, 50.0)
    chi = 50 / (1 + 50 * found.factors)
    expected = found.volume / MU0 * axis @ (chi * (axis.T @ [0.01, 0.02, 0.03]))
    np.testing.assert_allclose(dipole_sites(model, data)[1], [expected], rtol=3e-13)  # 2e-14


@pytest.mark.parametrize("flux", [1e-4, 0.3, 0.7, 3, 100])
def test_a_sphere_that_saturates(flux):
    """M = chi H/sqrt(1 + (chi H/M_s)^2) with H = B/mu0 - M/3, solved by bisection."""
    model, data = iron(free('size="0.02"'), f"0 {flux} 0", "800 1.6e6")
    moment = dipole_sites(model, data)[1][0, 1]

    def excess(magnetization):
        h = 800 * (flux / MU0 - magnetization / 3)
        return h / math.sqrt(1 + (h / 1.6e6) ** 2) - magnetization

    root: Any = brentq(excess, 0, 1.6e6, xtol=1e-9)
    expected = root * 4 / 3 * math.pi * 0.02**3
    assert moment == pytest.approx(expected, rel=3e-5)  # 4e-6


def two_spheres(distance, orders=60):
    """The moment of each of two spheres of infinite permeability on the axis of a field.

    In units of 4 pi a^3 B/mu0. The potential of each sphere is a series c_n P_n/r^(n+1), n > 0,
    where those of the other sphere are its mirror image. On a sphere, the potential is constant.
    """
    n = np.arange(1, orders + 1)
    matrix = np.eye(orders)
    for i in n:
        for j in n:
            matrix[i - 1, j - 1] -= comb(i + j, i) / distance ** (i + j + 1)
    return np.linalg.solve(matrix, np.eye(orders)[0])[0]


@pytest.mark.parametrize(
    ("distance", "bound"), [(2.02, 0.05), (2.1, 0.03), (2.25, 0.05), (3.0, 3e-3), (6.0, 5e-3)]
)
def test_two_spheres_in_a_field(distance, bound):
    """The moments and the force against a series of multipoles; at 6 radii, they are dipoles.

    The errors of the force are 0.001, 0.009, 0.027, 8e-4 and 2e-3, and 0.011 of the first moment.
    """
    bodies = free('size="0.01"') + free('size="0.01"', f"0 0 {0.01 * distance}", "other")
    model, data = iron(bodies, "0 0 0.02", "1e14", "piece other")
    unit = 4 * math.pi * 0.01**3 / MU0 * 0.02
    found = dipole_sites(model, data)[1][:, 2] / unit
    np.testing.assert_allclose(found, two_spheres(distance), rtol=bound / 3)
    slope = (two_spheres(distance + 1e-6) - two_spheres(distance - 1e-6)) / 2e-6
    force = -unit * 0.02 / 0.01 * slope
    np.testing.assert_allclose(data.xfrc_applied[1:, 2], [force, -force], rtol=bound)


@pytest.mark.parametrize("tilt", [0, 30, 90])
def test_a_dipole_above_a_plane_of_iron(tilt):
    """F = 3 mu0 m^2 (1 + cos^2)/(64 pi h^4), torque mu0 m^2 sin 2 theta/(64 pi h^3)."""
    site = f'<site user="0.8" euler="{tilt} 0 0"/>'
    magnet = f'<body pos="0 0 0.03"><freejoint/><geom size="0.01"/>{site}</body>'
    plane = '<geom name="piece" type="plane" size="1 1 1"/>'
    model, data = iron(plane + magnet, "0 0 0", "1e14")
    angle = math.radians(tilt)
    force = 3 * MU0 * 0.8**2 * (1 + math.cos(angle) ** 2) / (64 * math.pi * 0.03**4)
    torque = MU0 * 0.8**2 * math.sin(2 * angle) / (64 * math.pi * 0.03**3)
    assert data.xfrc_applied[1, 2] == pytest.approx(-force, rel=1e-13)  # 2e-14
    assert data.xfrc_applied[1, 3] == pytest.approx(-torque, rel=1e-13, abs=1e-18)  # 2e-14
    assert mm.magnetic_energy(model, data) == pytest.approx(-force * 0.03 / 3, rel=1e-13)  # 2e-14


def test_the_images_of_a_magnet_are_those_of_magpylib():
    """The field of a dipole and its image, above a tilted plane."""
    magnet = '<body pos="0.02 0.01 0.05"><freejoint/><geom size="0.01"/><site user="0.8"/></body>'
    plane = '<geom name="piece" type="plane" size="1 1 1" euler="10 20 0"/>'
    model, data = iron(plane + magnet, "0 0 0", "3")
    normal = data.geom("piece").xmat.reshape(3, 3)[:, 2]
    position, moment = data.site_xpos[0], np.array([0, 0, 0.8])
    image = position - 2 * (normal @ position) * normal
    source = magpylib.misc.Dipole(position=position, moment=moment)
    mirrored = 0.6 * (2 * (moment @ normal) * normal - moment)
    source = magpylib.Collection(source, magpylib.misc.Dipole(position=image, moment=mirrored))
    points = normal * 0.1 + np.random.default_rng(3).normal(size=(5, 3)) * 0.02
    found = mm.field(model, data, points)
    np.testing.assert_allclose(found, source.getB(points), rtol=3e-9)  # 1e-10


def test_a_closed_loop_around_iron_yields_no_work():
    """A magnet is led around a ball that saturates; a trapezoidal sum converges exponentially."""
    bodies = free('size="0.01"') + '<body mocap="true" pos="1 0 0"><site user="2"/></body>'
    model, data = iron(bodies, "0.01 0 0.02", "1000 1e5")
    angles = np.linspace(0, 2 * math.pi, 240, endpoint=False)
    work = path = 0.0
    for angle in angles:
        sine, cosine = math.sin(angle), math.cos(angle)
        data.mocap_pos[:] = 0.05 * cosine, 0.03 * sine, 0.04 * sine * cosine
        step = np.array([-0.05 * sine, 0.03 * cosine, 0.04 * math.cos(2 * angle)])
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        # The reaction on the magnet, without the uniform field, which does not push it.
        force = -data.xfrc_applied[1, :3]
        work += force @ step * 2 * math.pi / len(angles)
        path += abs(force @ step) * 2 * math.pi / len(angles)
    assert abs(work) < 2e-14 * path  # 6e-16


def test_a_model_with_iron_keeps_its_energy():
    """RK4, two free magnets and a free ball of iron that saturates; a halved step gives 1/16."""
    bodies = (
        free('size="0.01" density="2000"')
        + '<body pos="0.05 0 0"><freejoint/><geom size="0.008"/><site user="0.3"/></body>'
        '<body pos="0 0.05 0.03"><freejoint/><geom size="0.008"/>'
        '<site user="0.4" euler="50 0 0"/></body>'
    )
    model, _ = iron(bodies, "0.01 0 0.02", "1000 3e4")
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    drifts = []
    for steps in (100, 200):
        data = mujoco.MjData(model)
        model.opt.timestep = 0.02 / steps
        energies = []
        with mm.magnetism():
            for _ in range(steps):
                mujoco.mj_forward(model, data)
                energies.append(data.energy[1] + mm.magnetic_energy(model, data))
                mujoco.mj_step(model, data)
        drifts.append(np.ptp(energies))
    assert math.log2(drifts[0] / drifts[1]) == pytest.approx(4, abs=1)  # 0.55
