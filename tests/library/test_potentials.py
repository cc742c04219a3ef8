"""Periodic potentials of joints: generalized forces that conserve energy on any joint."""

from contextlib import nullcontext

import mujoco
import numpy as np
import pytest

import magmotor as mm
from trials.numpy_twin import potential_forces

PLUGIN = (
    '<extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>'
)
MARK = '<custom><text name="magmotor" data="potentials"/></custom>'

PENDULUM = f"""
<mujoco>
  {{extension}}
  <option integrator="RK4"><flag energy="enable"/></option>
  {MARK}
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="lower" pos="0 0 -1">
        <joint name="knee" axis="0 1 0" user="2 -1 0 1"/>
        <inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""A double pendulum with a potential of 2 J on its second joint."""

TREE = f"""
<mujoco>
  {{extension}}
  <option gravity="0 0 0"/>
  <size nuser_jnt="7"/>
  {MARK}
  <default><geom size="0.1" pos="0.1 0 0"/></default>
  <worldbody>
    <body>
      <freejoint/>
      <geom/>
      <body pos="0 0 1">
        <joint type="ball"/>
        <geom/>
        <body pos="0 0 1" euler="20 30 40">
          <joint type="slide" axis="1 2 3" user="0.3 -0.5 0.2 0.4 0 0.1"/>
          <joint type="hinge" axis="0 1 2" pos="0.1 0.2 0" user="0.4 -0.3"/>
          <geom/>
          <body pos="0 0 1"><joint type="hinge" axis="1 0 0"/><geom/></body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
HOOKS = {"callback": "", "plugin": PLUGIN}


def energy_of(model, q):
    """Sum of the potentials U(q) = sum_k a_k sin kq + b_k cos kq, where q are all of `qpos`."""
    total = 0.0
    for joint, numbers in enumerate(model.jnt_user):
        place = q[model.jnt_qposadr[joint]]
        for k, (a, b) in enumerate(numbers[: len(numbers) // 2 * 2].reshape(-1, 2), start=1):
            total += a * np.sin(k * place) + b * np.cos(k * place)
    return total


def wander(hook, steps, apply=None):
    """Largest change of the double pendulum's energy within 2 s, in J, and the potential's range.

    `apply(model, data)` replaces the forces of the package.
    """
    model = mujoco.MjModel.from_xml_string(PENDULUM.format(extension=HOOKS[hook]))
    model.opt.timestep = 2.0 / steps
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (2.0, 0.5), (0.0, 1.0)
    energies, potentials = [], []
    mujoco.set_mjcb_control(apply)
    with nullcontext() if apply else mm.magnetism():
        for _ in range(steps):
            potentials.append(energy_of(model, data.qpos))
            mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
            energies.append(data.energy.sum() + energy_of(model, data.qpos))
    mujoco.set_mjcb_control(None)
    return np.ptp(energies), np.ptp(potentials)


@pytest.mark.parametrize("hook", HOOKS)
def test_a_potential_on_a_joint_that_is_not_at_the_root_conserves_energy(hook):
    steps = (800, 1600, 3200)
    drifts, swings = zip(*(wander(hook, n) for n in steps), strict=True)
    assert min(swings) > 4  # J; 4.23
    assert drifts[-1] < 3e-6  # J; 2.2e-7
    order = -np.polyfit(np.log(steps), np.log(drifts), 1)[0]
    assert abs(order - 4) < 0.3  # 4.13


def test_a_wrench_from_outside_would_not():
    """The test above notices the reaction on the parent that is missing then."""

    def wrench(model, data):
        knee = model.joint("knee")
        force = potential_forces(model, data)[knee.dofadr[0]]
        data.xfrc_applied[model.body("lower").id, 3:] = force * data.xaxis[knee.id]

    for steps in (200, 800):
        drift, swing = wander("callback", steps, wrench)
        assert drift > 0.5 * swing  # 0.82, 0.83


@pytest.mark.parametrize("hook", HOOKS)
@pytest.mark.parametrize("seed", range(3))
def test_the_generalized_force_is_minus_the_slope_of_the_potential(hook, seed):
    model = mujoco.MjModel.from_xml_string(TREE.format(extension=HOOKS[hook]))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    start = model.qpos0 + rng.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, start)
    data.qpos[:], data.qvel[:] = start, rng.normal(size=model.nv)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    step, slopes = 1e-5, []
    for i in range(model.nv):
        ends = []
        for sign in (1, -1):
            q = start.copy()
            mujoco.mj_integratePos(model, q, sign * step * np.eye(model.nv)[i], 1.0)
            ends.append(energy_of(model, q))
        slopes.append((ends[0] - ends[1]) / (2 * step))
    assert np.count_nonzero(slopes) == 2
    assert abs(data.qfrc_passive + slopes).max() < 1e-9  # N m or N; 1e-10
    expected = potential_forces(model, data)
    np.testing.assert_allclose(data.qfrc_passive, expected, rtol=0, atol=1e-15)  # 0
    assert not data.xfrc_applied.any()


@pytest.mark.parametrize("hook", HOOKS)
def test_finite_differences_do_not_add_the_force_twice(hook):
    """`mjd_transitionFD` keeps the passive forces while it varies controls."""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      {HOOKS[hook]}{MARK}
      <worldbody><body gravcomp="1"><joint name="axle" axis="0 1 0" user="1 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
      <actuator><motor joint="axle"/></actuator>
    </mujoco>""")
    by_state, by_control = np.empty((2, 2)), np.empty((2, 1))
    with mm.magnetism():
        mujoco.mjd_transitionFD(
            model, mujoco.MjData(model), 1e-6, True, by_state, by_control, None, None
        )
    assert by_control[1, 0] == pytest.approx(model.opt.timestep / 0.1, rel=1e-8)  # 4e-10


CART = f"""
<mujoco>
  <option gravity="0 0 0"/>
  {MARK}
  <worldbody>
    <body euler="20 30 40">
      <joint type="slide" axis="1 0 0" user="0.3 -0.5 0.2 0.4"/>
      <joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1" user="0.4 -0.3"/>
      <inertial pos="0 0 0" mass="0.5" diaginertia="0.1 0.1 0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_baoab_conserves_energy_at_second_order():
    """Without damping it is the leapfrog method; a slide without a potential keeps its velocity."""
    model = mujoco.MjModel.from_xml_string(CART)
    steps, drifts = (200, 400, 800, 1600), []
    for n in steps:
        model.opt.timestep = 4.0 / n
        data = mujoco.MjData(model)
        data.qvel[:] = 0.3, 0.4, 0.5
        langevin, energies = mm.Langevin(model), []
        for _ in range(n):
            langevin.step(data)
            kinetic = 0.5 * data.qvel**2 @ model.dof_M0
            energies.append(kinetic + energy_of(model, data.qpos))
        drifts.append(np.ptp(energies))
        assert data.qvel[1] == 0.4
    order = -np.polyfit(np.log(steps), np.log(drifts), 1)[0]
    assert abs(order - 2) < 0.005  # 3e-4
    assert drifts[-1] < 2e-5  # J; 5.5e-6
