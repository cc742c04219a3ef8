"""The temperature of chains of pendulums in `mj_step`, with noise in equilibrium and without.

Each test compares one mean with its own standard error s, from 16 blocks of a run that are longer
than its memory; Student's t with 15 degrees of freedom exceeds 5 with a chance of 1.6e-4.
"""

import itertools

import mujoco
import numpy as np
import pytest

import magmotor as mm

KT = 0.1
LINK = """
<body pos="0 0 {pos}" {user}>
  <joint axis="0 1 0" damping="{damping}"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.01" mass="1"/>
  {child}
</body>
"""
CHAIN = """
<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" viscosity="{viscosity}"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>{links}</worldbody>
</mujoco>
"""


def chain(links, *, timestep=0.002, integrator="RK4", viscosity=0.0, damping=0.0, user=""):
    text = ""
    for k in reversed(range(links)):
        text = LINK.format(pos=-0.1 if k else 0, user=user, damping=damping, child=text)
    return mujoco.MjSpec.from_string(
        CHAIN.format(timestep=timestep, integrator=integrator, viscosity=viscosity, links=text)
    )


def temperature(model, kT, seconds, step):
    """Return the mean of v^T M v/(nv kT) and its standard error; `step` takes ten steps."""
    data, product = mujoco.MjData(model), np.empty(model.nv)
    ratios = np.empty(int(seconds / model.opt.timestep / 10))
    for k in range(len(ratios)):
        step(model, data)
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_mulM(model, data, product, data.qvel)
        ratios[k] = data.qvel @ product / (model.nv * kT)
    ratios = ratios[len(ratios) // 20 :]
    blocks = ratios[: len(ratios) // 16 * 16].reshape(16, -1).mean(axis=1)
    return blocks.mean(), blocks.std(ddof=1) / 4


def ten_steps(model, data):
    mujoco.mj_step(model, data, nstep=10)


def driven_by(noise):
    """Return what takes ten steps with a noise force in each."""

    def step(model, data):
        for _ in range(10):
            data.qfrc_applied[:] = noise.force(data)
            mujoco.mj_step(model, data)

    return step


@pytest.mark.parametrize(("links", "seconds"), [(2, 150), (6, 120)])
def test_rows_against_the_drag_of_a_fluid(links, seconds):
    """Measured: 0.938(31) and 0.990(32); over 1500 s, two links have 1.000(11)."""
    spec = chain(links, viscosity=10)
    for body, row in zip(spec.bodies, mm.brownian_rows(spec.compile(), KT), strict=True):
        body.userdata = row
    with mm.magnetism():
        mean, error = temperature(spec.compile(), KT, seconds, ten_steps)
    assert error < 0.04  # 0.031, 0.032
    assert abs(mean - 1) < 5 * error


@pytest.mark.parametrize(("links", "seconds"), [(2, 30), (6, 15)])
def test_joint_noise_against_damping_of_joints_and_a_fluid(links, seconds):
    """Measured: 0.939(57) and 0.980(41)."""
    model = chain(links, viscosity=10, damping=0.02).compile()
    mean, error = temperature(model, KT, seconds, driven_by(mm.JointNoise(model, KT, seed=1)))
    assert error < 0.1  # 0.057, 0.041
    assert abs(mean - 1) < 5 * error


def test_torques_of_the_world_against_damping_of_joints_are_too_hot():
    """By alpha^2/(2c) on each body, two links have 1.51(6) kT; 100 s."""
    spec = chain(2, timestep=0.001, damping=0.1, user=f'user="0 0 0 0 {np.sqrt(0.2 * KT)} 0"')
    with mm.magnetism():
        mean, error = temperature(spec.compile(), KT, 100, ten_steps)
    assert error < 0.1  # 0.055
    assert mean > 1 + 5 * error


def test_joint_noise_is_too_cold_with_dry_friction():
    """A pendulum with a damping of 0.05 and a frictionloss of 0.1 over 30 s.

    Measured at 5 mJ: 0.501(34) kT.
    """
    spec = chain(1, timestep=0.001, damping=0.05)
    spec.joints[0].frictionloss = 0.1
    model = spec.compile()
    with pytest.warns(UserWarning, match="dry friction"):
        noise = mm.JointNoise(model, COLD, seed=1)
    mean, error = temperature(model, COLD, 30, driven_by(noise))
    assert error < 0.07  # 0.034
    assert mean < 1 - 5 * error


HOT, COLD = 0.5, 0.005
"""Thermal energies in J; the weights of the six links have energies of 0.05 to 0.5 J."""


@pytest.mark.parametrize(("kT", "hot"), [(HOT, True), (COLD, False)])
def test_euler_heats_chains_that_move_fast(kT, hot):
    """With matched noise at 5 ms; the forces that Euler spoils are squares of velocities.

    Measured: 3.05(20) kT at 0.5 J and 0.91(2) kT at 0.005 J, where implicit damping cools; 150 s.
    """
    model = chain(6, timestep=0.005, integrator="Euler", damping=0.05).compile()
    mean, error = temperature(model, kT, 150, driven_by(mm.JointNoise(model, kT, seed=1)))
    assert error < (0.4 if hot else 0.04)  # 0.20, 0.021
    assert (mean > 1 + 5 * error) if hot else (mean < 1 + 5 * error)


@pytest.mark.parametrize(
    ("integrator", "hot", "seconds"), [("Euler", True, 60), ("RK4", False, 200)]
)
def test_eulers_free_motion_is_what_heats(integrator, hot, seconds):
    """Exact friction and noise by Crank-Nicolson, then the motion without them by `mj_step`.

    Measured at 4 ms: 3.21(27) kT with Euler, 1.02(5) kT with RK4.
    """
    model = chain(6, timestep=0.004, integrator=integrator).compile()
    generator, inertia = np.random.default_rng(1), np.empty((6, 6))
    h, c = model.opt.timestep, 0.05

    def step(model, data):
        for _ in itertools.repeat(None, 10):
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fullM(model, data, inertia)
            half = h * c / 2 * np.eye(6)
            kick = np.sqrt(2 * HOT * c * h) * generator.normal(size=6)
            data.qvel[:] = np.linalg.solve(inertia + half, (inertia - half) @ data.qvel + kick)
            mujoco.mj_step(model, data)

    mean, error = temperature(model, HOT, seconds, step)
    assert error < (0.4 if hot else 0.1)  # 0.27, 0.047
    assert (mean > 1 + 5 * error) if hot else (abs(mean - 1) < 5 * error)


BOX = """
<mujoco>
  <option timestep="{timestep}"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body pos="0 0 {half}"><freejoint/><geom type="box" size="{half} {half} {half}"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(
    ("half", "kT", "rate", "timestep", "most", "seconds"),
    [
        (0.1, 0.1, 1, 0.002, 0.1, 2),  # a = 88; measured: 0.0112(2)
        (0.1, 0.1, 1, 0.0005, 0.1, 2),  # the same at a shorter timestep: 0.0124(1)
        (0.1, 0.1, 10, 0.002, 0.5, 2),  # a = 8.8: 0.150(7)
        (0.1, 10, 1, 0.002, 0.5, 4),  # a = 8.8: 0.176(13)
        (0.1, 10, 10, 0.002, 1.0, 8),  # a = 0.88: 0.810(16)
        (0.05, 0.1, 100, 0.002, 1.0, 8),  # a = 0.31: 0.914(6)
        (0.05, 1, 100, 0.002, 1.0, 20),  # a = 0.098: 0.962(5)
    ],
)
def test_steps_of_mujoco_are_too_cold_where_dry_friction_acts(
    half, kT, rate, timestep, most, seconds
):
    """A box on a plane by "o-step-o", 16 replicas of 2 to 20 s, from the velocities.

    They settle for 2 s first, in which the thermostat alone would reach 98 % of kT or more. Dry
    friction mu m g stops a thermal velocity sqrt(kT/m) a times as fast as the thermostat's friction
    does: a = mu g/(rate sqrt(kT/m)).
    """
    model = mujoco.MjModel.from_xml_string(BOX.format(half=half, timestep=timestep))
    langevin = mm.Langevin(model, kT, splitting="o-step-o", friction=rate, seed=1)
    settle, nstep = round(2 / timestep), round(seconds / timestep)
    run = langevin.sample(
        nstep * langevin.timestep,
        replicas=16,
        record_interval=10,
        burn_in=settle * langevin.timestep,
    )
    ratios = (run.qvel.values**2 @ model.dof_M0).mean(axis=1) / (6 * kT)
    assert ratios.mean() + 5 * ratios.std(ddof=1) / 4 < most
