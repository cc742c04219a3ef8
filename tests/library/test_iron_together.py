"""Iron that saturates: several pieces, the field around them, and a piece at a temperature."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from energy_slopes import wrenches_by_energy
from iron_models import factors, free, iron, load
from scipy.integrate import quad
from scipy.optimize import brentq

import magmotor as mm
from magmotor.mjcf.field_and_energy import dipole_sites

MU0 = 4e-7 * math.pi
CHI, SATURATION = 300.0, 1e5
SIZES = (0.01, 0.01, 0.01), (0.008, 0.012, 0.02), (0.015, 0.015, 0.01), (0.01, 0.02, 0.012)
PLACES = np.array([[0, 0, 0], [0.03, 0, 0.005], [0.005, 0.035, 0], [0.025, 0.03, 0.03]])
TURNS = "10 20 30", "40 -50 60", "-70 80 5", "15 0 35"


def test_several_pieces_that_saturate():
    """The wrenches on four ellipsoids, a magnet and a plane of iron are derivatives of the energy.

    All pieces are half saturated and magnetize each other; finite differences of 1 um.
    """
    bodies = "".join(
        f'<body pos="{x} {y} {z}" euler="{turn}"><freejoint/>'
        f'<geom name="p{k}" type="ellipsoid" size="{a} {b} {c}"/></body>'
        for k, ((a, b, c), (x, y, z), turn) in enumerate(
            zip(SIZES, PLACES.tolist(), TURNS, strict=True)
        )
    )
    magnet = '<body pos="0.015 0.015 0.06"><freejoint/><geom size="0.001"/><site user="5"/></body>'
    plane = '<geom name="plane" type="plane" size="1 1 1" pos="0 0 -0.03"/>'
    names = " ".join(f"p{k}" for k in range(4))
    model = load(
        plane + bodies + magnet, "0.02 -0.03 0.05", f"{CHI} {SATURATION}", names + " plane"
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    moments = np.linalg.norm(dipole_sites(model, data)[1][1:], axis=1)
    saturated = SATURATION * 4 / 3 * math.pi * np.prod(SIZES, axis=1)
    assert (moments > 0.3 * saturated).all()
    assert (moments < saturated).all()
    found = data.xfrc_applied[1:].reshape(-1, 2, 3)
    error = np.abs(found - wrenches_by_energy(model, data, len(found))).max(axis=(0, 2))
    assert error[0] < 1e-6 * np.abs(found).max()  # 1e-7
    assert error[1] < 1e-8 * np.abs(found).max()  # 1e-9, in m


@pytest.mark.parametrize("saturation", [0, 1e5])
@pytest.mark.parametrize(("distance", "bound"), [(1.5, 0.2), (2.5, 4e-3), (4.0, 1e-3)])
def test_the_field_around_a_sphere(saturation, distance, bound):
    """B_0 and a dipole's field; within a node's distance from the surface, nodes are seen.

    The sphere has M = chi H/sqrt(1 + (chi H/M_s)^2), H = B_0/mu0 - M/3, found by bisection.
    """
    strength, axis = 0.08, np.array([2.0, -1.0, 2.0]) / 3
    text = " ".join(map(str, strength * axis))
    model, data = iron(free('size="0.02"'), text, f"50 {saturation}")

    def excess(inside):
        size = 50 * inside / saturation if saturation else 0
        return strength / MU0 - inside - 50 * inside / math.hypot(1, size) / 3

    inside: Any = brentq(excess, 0, strength / MU0, xtol=1e-10)
    magnetization = 3 * (strength / MU0 - inside)
    assert magnetization == pytest.approx(0.98e5 if saturation else 1.8e5, rel=0.02)
    normals = np.random.default_rng(5).normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    moment = magnetization * axis * 4 / 3 * math.pi * 0.02**3
    far = 3 * (normals @ moment)[:, None] * normals - moment
    own = 1e-7 * far / (0.02 * distance) ** 3
    found = mm.field(model, data, 0.02 * distance * normals)
    np.testing.assert_allclose(
        found, strength * axis + own, rtol=0, atol=bound * np.linalg.norm(own, axis=1).max()
    )


def test_iron_at_a_temperature():
    """A grain of iron 1:1:2, chi = 10, turns freely in a field: <cos^2> of its axis.

    Its energy is -V B^2 cos^2 (x_3 - x_1)/(2 mu0), x = chi/(1 + chi N). The means of 64 replicas of
    6 000 steps, together about 13 000 independent samples, give the standard error; four of them
    raise a false alarm for one seed of 6000 (Student's t), and 4.5 % of the energy would be found.
    """
    size, flux_density, chi, kT = (1e-3, 1e-3, 2e-3), 0.01, 10.0, 2e-7
    short, _, long = (chi / (1 + chi * factor) for factor in factors(size))
    volume = 4 / 3 * math.pi * math.prod(size)
    depth = volume * flux_density**2 * (long - short) / (2 * MU0 * kT)
    weight = [quad(lambda c, p=p: c**p * math.exp(depth * c * c), 0, 1)[0] for p in (0, 2)]
    expected = weight[1] / weight[0]
    grain = '<geom name="piece" type="ellipsoid" size="1e-3 1e-3 2e-3" density="7800"/>'
    body = f'<body><joint type="ball" damping="6e-9"/>{grain}</body>'
    model = load(body, f"{flux_density} 0 0", f"{chi}")
    model.opt.timestep = 1e-3
    run = mm.Langevin(model, kT=kT, seed=11).sample(
        6_000 * model.opt.timestep,
        replicas=64,
        record_interval=20,
        burn_in=400 * model.opt.timestep,
    )
    w, x, y, z = np.moveaxis(run.qpos.transpose("replica", "time", ...).values, -1, 0)
    means = ((2 * (x * z + w * y)) ** 2).mean(axis=1)
    error = means.std(ddof=1) / 8
    assert error < 0.004  # 0.0027
    assert abs(means.mean() - expected) < 4 * error  # -0.1 errors; 0.6121, expected 0.6124
