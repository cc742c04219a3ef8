"""Temperatures of positions and velocities that are drawn from known laws.

The seeds are fixed. For others, each bound of 5 standard errors would be exceeded by chance once in
6000 (Student's t, 15 degrees of freedom), and one of the seven in this file once in 850.
"""

import mujoco
import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor.mjcf.boltzmann import temperatures
from magmotor.mjcf.boltzmann.forces import resting_forces
from magmotor.mjcf.boltzmann.potential import potential_energy

SIGMAS = 5

DOUBLE = """
<mujoco>
  <worldbody>
    <body>
      <joint name="upper" axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/>
      <body pos="0 0 -1">
        <joint axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="3" diaginertia="0.2 0.2 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

ARM = """
<mujoco>
  <option><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="shoulder" type="ball"/>
      <geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 -0.3" density="200"/>
      <body pos="0 0 -0.6">
        <joint name="elbow" axis="0 1 0" armature="0.3" stiffness="20"/>
        <joint type="slide" axis="1 0 1" stiffness="300"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

EVERYTHING = """
<mujoco>
  <compiler autolimits="true"/>
  <option><flag contact="disable"/></option>
  <size nuser_jnt="4"/>
  <custom><text name="magmotor" data="dipoles potentials noise"/></custom>
  <worldbody>
    <site name="post" pos="0.3 0.2 0" user="60"/>
    <body>
      <joint type="ball" range="0 0.5" margin="0.05" solimplimit="0.5 0.9 0.3 0.4 3"/>
      <geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 -0.3" density="200"/>
      <site pos="0.1 0 -0.2" user="40"/>
      <body pos="0 0 -0.6" gravcomp="0.4" user="1 2 3 4 5 6">
        <joint name="elbow" axis="0 1 0" armature="0.3" stiffness="20" range="-0.2 0.1"
               user="2 1 0 3" margin="0.03" solreflimit="-300 -20"
               solimplimit="0.3 0.95 2 0.5 2"/>
        <joint name="rail" type="slide" axis="1 0 1" stiffness="300" springref="0.2"
               range="0 1" solreflimit="0.003 1" solimplimit="0.01 0.02 0.5 0.5 3"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.1"/>
        <site name="end" pos="0.1 0 -0.5" user="30"/>
      </body>
    </body>
    <body pos="1 0 0">
      <freejoint/>
      <geom type="box" size="0.1 0.2 0.3" density="20"/>
      <site name="corner" pos="0.1 0.1 0"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="rope" range="0 0.9" stiffness="40" springlength="0.3">
      <site site="post"/><site site="end"/><site site="corner"/>
    </spatial>
    <fixed name="sum"><joint joint="elbow" coef="1"/><joint joint="rail" coef="2"/></fixed>
  </tendon>
  <actuator>
    <position joint="elbow" kp="30" forcerange="-5 4"/>
    <position tendon="rope" kp="10"/>
    <general tendon="sum" gear="3" biastype="affine" biasprm="3 0 0"/>
  </actuator>
</mujoco>
"""
"""Every kind of force that has a potential; the noise must not act."""


NEEDLE = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0 0.2" zaxis="1 0 0" user="3"/>
    <body>
      <joint axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


def load(xml):
    return mujoco.MjModel.from_xml_string(xml)


def mass_matrices(model, positions):
    """Yield the index of each position with its mass matrix."""
    data, unit = mujoco.MjData(model), np.eye(model.nv)
    for at in np.ndindex(positions.shape[:-1]):
        data.qpos[:] = positions[at]
        mujoco.mj_fwdPosition(model, data)
        matrix = np.empty((model.nv, model.nv))
        for row, each in zip(matrix, unit, strict=True):
            mujoco.mj_mulM(model, data, row, each)
        yield at, matrix


def with_velocities(model, run, kT, seed):
    """Add v = sqrt(kT) L^-T xi with M = L L^T, whose covariance is kT M^-1."""
    random = np.random.default_rng(seed)
    velocities = np.empty((*run.potential_energy.shape, model.nv))
    for at, matrix in mass_matrices(model, run.qpos.values):
        noise = np.sqrt(kT) * random.standard_normal(model.nv)
        velocities[at] = np.linalg.solve(np.linalg.cholesky(matrix).T, noise)
    return run.assign(qvel=(("replica", "sample", "nv"), velocities))


def test_the_forces_are_the_gradient_of_the_energy():
    """MuJoCo's forces at rest against the potential, which is written out; with all limits hit."""
    model = load(EVERYTHING)
    data, energy = mujoco.MjData(model), potential_energy(model)
    model.body_user[:] = 0
    random, kinds = np.random.default_rng(0), set()
    with mm.magnetism():
        for _ in range(20):
            start = model.qpos0.copy()
            mujoco.mj_integratePos(model, start, 0.6 * random.standard_normal(model.nv), 1)
            data.qpos[:] = start
            forces = resting_forces(model, data)
            kinds |= {*data.efc_type.tolist()}
            slopes = np.zeros(model.nv)
            for i, step in [(i, step) for i in range(model.nv) for step in (1e-5, -1e-5)]:
                data.qpos[:] = start
                mujoco.mj_integratePos(model, data.qpos, step * np.eye(model.nv)[i], 1)
                mujoco.mj_fwdPosition(model, data)
                slopes[i] += energy(data) / (2 * step)
            assert abs(slopes + forces).max() < 1e-9 * abs(forces).max()  # 6e-11
    assert kinds == {3, 4}  # limits of joints and tendons


@pytest.fixture(scope="module")
def arm():
    """16 x 500 positions and velocities of an arm at 2 J."""
    model = load(ARM)
    run = mm.metropolis(model, 2.0, samples=500, seed=1, record_interval=3)
    return model, with_velocities(model, run, 2.0, seed=2)


def test_kinetic_temperature(arm):
    model, run = arm
    found = mm.kinetic_temperature(model, run)
    assert [*found.joint.values] == ["shoulder", "elbow", "joint 2"]
    assert (abs(found.temperature - 2) < SIGMAS * found.error).all()  # 0.9
    assert abs(found.total - 2) < SIGMAS * found.total_error  # 0.2
    # The total is the mean of chi^2/5, whose variance is 2 kT^2/5; its error is known to 18 %.
    assert found.total_error == pytest.approx(2 * np.sqrt(0.4 / 8000), rel=0.7)  # 0.07


def test_a_hot_joint_is_detected(arm):
    """1.1 kT on the shoulder."""
    model, run = arm
    hot = run.assign(qvel=run.qvel * np.sqrt([1.1, 1.1, 1.1, 1, 1]))
    found = mm.kinetic_temperature(model, hot)
    scores = abs(found.temperature - 2) / found.error
    assert scores[0] > 2 * SIGMAS  # 17, by the inertia that couples the joints


def test_the_mass_matrix_is_that_of_the_position(arm):
    """Velocities drawn at other positions are wrong by many errors."""
    model, run = arm
    found = mm.kinetic_temperature(model, run.assign(qpos=run.qpos[:, ::-1]))
    assert abs(found.total - 2) > 2 * SIGMAS * found.total_error  # 20


def test_one_chain_is_as_good_as_many(arm):
    """Without the dimension `replica`, the means of 8 batches give the error (t, 7 degrees).

    By the law of F, one in 500 seeds has a ratio of these errors outside of the bounds.
    """
    model, run = arm
    joined = run[["qpos", "qvel"]].stack(time=("replica", "sample")).transpose("time", ...)
    many = mm.kinetic_temperature(model, run)
    one = mm.kinetic_temperature(model, joined)
    assert one.total == pytest.approx(float(many.total), rel=1e-14)
    assert 0.3 < one.total_error / many.total_error < 3  # 1.04


def pendulum(kT, samples=1000, **options):
    """Return a double pendulum and 16 times as many positions."""
    model = load(DOUBLE)
    run = mm.metropolis(
        model, kT, samples=samples, seed=1, record_interval=4, burn_in=300, **options
    )
    return model, run


@pytest.fixture(scope="module")
def double():
    return pendulum(5.0)


def score(drawn, kT):
    """Return the difference of the configurational temperature from kT, in standard errors."""
    model, run = drawn
    found = mm.configurational_temperature(model, run)
    return float((found.temperature - kT) / found.error)


def test_configurational_temperature(double):
    """Which is not 10 % lower."""
    assert abs(score(double, 5)) < SIGMAS  # 0.003
    assert score(double, 4.5) > SIGMAS  # 8.8


def test_the_law_without_the_mass_matrix_is_detected():
    """A potential of kT/2 log det M takes the root of the determinant away."""
    model = load(DOUBLE)
    energy = potential_energy(model)

    def wrong(data):
        return energy(data) - 15 / 2 * float(np.log(data.qLDiagInv).sum())

    assert abs(score(pendulum(15.0, 700, potential=wrong), 15)) > 2 * SIGMAS  # 17


def test_configurational_temperature_of_a_ball_joint(arm):
    assert abs(score(arm, 2)) < SIGMAS  # 0.1


def test_configurational_temperature_of_dipoles():
    """A needle of 0.2 A m^2 at 0.2 m from a magnet of 3 A m^2: V = 7.5e-6 J cos q."""
    model = load(NEEDLE)
    run = mm.metropolis(
        model,
        4e-6,
        samples=500,
        record_interval=3,
        potential=lambda data: 7.5e-6 * np.cos(data.qpos[0]),
    )
    assert abs(score((model, run), 4e-6)) < SIGMAS  # 0.3


def test_noise_does_not_act():
    """Brownian wrenches of 100 N sqrt(s) change nothing."""
    run = xr.Dataset({"qpos": (("time", "nq"), np.linspace(-1, 1, 20)[:, np.newaxis])})
    noisy = NEEDLE.replace('"dipoles"', '"dipoles noise"')
    noisy = noisy.replace("<body>", '<body user="100 200 300 400 500 600">')
    first, second = (mm.configurational_temperature(load(xml), run) for xml in (NEEDLE, noisy))
    assert first.identical(second)


def test_own_forces(double):
    """Twice the forces are those at twice the temperature."""
    model, run = double

    def twice(data):
        data.qvel[:] = 0
        mujoco.mj_fwdVelocity(model, data)
        return -2 * data.qfrc_bias

    few = run.isel(sample=slice(None, None, 20))
    once = mm.configurational_temperature(model, few)
    found = mm.configurational_temperature(model, few, twice)
    for name in ("temperature", "error"):
        assert found[name] == pytest.approx(2 * float(once[name]), rel=1e-9)


def test_a_long_run_is_thinned(double, monkeypatch):
    """To 200000 evaluations, here 20000: five for each of 4000 positions, evenly spaced."""
    assert temperatures.CALLS == 200_000
    monkeypatch.setattr(temperatures, "CALLS", 20_000)
    model, run = double
    calls = []

    def forces(data):
        calls.append(float(data.qpos[0]))
        return -np.sin(data.qpos)

    long = xr.Dataset({"qpos": (("time", "nq"), run.qpos.values.reshape(-1, 2))})
    mm.configurational_temperature(model, long, forces)
    assert len(calls) == 20_000
    assert (calls[0], calls[-5]) == (long.qpos[0, 0], long.qpos[-1, 0])
