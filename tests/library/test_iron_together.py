"""Iron that saturates: several pieces, the field around them, and a piece at a temperature."""

import math
from typing import Any

import numpy as np
import pytest
from iron_models import factors, free, iron, load
from magnetic_energy import flux
from scipy.integrate import quad
from scipy.optimize import brentq, root

import magmotor as mm
from magmotor.mjcf.field_and_energy import dipole_sites

MU0 = 4e-7 * math.pi
CHI, SATURATION = 300.0, 1e5
SIZES = (0.01, 0.01, 0.01), (0.008, 0.012, 0.02), (0.015, 0.015, 0.01), (0.01, 0.02, 0.012)
PLACES = np.array([[0, 0, 0], [0.03, 0, 0.005], [0.005, 0.035, 0], [0.025, 0.03, 0.03]])
TURNS = "10 20 30", "40 -50 60", "-70 80 5", "15 0 35"
MAGNET = np.array([0.015, 0.015, 0.06])


def test_several_pieces_that_saturate():
    """Moments, energy and forces against the equations of the material, solved by SciPy.

    Unknown are the fields H inside, of which M = chi H/sqrt(1 + (chi H/M_s)^2). The energy is
    sum V (w + mu0 M.N M/2 - M.B) - 1/2 sum m.B_ij with w = int mu0 H dM, and at the solution its
    derivatives are those at fixed moments, by complex steps.
    """
    bodies = "".join(
        f'<body pos="{x} {y} {z}" euler="{turn}"><freejoint/>'
        f'<geom name="p{k}" type="ellipsoid" size="{a} {b} {c}"/></body>'
        for k, ((a, b, c), (x, y, z), turn) in enumerate(
            zip(SIZES, PLACES.tolist(), TURNS, strict=True)
        )
    )
    magnet = '<site pos="0.015 0.015 0.06" user="5"/>'
    names = " ".join(f"p{k}" for k in range(4))
    model, data = iron(bodies + magnet, "0.02 -0.03 0.05", f"{CHI} {SATURATION}", names)
    axes = data.geom_xmat.reshape(-1, 3, 3)
    shapes = [
        axis @ np.diag(factors(size)) @ axis.T for axis, size in zip(axes, SIZES, strict=True)
    ]
    volumes = 4 / 3 * math.pi * np.prod(SIZES, axis=1)

    def outer(place):
        return np.array([0.02, -0.03, 0.05]) + flux(place, MAGNET, np.array([0, 0, 5.0]))

    def magnetization(inside):
        size = np.linalg.norm(CHI * inside / SATURATION, axis=1, keepdims=True)
        return CHI * inside / np.hypot(1, size)

    def field_at(k, places, moments):
        near = (flux(places[k], places[j], moments[j]) for j in range(4) if j != k)
        return sum(near, np.zeros(3))

    def excess(unknown):
        inside = SATURATION * unknown.reshape(4, 3)
        found = magnetization(inside)
        moments = volumes[:, None] * found
        given = [outer(PLACES[k]) + field_at(k, PLACES, moments) for k in range(4)]
        lost = np.einsum("kij,kj->ki", shapes, found)
        return ((np.array(given) / MU0 - lost - inside) / SATURATION).ravel()

    result: Any = root(excess, np.zeros(12), tol=1e-14)
    assert abs(result.fun).max() < 3e-14  # 1e-15
    found = magnetization(SATURATION * result.x.reshape(4, 3))
    moments = volumes[:, None] * found
    assert (np.linalg.norm(found, axis=1) > 0.3 * SATURATION).all()
    pieces = dipole_sites(model, data)[1][1:]
    np.testing.assert_allclose(
        pieces, moments, rtol=0, atol=1.5e-14 * np.abs(moments).max()
    )  # 5e-16

    def energy(places):
        fields = [outer(places[k]) + field_at(k, places, moments) / 2 for k in range(4)]
        return -sum(moments[k] @ fields[k] for k in range(4))

    part = 1 - np.sqrt(1 - np.sum((found / SATURATION) ** 2, axis=1))
    stored = MU0 * SATURATION**2 / CHI * part
    stored += MU0 / 2 * np.einsum("ki,kij,kj->k", found, shapes, found)
    total = energy(PLACES) + volumes @ stored
    assert mm.magnetic_energy(model, data) == pytest.approx(total, rel=2e-14)  # 7e-16
    steps = np.eye(12).reshape(12, 4, 3)
    force = [-energy(PLACES + 1e-30j * step).imag / 1e-30 for step in steps]
    scale = np.abs(force).max()
    got = data.xfrc_applied[1:, :3].ravel()
    np.testing.assert_allclose(got, force, rtol=0, atol=3e-14 * scale)  # 1e-15


@pytest.mark.parametrize("saturation", [0, 1e5])
def test_the_field_around_a_sphere(saturation):
    """B_0 and a dipole's field outside; on the surface, normal B and tangential H are continuous.

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
    for distance in (1.0, 1.001, 1.5, 4.0):
        moment = magnetization * axis * 4 / 3 * math.pi * 0.02**3
        far = 3 * (normals @ moment)[:, None] * normals - moment
        expected = strength * axis + 1e-7 * far / (0.02 * distance) ** 3
        found = mm.field(model, data, 0.02 * distance * normals)
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-15)  # 1e-16
    surface = mm.field(model, data, 0.02 * normals)
    along = np.sum(surface * normals, axis=1)
    normal_inside = MU0 * (inside + magnetization) * (normals @ axis)
    np.testing.assert_allclose(along, normal_inside, rtol=0, atol=2.4e-15)  # 8e-17
    tangential = (surface - along[:, None] * normals) / MU0
    expected = inside * (axis - (normals @ axis)[:, None] * normals)
    np.testing.assert_allclose(tangential, expected, rtol=0, atol=1.5e-9)  # 5e-11


def test_iron_at_a_temperature():
    """A grain of iron 1:1:2, chi = 10, turns freely in a field: <cos^2> of its axis.

    Its energy is -V B^2 cos^2 (x_3 - x_1)/(2 mu0), x = chi/(1 + chi N). The means of 64 replicas of
    12 000 steps, together about 27 000 independent samples, give the standard error; four of them
    raise a false alarm for one seed of 6000 (Student's t), and 3 % of the energy would be found.
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
        12_000 * model.opt.timestep,
        replicas=64,
        record_interval=20,
        burn_in=400 * model.opt.timestep,
    )
    w, x, y, z = np.moveaxis(run.qpos.transpose("replica", "time", ...).values, -1, 0)
    means = ((2 * (x * z + w * y)) ** 2).mean(axis=1)
    error = means.std(ddof=1) / 8
    assert error < 0.003  # 0.0018
    assert abs(means.mean() - expected) < 4 * error  # -0.6 errors; 0.6112, expected 0.6124
