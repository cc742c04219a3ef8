"""Samples of the Metropolis algorithm against quadrature and closed forms.

Differences are in standard errors, from the means of 16 replicas. The seeds are fixed; for others,
each bound of 5 would be exceeded by chance once in 6000 (Student's t, 15 degrees of freedom), and
one of the 30 in this file once in 200. The largest difference here is 2.4; laws that are 8 standard
errors away are seen in 99 of 100 runs.
"""

import math
from typing import Any

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf.boltzmann.potential import potential_energy
from magmotor.numerics.batch_means import mean_and_error

SIGMAS = 5
GRAVITY = 9.81

DOUBLE = """
<mujoco>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.08333333333333333 0.08333333333333333 0.01"/>
      <body pos="0 0 -1">
        <joint name="knee" axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="1"
                  diaginertia="0.08333333333333333 0.08333333333333333 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""Two uniform rods of 1 m and 1 kg, whose moments of inertia at their centers are 1/12 kg m^2."""

BALL = """
<mujoco>
  <worldbody>
    <body>
      <joint type="ball"/>
      <inertial pos="0.03 -0.06 0.06" mass="0.5" diaginertia="0.001 0.002 0.0025"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A body of 0.5 kg with three unequal moments, on a pivot 0.09 m from its center of mass."""

CART = """
<mujoco>
  <worldbody>
    <body>
      <joint name="rail" type="slide" axis="1 0 0" stiffness="40"/>
      <inertial pos="0 0 0" mass="0.2" diaginertia="1 1 1"/>
      <body>
        <joint name="pole" axis="0 1 0"/>
        <inertial pos="0 0 0.5" mass="1" diaginertia="1 0.01 1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

CHAIN = """
<mujoco>
  <worldbody>
    <body>
      <joint name="one" type="slide" axis="0 0 1" stiffness="100"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body>
        <joint name="two" type="slide" axis="0 0 1" stiffness="200"/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
        <body>
          <joint name="three" type="slide" axis="0 0 1" stiffness="50"/>
          <inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed stiffness="80" springlength="0.1">
      <joint joint="one" coef="1"/><joint joint="three" coef="2"/>
    </fixed>
  </tendon>
</mujoco>
"""

FREE = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <site name="anchor"/>
    <body>
      <freejoint name="stone"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5"/>
      <site name="center"/>
    </body>
  </worldbody>
  <tendon>
    <spatial stiffness="300" springlength="0"><site site="anchor"/><site site="center"/></spatial>
  </tendon>
</mujoco>
"""

NEEDLE = """
<mujoco>
  <custom><text name="magmotor" data="dipoles potentials"/></custom>
  <worldbody>
    <site pos="0 0 0.2" zaxis="1 0 0" user="3"/>
    <body>
      <joint axis="0 0 1" user="0 0 2e-6 1e-6"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A needle of 0.2 A m^2 at 0.2 m from a magnet of 3 A m^2, and a potential with two wells."""


def sampled(xml, kT, **options):
    model = mujoco.MjModel.from_xml_string(xml)
    return mm.metropolis(model, kT, seed=1, **options)


def deviation(series, truth):
    """Return the difference of mean and truth in standard errors."""
    mean, error = mean_and_error(np.asarray(series))
    return abs(mean - truth) / error


def means(energy, volume, kT, *functions):
    """Return means over laws volume exp(-energy/kT) on a grid, by the trapezoidal rule."""
    weight = volume * np.exp(-(energy - np.min(energy)) / kT)
    return [float(np.sum(weight * each) / np.sum(weight)) for each in functions]


def double_pendulum(kT, exponent=0.5):
    """Return the means of cos q1, cos q2 and V, where det M = 4/9 - cos^2(q2)/4."""
    angles = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    q1, q2 = np.meshgrid(angles, angles, indexing="ij")
    energy = -GRAVITY * (1.5 * np.cos(q1) + 0.5 * np.cos(q1 + q2))
    volume = (4 / 9 - np.cos(q2) ** 2 / 4) ** exponent
    return means(energy, volume, kT, np.cos(q1), np.cos(q2), energy)


def test_double_pendulum():
    """The law has the root of det M: without it, <cos q2> would be 0.354, not 0.321."""
    run = sampled(DOUBLE, 5.0, samples=2500, replicas=16, record_interval=3)
    q1, q2 = np.moveaxis(run.qpos.values, -1, 0)
    series = np.cos(q1), np.cos(q2), run.potential_energy
    found = [*map(deviation, series, double_pendulum(5.0))]
    assert max(found) < SIGMAS
    without, squared = double_pendulum(5.0, 0.0), double_pendulum(5.0, 1.0)
    assert deviation(series[1], without[1]) > SIGMAS  # 10
    assert deviation(series[1], squared[1]) > SIGMAS  # 8
    energy = -GRAVITY * (1.5 * np.cos(q1) + 0.5 * np.cos(q1 + q2))
    assert abs(run.potential_energy - energy).max() < 1e-11  # 9e-13 J, of unwrapped angles


def test_body_on_a_pivot():
    """<z> of the center of mass is by Langevin's function; the axis across it has no preference."""
    kT = 0.2
    run = sampled(BALL, kT, samples=400, replicas=16, record_interval=5, burn_in=300)
    w, x, y, z = np.moveaxis(run.qpos.values, -1, 0)
    # The third row of the rotation matrix: the height of the body's axes.
    heights = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)], axis=-1)
    along, across = heights @ [1 / 3, -2 / 3, 2 / 3], heights @ [2 / 3, 2 / 3, 1 / 3]
    ratio = 0.5 * GRAVITY * 0.09 / kT
    assert deviation(along, 1 / ratio - 1 / math.tanh(ratio)) < SIGMAS
    assert deviation(across, 0) < SIGMAS
    mean_square = 1 - 2 / ratio * (1 / math.tanh(ratio) - 1 / ratio)
    assert deviation(along**2, mean_square) < SIGMAS
    assert deviation(across**2, (1 - mean_square) / 2) < SIGMAS


def test_cart_pole():
    """det M = (0.2 + 1)(0.01 + 0.25) - 0.25 cos^2."""
    kT = 3.0
    run = sampled(CART, kT, samples=400, replicas=16, record_interval=4, burn_in=300)
    angle = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    energy = 0.5 * GRAVITY * np.cos(angle)
    volume = 1.2 * 0.26 - 0.25 * np.cos(angle) ** 2
    functions = np.cos(angle), np.cos(angle) ** 2
    right = means(energy, np.sqrt(volume), kT, *functions)
    wrong = means(energy, 1.0, kT, *functions)
    cosine = np.cos(run.qpos.values[..., 1])
    assert deviation(cosine, right[0]) < SIGMAS
    assert deviation(cosine**2, right[1]) < SIGMAS
    assert deviation(cosine**2, wrong[1]) > 2 * SIGMAS  # 44
    assert deviation(run.qpos.values[..., 0] ** 2, kT / 40) < SIGMAS
    names = ["rail", "pole", "all"]
    assert [*run.move.values] == names


def test_chain_of_springs():
    """V is a quadratic form, whose mean is 3 kT/2 above its minimum."""
    kT = 0.7
    run = sampled(CHAIN, kT, samples=300, replicas=16, record_interval=5, burn_in=300)
    tendon = np.array([1.0, 0.0, 2.0])
    stiffness = np.diag([100.0, 200.0, 50.0]) + 80 * np.outer(tendon, tendon)
    force = 80 * 0.1 * tendon - GRAVITY * np.array([6.0, 5.0, 3.0])
    rest = np.linalg.solve(stiffness, force)
    least = 80 * 0.1**2 / 2 - force @ rest / 2
    assert deviation(run.potential_energy, least + 1.5 * kT) < SIGMAS
    covariance = kT * np.linalg.inv(stiffness)
    moves = run.qpos.values - rest
    for i in range(3):
        assert deviation(moves[..., i], 0) < SIGMAS
        assert (
            deviation(moves[..., i] * moves[..., (i + 1) % 3], covariance[i, (i + 1) % 3]) < SIGMAS
        )
        assert deviation(moves[..., i] ** 2, covariance[i, i]) < SIGMAS


def test_free_body_on_a_spring():
    """<V> is 3 kT/2 at any stiffness; the attitude is uniform, and adapts its own step."""
    run = sampled(FREE, 0.5, samples=300, replicas=16, record_interval=5)
    assert [*run.move.values] == ["stone: position", "stone: rotation", "all"]
    assert deviation(run.potential_energy, 0.75) < SIGMAS
    w, x, y, z = np.moveaxis(run.qpos.values[..., 3:], -1, 0)
    entries = 1 - 2 * (x**2 + y**2), 2 * (x * y - w * z)
    for entry in entries:
        assert deviation(entry, 0) < SIGMAS
        assert deviation(entry**2, 1 / 3) < SIGMAS
    # All rotations are accepted; the two other moves, 35 % of the proposals.
    found = run.acceptance.mean("replica").values
    assert abs(found - [0.35, 1, 0.35]).max() < 0.05


def test_needle_with_a_potential():
    """V = m B cos q + a sin 2q + b cos 2q with B = mu0/(4 pi) 3/0.2^3."""
    kT = 2e-6
    run = sampled(NEEDLE, kT, samples=200, replicas=16, record_interval=3, burn_in=300)
    angle = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    energy = 0.2e-7 * 3 / 0.2**3 * np.cos(angle)
    energy = energy + 2e-6 * np.sin(2 * angle) + 1e-6 * np.cos(2 * angle)
    functions = np.cos(angle), np.cos(angle - 0.7), np.sin(2 * angle), energy
    truths = means(energy, 1.0, kT, *functions)
    q = run.qpos.values[..., 0]
    series = np.cos(q), np.cos(q - 0.7), np.sin(2 * q), run.potential_energy
    assert max(map(deviation, series, truths)) < SIGMAS


def test_own_potential():
    """It replaces gravity, and everything that would be refused."""
    xml = CART.replace("</worldbody>", "</worldbody><equality><joint joint1='rail'/></equality>")
    run = sampled(
        xml,
        2.0,
        samples=200,
        burn_in=300,
        replicas=16,
        potential=lambda data: 30 * float(data.qpos[0]) ** 2,
    )
    assert deviation(run.potential_energy, 1.0) < SIGMAS


def test_the_acceptance_is_the_target():
    run = sampled(CHAIN, 0.7, samples=300, replicas=4)
    assert abs(run.acceptance.mean("replica") - 0.35).max() < 0.05


def test_the_seed_determines_the_chains():
    """The number of replicas does not change the first ones."""
    model = mujoco.MjModel.from_xml_string(CART)
    few: Any = {"samples": 20, "burn_in": 20}
    first = mm.metropolis(model, 1.0, replicas=2, **few)
    more = mm.metropolis(model, 1.0, replicas=3, **few)
    other = mm.metropolis(model, 1.0, replicas=2, seed=1, **few)
    assert first.qpos.identical(more.qpos[:2])
    assert not (first.qpos == other.qpos).any()
    assert not (more.qpos[0] == more.qpos[2]).any()


def test_the_model_is_unchanged():
    model = mujoco.MjModel.from_xml_string(CART)
    flags = model.opt.disableflags, model.opt.enableflags
    mm.metropolis(model, 1.0, samples=2, burn_in=2)
    assert (model.opt.disableflags, model.opt.enableflags) == flags


def test_chains_begin_where_they_are_told():
    """Quaternions are normalized."""
    model = mujoco.MjModel.from_xml_string(BALL)
    run = mm.metropolis(
        model,
        1.0,
        samples=3,
        burn_in=0,
        replicas=2,
        initial=[[0, 3, 0, 0], [0, 0, 0, -2]],
        potential=lambda data: 0.0 if abs(data.qpos).max() == 1 else math.inf,
    )
    assert (run.qpos == np.array([[[0, 1, 0, 0]], [[0, 0, 0, -1]]])).all()


def test_potential_energy_of_disabled_forces():
    model = mujoco.MjModel.from_xml_string(CHAIN)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SPRING)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.1, 0.2, 0.3
    mujoco.mj_fwdPosition(model, data)
    expected = GRAVITY * (0.1 + 2 * 0.3 + 3 * 0.6)
    assert potential_energy(model)(data) == pytest.approx(expected, rel=1e-14)
