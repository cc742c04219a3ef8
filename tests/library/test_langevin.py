"""`mm.Langevin` piece by piece: friction, noise, forces, heat and work, bits, and each refusal.

What becomes of its Boltzmann ensembles is tested in test_langevin_boltzmann.py. Statistical tests
have fixed seeds.
"""

import copy
import itertools
import math
import os
import pickle
import re
import signal
import threading
import time
from functools import partial
from typing import Any

import mujoco
import numpy as np
import pytest
from brief_runs import BRIEF
from refusals import refused
from test_friction import TREE

import magmotor as mm
from magmotor import noise
from magmotor.common.environment import data_folder
from magmotor.mjcf.langevin import loop_calls, relaxation
from magmotor.mjcf.langevin.baths import read_friction
from magmotor.mjcf.langevin.friction import ON_JOINTS, dampers, friction_matrix, model_friction
from magmotor.mjcf.langevin.relaxation import Sampling, unsettled

EVERY_DAMPER = TREE.replace('biasprm="1 0 -0.2"', 'biasprm="0 0 -0.2"').replace(
    "<option", '<option timestep="1e-7"'
)
"""Actuators on sites must not have a bias of the position, which has no potential."""

CONTACT = ("contact",)

# Some of these trees fall, for a few steps.
pytestmark = pytest.mark.filterwarnings("ignore:.*nothing holds its tree")


def state(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """Return data with random positions and velocities."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 1.0)
    data.qvel[:] = rng.normal(size=model.nv)
    return data


def at(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Return other data at the same position, computed by MuJoCo itself, at rest."""
    other = mujoco.MjData(model)
    other.qpos[:] = data.qpos
    mujoco.mj_forward(model, other)
    return other


def inertia(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    matrix = np.empty((model.nv, model.nv))
    for row, unit in zip(matrix, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    return matrix


@pytest.mark.parametrize("seed", range(4))
def test_friction_removes_the_power_of_every_damper(seed):
    """The heat of one short step without noise is -h v C v, by a numpy sum over Jacobians."""
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    data = state(model, seed)
    velocity = data.qvel.copy()
    power = velocity @ friction_matrix(model, at(model, data), model_friction(model)) @ velocity
    heat = mm.Langevin(model, kT=0, disable=CONTACT).step(data)["kT"]
    assert heat / 1e-7 == pytest.approx(-power, rel=1e-3)  # measured: 6.6e-5, of order h


REPLICAS = 10_000
"""Samples of the impulse of one short step."""


def covariance(langevin: mm.Langevin, data: mujoco.MjData) -> np.ndarray:
    """Return the covariance of the impulses of one step from rest, over twice the timestep."""
    model = langevin.model
    start = np.tile(np.concatenate([[0.0], data.qpos, 0 * data.qvel]), (REPLICAS, 1))
    threads = [mujoco.MjData(model) for _ in range(2)]
    ends = langevin.rollout(threads, start, None, control_spec=0, nstep=1)[:, 0, model.nq :]
    impulses = (ends - ends.mean(axis=0)) @ inertia(model, at(model, data))
    return impulses.T @ impulses / REPLICAS / (2 * langevin.timestep)


def deviation(found: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest difference of two covariances, in standard errors of the first one.

    Of the 91 elements of 13 velocities, one is beyond 4.5 by chance once in 1600 seeds. A factor
    1.1 of one diagonal element alone is 7 standard errors, and seen in 99 of 100 seeds.
    """
    squares = np.diag(expected)
    errors = np.sqrt((expected**2 + np.outer(squares, squares)) / REPLICAS)
    return float((abs(found - expected) / errors).max())


def test_noise_has_the_covariance_of_the_friction():
    """The impulse of one short step from rest has the covariance 2 kT h C; 10 000 samples."""
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    data = state(model, 5)
    found = covariance(mm.Langevin(model, kT=1.0, disable=CONTACT, seed=3), data)
    expected = friction_matrix(model, at(model, data), model_friction(model))
    assert deviation(found, expected) < 4.5  # 2.6
    assert deviation(0.9 * found, expected) > 6  # 8.0: 10 % would be seen


def named_dampers() -> tuple[mujoco.MjModel, dict[str, float]]:
    """Return a model with every damper, and a temperature of its own for each bath."""
    spec = mujoco.MjSpec.from_string(EVERY_DAMPER)
    for i, actuator in enumerate(spec.actuators):
        actuator.name = f"actuator {i}"
    model = spec.compile()
    names = [model.body(i).name for i in range(1, model.nbody) if model.body(i).name]
    names += [model.tendon(i).name for i in range(model.ntendon)]
    owned = {int(kind) for kind in (mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtTrn.mjTRN_SLIDERCRANK)}
    names += [model.actuator(i).name for i in range(model.nu) if model.actuator_trntype[i] in owned]
    return model, {name: 0.5 + i for i, name in enumerate(names)}


def rows_by_bath(model: mujoco.MjModel, data: mujoco.MjData, kT: dict[str, float]):
    """Return the coefficients, the rows and the bath of every damper, by MuJoCo's own Jacobians."""
    friction, names = model_friction(model), [*kT]
    coefficients, rows = dampers(model, data, friction)
    bodies = [model.body(model.jnt_bodyid[j]).name for j in model.dof_jntid]
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    outputs = []
    for i in range(model.nu):
        kind = int(model.actuator_trntype[i])
        owner = model.actuator(i).name
        if kind in ON_JOINTS:
            owner = model.body(model.jnt_bodyid[model.actuator_trnid[i, 0]]).name
        elif kind == int(mujoco.mjtTrn.mjTRN_TENDON):
            owner = model.tendon(model.actuator_trnid[i, 0]).name
        outputs += [owner] * int(model.actuator_outnum[i])
    drag = [model.body(body).name for body in friction.drag_bodies for _ in range(6)]
    owners = [*bodies, *tendons, *outputs, *drag]
    assert len(owners) == len(coefficients)
    return coefficients, rows, np.array([names.index(owner) for owner in owners])


def test_every_damper_has_the_temperature_of_its_own_bath():
    """The covariance of a short step's impulse is 2 h sum kT c a a^T.

    The heat of one such step without noise is that of the bath's own dampers.
    """
    model, kT = named_dampers()
    data = state(model, 7)
    whole = at(model, data)
    coefficients, rows, baths = rows_by_bath(model, whole, kT)
    powers = coefficients * (rows @ data.qvel) ** 2
    cold = mm.Langevin(model, kT=dict.fromkeys(kT, 0.0), disable=CONTACT).step(copy.copy(data))
    for number, name in enumerate(kT):
        expected = -powers[baths == number].sum()
        assert cold[name] / 1e-7 == pytest.approx(expected, rel=1e-3)  # 7e-5, of order h
    temperatures = np.array([*kT.values()])[baths]
    expected = (rows.T * (temperatures * coefficients)) @ rows
    found = covariance(mm.Langevin(model, kT=kT, disable=CONTACT, seed=3), data)
    assert deviation(found, expected) < 4.5  # 2.4


def test_the_noises_of_drag_and_of_a_limit_are_independent():
    """The variance as above, of a hinge beyond its limit; false alarm rate 7e-6."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="1e-7" gravity="0 0 0" viscosity="60"/><worldbody><body>'
        '<joint axis="0 1 0" range="-60 0" solimplimit="0.5 0.5 1"/>'
        '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    powers = []
    for angle in (-0.5, 0.1):
        data = mujoco.MjData(model)
        data.qpos[0], data.qvel[0] = angle, 1.0
        powers.append(-mm.Langevin(model, kT=0).step(data)["kT"] / 1e-7)
    assert 0.4 < powers[0] / powers[1] < 0.6  # 0.47, the part of the drag
    found = covariance(mm.Langevin(model, kT=1.0), data)
    assert deviation(found, np.array([[powers[1]]])) < 4.5  # 1.0


def test_a_friction_matrix_has_its_noise():
    """Covariance as above, of 15 elements, and the power that it removes; false alarm rate 1e-4."""
    model = mujoco.MjModel.from_xml_string(ARM.format(elbow="", more=""))
    model.opt.timestep = 1e-7
    root = np.random.default_rng(1).normal(size=(model.nv, 3))
    matrix = root @ root.T
    data = state(model, 2)
    power = data.qvel @ matrix @ data.qvel
    cold = mm.Langevin(model, kT=0, friction=matrix, disable=CONTACT).step(copy.copy(data))
    assert cold["kT"] / 1e-7 == pytest.approx(-power, rel=2e-5)  # 8e-7, of order h
    found = covariance(mm.Langevin(model, kT=2.0, friction=matrix, disable=CONTACT), data)
    assert deviation(found / 2, matrix) < 4.5  # 1.6


@pytest.mark.parametrize("name", ["top", "motor"])
def test_the_plugin_has_the_forces_of_the_block(name):
    """Those of MuJoCo, too; the motor's noise is left out, which the block would add."""
    found = []
    for file in (name, f"{name}_magnetic"):
        model = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{file}.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        langevin = mm.Langevin(model, kT=0.0, friction=1.0, disable=CONTACT)
        found.append(langevin.forces(data))
        with mm.magnetism():
            mujoco.mj_forward(model, data)
            data.qvel[:] = 0
            mujoco.mj_forward(model, data)
    assert abs(found[0]).max() > 0
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12, atol=1e-15 * abs(found[0]).max())
    if name == "top":
        scale = abs(data.qfrc_smooth).max()
        np.testing.assert_allclose(found[0], data.qfrc_smooth, rtol=0, atol=1e-9 * scale)


def test_plugins_of_geoms_exert_no_force_and_those_of_actuators_can_be_disabled():
    """A torus by a distance function of MuJoCo's, which a servo by another plugin holds."""
    xml = """
    <mujoco>
      <extension>
        <plugin plugin="mujoco.sdf.torus"><instance name="torus"/></plugin>
        {extension}
      </extension>
      <asset><mesh name="torus"><plugin instance="torus"/></mesh></asset>
      <worldbody>
        <body>
          <joint name="hinge" axis="0 1 0" damping="1"/>
          <geom type="sdf" mesh="torus" pos="0 0 -1"><plugin instance="torus"/></geom>
        </body>
      </worldbody>
      {actuator}
    </mujoco>
    """
    plain = mujoco.MjModel.from_xml_string(xml.format(extension="", actuator=""))
    servo = '<actuator><plugin plugin="mujoco.pid" joint="hinge"/></actuator>'
    driven = mujoco.MjModel.from_xml_string(
        xml.format(extension='<plugin plugin="mujoco.pid"/>', actuator=servo)
    )
    with pytest.raises(mm.InputError):
        mm.Langevin(driven, kT=1.0)
    states = []
    for model, disable in ((plain, ()), (driven, ["actuation"])):
        data = mujoco.MjData(model)
        mm.Langevin(model, kT=1.0, disable=disable).step(data, 100)
        states.append((data.qpos[0], data.qvel[0]))
    assert states[0] == states[1]
    assert states[0][1] != 0


@pytest.mark.parametrize("seed", range(3))
def test_forces_are_those_of_mujoco_at_rest(seed):
    """Gravity, its compensation, springs of joints and tendons, actuators, applied forces."""
    xml = EVERY_DAMPER.replace('name="hip"', 'name="hip" stiffness="3" springref="20"')
    xml = xml.replace('name="ball"', 'name="ball" stiffness="2"')
    xml = xml.replace('name="spatial"', 'name="spatial" stiffness="5" springlength="0.3"')
    model = mujoco.MjModel.from_xml_string(xml.replace('name="arm"', 'name="arm" gravcomp="0.7"'))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = state(model, seed)
    data.ctrl[:] = 0.3
    data.qfrc_applied[:] = np.linspace(-1, 1, model.nv)
    data.xfrc_applied[1:] = np.linspace(-2, 1, 6 * (model.nbody - 1)).reshape(-1, 6)
    found = mm.Langevin(model, kT=1).forces(data)
    data.qvel[:] = 0
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(found, data.qfrc_smooth, rtol=0, atol=6e-13)  # 2e-14 of 70


ARM = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="ball" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 -0.5" size="0.05" mass="1" contype="0"
            conaffinity="0"/>
      <body name="lower" pos="0.1 0 -0.5">
        <joint name="elbow" axis="0 1 0" damping="0.1" {elbow}/>
        <geom name="forearm" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05" mass="1"
              condim="1"/>
      </body>
    </body>
    <body name="slider" pos="1 0 -0.9">
      <joint name="slide" type="slide" axis="1 0 0" damping="0.1"/>
      <geom name="block" type="sphere" size="0.1" mass="0.5" condim="1"/>
    </body>
  </worldbody>
  {more}
</mujoco>
"""
SOFT = {
    "limit": ARM.format(elbow='range="-30 40"', more=""),
    "contact": ARM.format(elbow="", more=""),
    "tendon limit": ARM.format(
        elbow="",
        more='<tendon><fixed limited="true" range="-0.2 0.3"><joint joint="elbow" coef="1"/>'
        '<joint joint="slide" coef="2"/></fixed></tendon>',
    ),
    "connect": ARM.format(
        elbow="",
        more='<equality><connect body1="lower" body2="slider" anchor="0 0 -0.5"/></equality>',
    ),
    "weld": ARM.format(
        elbow="", more='<equality><weld body1="lower" body2="slider"/></equality>'
    ),
    "joint": ARM.format(
        elbow="",
        more='<equality><joint joint1="elbow" joint2="slide" polycoef="0 1 0.5 0 0"/></equality>',
    ),
}  # fmt: skip


def work_on_a_loop(model, langevin: mm.Langevin, base, seed: int) -> tuple[float, float]:
    """Return the work of the forces on a closed path, and the sum of its absolute values."""
    rng, pieces = np.random.default_rng(seed), 1600
    cosine, sine, center = rng.normal(size=(3, model.nv)) * [[0.7], [0.7], [0.2]]
    data, works = mujoco.MjData(model), []
    for angle in 2 * np.pi * (np.arange(pieces) + 0.5) / pieces:
        ends = []
        for turn in (-np.pi / pieces, np.pi / pieces, 0.0):
            end, t = base.copy(), angle + turn
            mujoco.mj_integratePos(model, end, cosine * np.cos(t) + sine * np.sin(t) + center, 1.0)
            ends.append(end)
        step = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, step, 1.0, ends[0], ends[1])
        data.qpos[:] = ends[2]
        works.append(langevin.forces(data) @ step)
    return sum(works), sum(map(abs, works))


@pytest.mark.parametrize("kind", SOFT)
def test_soft_constraints_have_a_potential(kind):
    """Their forces do no work on closed paths, up to the quadrature at their kinks."""
    model = mujoco.MjModel.from_xml_string(SOFT[kind])
    model.opt.timestep = 5e-4
    langevin = mm.Langevin(model, kT=1, disable=() if kind == "contact" else CONTACT)
    free = mm.Langevin(model, kT=1, disable=("constraint",))
    data = mujoco.MjData(model)
    data.qpos[model.joint("slide").qposadr[0]] = -0.8
    data.qpos[model.joint("elbow").qposadr[0]] = 0.0 if kind == "contact" else 1.0
    base = data.qpos.copy()
    assert abs(langevin.forces(data) - free.forces(data)).max() > 1
    for seed in range(2):
        work, size = work_on_a_loop(model, langevin, base, seed)
        assert abs(work) < 3e-5 * size  # measured: 3.3e-6


@pytest.mark.parametrize(
    ("kind", "joint", "push"), [("limit", "elbow", 20.0), ("tendon limit", "slide", 3.0)]
)
def test_soft_constraints_give_way_as_in_mujoco(kind, joint, push):
    """A constant force at rest: MuJoCo's solver and the forces of the position agree."""
    model = mujoco.MjModel.from_xml_string(SOFT[kind])
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.dof_damping[:] = 5
    data = mujoco.MjData(model)
    dof = model.joint(joint).dofadr[0]
    data.qfrc_applied[dof] = push
    model.opt.timestep = 0.002
    mujoco.mj_step(model, data, nstep=50_000)
    assert abs(data.qvel).max() < 1e-6
    assert abs(data.qfrc_constraint[dof]) > 2
    found = mm.Langevin(model, kT=0).forces(data)
    np.testing.assert_allclose(found, 0, atol=2e-7)  # 9e-9


@pytest.mark.parametrize("splitting", ["baoab", "obabo", "middle", "verlet", "o-rk4-o", "o-step-o"])
def test_heat_and_work_add_up_to_the_kinetic_energy(splitting):
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=0.5, splitting=splitting, disable=CONTACT)
    data = state(model, 2)

    def energy():
        return data.qvel @ inertia(model, at(model, data)) @ data.qvel / 2

    before = energy()
    exchanged = langevin.step(data, 2000)
    change = energy() - before
    assert abs(change) > 0.1
    found = exchanged["kT"] + exchanged["work"]
    assert found == pytest.approx(change, abs=3e-10)  # 1.6e-11, by rounding of 2000 J


def end(data: mujoco.MjData) -> np.ndarray:
    return np.concatenate([[data.time], data.qpos, data.qvel])


@BRIEF
@pytest.mark.parametrize("splitting", ["baoab", "obabo", "o-step-o"])
def test_neither_calls_nor_threads_nor_records_change_a_bit(splitting, monkeypatch):
    model = mujoco.MjModel.from_xml_string(SOFT["connect"])
    langevin = mm.Langevin(model, kT=0.5, splitting=splitting, disable=CONTACT, seed=4)
    whole = mujoco.MjData(model)
    langevin.step(whole, 300)
    for pieces in ((1, 2, 297), (100, 200)):
        data = mujoco.MjData(model)
        for steps in pieces:
            langevin.step(data, steps)
        np.testing.assert_array_equal(end(data), end(whole))
    runs = [
        langevin.sample(
            300 * langevin.timestep,
            replicas=3,
            record_interval=every,
            burn_in=settle * langevin.timestep,
        )
        for every, settle in ((1, 0), (10, 0), (7, 0))
    ]
    np.testing.assert_array_equal(runs[0].qpos[0, -1], whole.qpos)
    np.testing.assert_array_equal(runs[1].qpos, runs[0].qpos[:, 9::10])
    np.testing.assert_array_equal(runs[2].qvel, runs[0].qvel[:, 6::7])
    settled = langevin.sample(200 * langevin.timestep, replicas=3, burn_in=100 * langevin.timestep)
    np.testing.assert_array_equal(settled.qpos, runs[0].qpos[:, 100:])
    start = np.tile(np.concatenate([[0.0], model.qpos0, np.zeros(model.nv)]), (3, 1))
    for threads in (1, 2):
        used = [mujoco.MjData(model) for _ in range(threads)]
        paths = langevin.rollout(used, start, None, control_spec=0, nstep=300)
        np.testing.assert_array_equal(paths[..., : model.nq], runs[0].qpos)
    for first, seconds in ((1, 0.0), (5, 1e9)):  # one step a call, or five and then all others
        monkeypatch.setattr(loop_calls, "FIRST_STEPS", first)
        monkeypatch.setattr(loop_calls, "SECONDS_BETWEEN_CHECKS", seconds)
        data = mujoco.MjData(model)
        langevin.step(data, 300)
        np.testing.assert_array_equal(end(data), end(whole))
        assert langevin.sample(300 * langevin.timestep, replicas=3, record_interval=7).identical(
            runs[2]
        )
        np.testing.assert_array_equal(
            langevin.rollout(used, start, None, control_spec=0, nstep=300), paths
        )
    for one, other in itertools.combinations(runs[0].qpos[:, -1].values, 2):
        assert abs(one - other).max() > 1e-3


@BRIEF
def test_records_add_up_heat_and_work():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=0.5, disable=CONTACT)
    run = langevin.sample(400 * langevin.timestep, replicas=2, record_interval=10)
    data = mujoco.MjData(model)
    first, second = langevin.step(data, 150), langevin.step(data, 250)
    for name, sums in (("kT", run.heat[0, :, 0]), ("work", run.work[0])):
        assert float(sums[14]) == pytest.approx(first[name], rel=1e-12)
        assert float(sums[-1]) == pytest.approx(first[name] + second[name], rel=1e-12)


def test_a_slide_follows_the_brownian_path_of_the_package():
    """Without inertia to speak of, its velocity is that of the path: c v = sqrt(2 kT c) dW/dt."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.5" gravity="0 0 0"/><worldbody><body>'
        '<joint type="slide" axis="1 0 0" damping="2"/><geom size="0.1" mass="1"/>'
        "</body></worldbody></mujoco>"
    )
    fine = noise.BrownianPath(6, 0.25)
    for path in (noise.BrownianPath(6, 0.5), fine.coarsened(2)):
        data = mujoco.MjData(model)
        langevin = mm.Langevin(model, kT=0.3, splitting="middle", path=path)
        for rise in path.increments(5):
            velocity = data.qvel[0]
            langevin.step(data)
            # (m + h c/2) v' = (m - h c/2) v + sqrt(2 kT c) dW
            expected = ((1 - 0.5) * velocity + np.sqrt(1.2) * rise) / (1 + 0.5)
            assert data.qvel[0] == pytest.approx(expected, rel=1e-13)


def test_many_contacts_of_one_body_are_stable():
    """Each alone would suit the timestep, but all of them together would not."""
    spheres = "".join(
        f'<geom size="0.1" pos="{i} 0 0" condim="1" mass="0.025"/>' for i in range(40)
    )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.01"/><worldbody><geom type="plane" size="1 1 1" condim="1"/>'
        f'<body pos="0 0 0.1"><joint type="slide" damping="1"/>{spheres}</body></worldbody>'
        "</mujoco>"
    )
    with pytest.warns(UserWarning, match="softened"):
        langevin = mm.Langevin(model, kT=1e-3)
    run = langevin.sample(
        2000 * langevin.timestep,
        replicas=16,
        record_interval=20,
        burn_in=500 * langevin.timestep,
    )
    found = mm.kinetic_temperature(model, run)
    # (omega h)^2/4 = 0.19 and 5 standard errors of 16 replicas, 0.035 each.
    assert abs(float(found.total) - 1e-3) < 0.37e-3  # 0.29e-3


def test_a_langevin_can_be_copied():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=0.5, disable=CONTACT, seed=4)
    ends = []
    for one in (langevin, pickle.loads(pickle.dumps(langevin)), copy.copy(langevin)):
        data = mujoco.MjData(one.model)
        one.step(data, 100)
        ends.append(end(data))
    np.testing.assert_array_equal(ends[1], ends[0])
    np.testing.assert_array_equal(ends[2], ends[0])


def test_the_check_wants_the_model_that_was_integrated():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    data = mujoco.MjData(model)
    data.qfrc_applied[3] = 1.0
    langevin = mm.Langevin(model, kT=0.5, friction=5.0, disable=("contact", "limit"))
    run = langevin.sample(
        8000 * langevin.timestep,
        replicas=16,
        record_interval=80,
        burn_in=1000 * langevin.timestep,
        initial=data,
    )
    with refused("model"):
        mm.configurational_temperature(model, run)
    found = mm.configurational_temperature(langevin.effective_model, run)
    # 16 replicas: false alarm rate 2e-4.
    assert abs(float(found.temperature) - 0.5) < 5 * float(found.error)  # 1.0
    other = mm.configurational_temperature(langevin.effective_model, run.drop_vars("qfrc_applied"))
    assert abs(float(other.temperature) - 0.5) > 5 * float(other.error)  # 21


@BRIEF
@pytest.mark.parametrize("call", ["sample", "rollout"])
def test_ctrl_c_ends_all_threads(call):
    """Also if there is no record for a long time; measured: 0.1 s after it, instead of minutes.

    A short run compiles first: the compiler does not hear Ctrl-C for seconds.
    """
    langevin = mm.Langevin(mujoco.MjModel.from_xml_string(SOFT["limit"]), kT=0.5, disable=CONTACT)
    model = langevin.model
    used, start = mujoco.MjData(model), np.zeros((2, 1 + model.nq + model.nv))
    langevin.step(used)
    calls: dict[str, Any] = {
        "sample": lambda nstep: langevin.sample(
            nstep * langevin.timestep, record_interval=nstep, replicas=99
        ),
        "rollout": lambda nstep: langevin.rollout(
            [used], start, None, control_spec=0, nstep=min(nstep, 5_000_000)
        ),
    }
    calls[call](1)
    ctrl_c = threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT])
    begin = time.monotonic()
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        calls[call](10**9)
    assert time.monotonic() - begin < 3
    ctrl_c.join()


def test_no_body_sleeps_in_the_steps_of_mujoco():
    """A free box at 1 pJ; asleep it would be at 1 % of kT.

    5 standard errors of 16 batches are 3 % (false alarm rate 2e-4).
    """
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"><flag sleep="enable"/></option><worldbody>'
        '<body><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>'
    )
    langevin = mm.Langevin(model, 1e-12, splitting="o-step-o", friction=20.0)
    run = langevin.sample(
        20_000 * langevin.timestep,
        replicas=8,
        record_interval=10,
        burn_in=1000 * langevin.timestep,
    )
    found = mm.kinetic_temperature(model, run)
    assert abs(float(found.total) - 1e-12) < 5 * float(found.total_error)  # 0.8
    assert float(found.total_error) < 0.02e-12  # 0.0063e-12


def test_a_lost_replica_is_reported_with_all_records():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.05"/><worldbody><body>'
        '<joint name="j" type="slide" axis="1 0 0" damping="0.1" stiffness="1650"/>'
        '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    langevin = mm.Langevin(model, kT=1)
    assert langevin.largest_timestep(mujoco.MjData(model)) < 0.05
    with pytest.raises(mm.LangevinDiverged) as caught:
        langevin.sample(10_000 * langevin.timestep, replicas=3, record_interval=10)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    run = caught.value.dataset
    lost = np.isnan(run.qpos[0, :, 0].values)
    assert run.qpos.shape == (3, 1000, 1)
    assert not lost[0]
    assert lost[-1]
    with pytest.raises(FloatingPointError):
        langevin.step(mujoco.MjData(model), 10_000)


@pytest.mark.parametrize(
    "method", [partial(mm.Langevin, kT=1.0, friction=1e-9), mm.Langevin], ids=["langevin", "baoab"]
)
def test_a_speed_of_which_mujoco_warns_is_lost(method):
    """It is 1e10; two joints are below it although their sum is not."""
    joint = '<joint type="slide" axis="{}" damping="1e-9"/>'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody><body>{joint.format("1 0 0")}'
        f'{joint.format("0 1 0")}<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    stepper, data = method(model), mujoco.MjData(model)
    data.qvel[:] = 9.9e9, -9.9e9
    stepper.step(data, 3)
    data.qvel[1] = -1.01e10
    start = np.array([[0.0, *data.qpos, *data.qvel]])
    with pytest.raises(FloatingPointError):
        stepper.step(data, 3)
    assert data.time == pytest.approx(0.008)
    path = stepper.rollout([mujoco.MjData(model)], start, None, control_spec=0, nstep=3)
    assert np.isnan(path).all()


def test_constraints_that_are_too_stiff_for_the_timestep_are_softened(monkeypatch):
    """At 20 ms the limit would be unstable; it is softened to an oscillation of 0.5 / h.

    However its stiffness is declared, the forces are the same; 16 000 records of one, 16 replicas.
    4 standard errors of the mean position are exceeded in 1e-3 of seeds.
    """
    found = []
    for solref in ("0.02 1", "-2500 -100"):
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="0.02"/><worldbody><body><joint type="slide" axis="1 0 0"'
            f' range="-0.1 0" damping="0.5" solreflimit="{solref}" solimplimit="0.95 0.95 0.001"/>'
            '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
        )
        data = mujoco.MjData(model)
        with pytest.warns(UserWarning, match="softened"):
            langevin = mm.Langevin(model, kT=0.3)
        for data.qpos[0] in (-0.2, -0.11, -0.05, 0.001, 0.1, 0.01):
            found.append(langevin.forces(data)[0])
    assert found[:6] == found[6:]
    stiffness = -found[-1] / 0.01
    assert stiffness * 0.02**2 == pytest.approx(0.25, rel=1e-6)  # at rest; the mass is 1
    assert langevin.largest_timestep(data) == pytest.approx(0.08, rel=1e-4)  # 2/omega
    run = langevin.sample(
        10_000 * langevin.timestep,
        replicas=16,
        record_interval=10,
        burn_in=1000 * langevin.timestep,
    )
    found = mm.kinetic_temperature(model, run)
    truth = mm.metropolis(langevin.effective_model, 0.3, samples=800, replicas=8, record_interval=5)
    # The velocity's own error is of second order in h; the standard error is 1.3 %.
    assert float(found.total) == pytest.approx(0.3, rel=0.06)  # 0.024
    means = [one.qpos.values.mean(axis=(1, 2)) for one in (run, truth)]
    errors = [each.std(ddof=1) / np.sqrt(len(each)) for each in means]
    difference = means[0].mean() - means[1].mean()
    assert abs(difference) < 4 * np.hypot(*errors)  # 1.6
    model.opt.timestep = 0.002
    mm.Langevin(model, kT=0.3)  # without a warning
    model.opt.timestep = 0.02
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    stiff = mm.Langevin(model, kT=0.3)
    assert stiff.largest_timestep(data) < 0.02
    times = []
    for seconds in (0.1, 1e-9):
        data.time, data.qpos[0], data.qvel[0] = 0.0, -0.05, 0.0
        monkeypatch.setattr(loop_calls, "SECONDS_BETWEEN_CHECKS", seconds)
        with pytest.raises(FloatingPointError):
            stiff.step(data, 1_000_000)
        times.append(data.time)
    assert times[0] == times[1]
    assert abs(data.qpos[0]) < 1  # 0.06: it is the stiffness that was noticed, not an overflow


@pytest.mark.parametrize(("product", "stable"), [(1.99, True), (2.01, False)])
def test_a_limit_of_angular_frequency_two_over_h_is_too_stiff(product, stable):
    """MuJoCo's limit of impedance 1/2 and stiffness k on a unit mass has omega^2 = 2 k."""
    stiffness = (product / 0.02) ** 2 / 2
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.02" gravity="0 0 0"><flag refsafe="disable"/></option>'
        '<worldbody><body><joint type="slide" range="-1 0" damping="0.5" solimplimit="0.5 0.5 1"'
        f' solreflimit="-{stiffness} -1"/><geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = 0.01, 2.0  # it stays beyond the limit for a step
    langevin = mm.Langevin(model, kT=1e-6)
    limit = 0.02 * 2 / product
    assert langevin.largest_timestep(data) == pytest.approx(limit, rel=1e-3)
    if stable:
        langevin.step(data, 1)
    else:
        with pytest.raises(FloatingPointError):
            langevin.step(data, 1)


COLD = """
<mujoco>
  <option gravity="0 0 0" timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="free" type="free" damping="2e-6"/>
      <inertial pos="0 0 0" mass="0.05" diaginertia="1e-6 2.5e-6 3.2e-6"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_records_that_remember_their_start_are_warned_of():
    """Translation relaxes at 4e-5 per s, so that only rotation is warm after 40 s.

    Of 32 replicas; the seed is fixed, and 5 standard errors are 0.06 (one in 47 000 seeds).
    """
    langevin = mm.Langevin(mujoco.MjModel.from_xml_string(COLD), kT=1e-3, seed=5)
    with pytest.warns(UserWarning, match="burn_in"):
        run = langevin.sample(
            4000 * langevin.timestep,
            replicas=32,
            record_interval=10,
            burn_in=4000 * langevin.timestep,
        )
    found = mm.kinetic_temperature(langevin.model, run)
    assert abs(float(found.total) - 0.501e-3) < 5 * float(found.total_error)  # 2.3
    assert float(found.total_error) < 0.016e-3  # 0.012e-3


def test_friction_too_strong_for_part_o_warms_after_the_steps_it_is_said_to_take():
    """By v' = -v (1 - 4/x), with x = 2000 the friction rate times the timestep.

    Of 400 replicas; 5 standard errors are a quarter, and 0.35 for one record (one in 2e6 seeds).
    """
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><body>'
        '<joint name="j" type="slide" damping="1e6"/><geom size="0.1" mass="1"/></body>'
        "</worldbody></mujoco>"
    )
    langevin = mm.Langevin(model, kT=1.0, seed=1)
    with pytest.warns(UserWarning, match="burn_in") as caught:
        run = langevin.sample(200 * langevin.timestep, replicas=400)
    cold = 1 - (1 - math.exp(-0.8)) / 0.8
    assert float((run.qvel**2).mean()) == pytest.approx(cold, rel=0.25)  # 0.04 of 0.31
    steps = float(re.findall(r"\((\S+) steps\)", str(caught[0].message))[0])
    assert steps == pytest.approx(math.log(100) / 0.004, rel=0.05)
    run = langevin.sample(
        1 * langevin.timestep,
        replicas=400,
        burn_in=int(steps) * langevin.timestep,
    )
    assert float((run.qvel**2).mean()) == pytest.approx(1.0, rel=0.35)  # 0.064


SPRING = """
<mujoco>
  <option timestep="0.05" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="j" type="slide" stiffness="{}" damping="{}"/><geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_positions_that_friction_slows_down_relax_after_the_steps_they_are_said_to_take():
    """By <q^2> = 1 - exp(-2 k t/c), k = 1 N/m and c = 20 kg/s, while the velocity relaxes in 0.1 s.

    Of 400 replicas; 5 standard errors are 0.10, 0.05 for velocities, and 0.36 for one record (one
    in 2e6 seeds each). Positions that were warm at once would be off by 0.63.
    """
    langevin = mm.Langevin(mujoco.MjModel.from_xml_string(SPRING.format(1, 20)), kT=1.0, seed=1)
    with pytest.warns(UserWarning, match="burn_in") as caught:
        run = langevin.sample(200 * langevin.timestep, replicas=400, record_interval=4)
    missing = (1 - math.exp(-1)) / 1
    assert float((run.qpos**2).mean()) == pytest.approx(1 - missing, abs=0.10)  # 0.0068
    assert float((run.qvel**2).mean()) == pytest.approx(1.0, abs=0.05)  # 0.010
    steps = float(re.findall(r"\((\S+) steps\)", str(caught[0].message))[0])
    assert steps == pytest.approx(math.log(100) / 0.005, rel=0.05)
    run = langevin.sample(
        1 * langevin.timestep,
        replicas=400,
        burn_in=int(steps) * langevin.timestep,
    )
    assert float((run.qpos**2).mean()) == pytest.approx(1.0, abs=0.36)  # 0.12


def test_a_start_hotter_than_the_sample_must_be_forgotten_to_fractions_of_kt():
    """Of 400 replicas; <v^2> over kT is known to 3 %, so that one in 7000 seeds is off by 12 %."""
    langevin = mm.Langevin(mujoco.MjModel.from_xml_string(SPRING.format(0, 1)), kT=1e-4, seed=1)
    hot = mujoco.MjData(langevin.model)
    hot.qvel[:] = 1.0
    settle = 50  # leaves e^-5 of an energy of 1e4 kT/2
    with pytest.warns(UserWarning, match="burn_in") as caught:
        langevin.sample(
            100 * langevin.timestep,
            replicas=400,
            record_interval=10,
            burn_in=settle * langevin.timestep,
            initial=hot,
        )
    steps = float(re.findall(r"\((\S+) steps\)", str(caught[0].message))[0])
    assert steps == pytest.approx(math.log(1e6) / 0.1, rel=0.05)
    run = langevin.sample(
        100 * langevin.timestep,
        replicas=400,
        record_interval=10,
        burn_in=int(steps) * langevin.timestep,
        initial=hot,
    )
    assert float((run.qvel**2).mean()) == pytest.approx(1e-4, rel=0.12)  # 0.011


@pytest.mark.parametrize(("stiffness", "damping", "rate"), [
    (0, 0.5, 1.0),  # a free velocity
    (1, 20, 0.1003),  # an overdamped position
    (100, 0.5, 0.5),  # an oscillation, with halves of its energy
], ids=["velocity", "position", "oscillation"])  # fmt: skip
@pytest.mark.parametrize(("replicas", "left"), [(1000, 0.01), (100, 0.04), (1, 0.1)])
def test_what_is_missing_is_tolerated_up_to_one_percent_or_an_error(
    stiffness, damping, rate, replicas, left
):
    """Parts p = 1/(rate t) of runs of time t, 20 % above and below 1 %, 4/replicas = 4 %, and 10 %.

    Their standard error is sqrt(4 p/replicas), since rate t/2 energies of a run are independent.
    """
    model = mujoco.MjModel.from_xml_string(SPRING.format(stiffness, damping))
    langevin, data = mm.Langevin(model, kT=1.0), mujoco.MjData(model)
    for part, warns in ((1.2 * left, True), (0.8 * left, False)):
        found = unsettled(
            model, data, model_friction(model), langevin._scheme, langevin.forces,
            1.0, Sampling(0, 1, round(1 / part / rate / 0.05), replicas),
        )  # fmt: skip
        assert re.match(r"^joint 'j': .* % of the energy", found) if warns else not found


@pytest.mark.parametrize(("stiffness", "start"), [(0, 0), (-1, 0), (1, 1.5), (1, np.pi)])
def test_of_positions_without_an_equilibrium_nearby_nothing_is_said(stiffness, start):
    """Free, repelled, and a pendulum far from where it hangs, whose velocities relax in 0.2 s."""
    joint = 'type="slide" stiffness="{}"' if start == 0 else 'axis="0 1 0" stiffness="0"'
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="0.05" gravity="0 0 {-9.81 * bool(start)}"/>
      <worldbody><body>
        <joint {joint.format(stiffness)} damping="20"/><geom pos="0 0 -0.5" size="0.1" mass="1"/>
      </body></worldbody>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[:] = start
    mm.Langevin(model, kT=0.01).sample(
        10 * model.opt.timestep, burn_in=20 * model.opt.timestep, initial=data
    )
    if start:
        with pytest.warns(UserWarning, match="burn_in"):
            mm.Langevin(model, kT=0.01).sample(
                10 * model.opt.timestep, burn_in=20 * model.opt.timestep
            )


def test_of_positions_nothing_is_said_while_another_one_is_driven_away():
    """The second slide relaxes slowly, but what matters is how the first one falls."""
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <option timestep="0.05" gravity="0 0 0"><flag contact="disable"/></option>
      <worldbody>
        <body><joint type="slide" stiffness="-1" damping="20"/><geom size="0.1" mass="1"/></body>
        <body><joint type="slide" stiffness="1" damping="20"/><geom size="0.1" mass="1"/></body>
      </worldbody>
    </mujoco>""")
    langevin, data = mm.Langevin(model, kT=1.0), mujoco.MjData(model)
    data.qpos[0] = 1.1
    langevin.sample(10 * langevin.timestep, burn_in=20 * langevin.timestep, initial=data)
    data.qpos[0] = 0.9
    with pytest.warns(UserWarning, match="joint 1"):
        langevin.sample(10 * langevin.timestep, burn_in=20 * langevin.timestep, initial=data)


@pytest.mark.parametrize(("count", "said"), [(50, "joint 'j0': .* 99.9 % .* at 0.01 "), (51, "")])
def test_friction_that_joins_velocities_is_seen_of_at_most_500(count, said, monkeypatch):
    """Two of the velocities relax together at 0.01 per s, although each alone does at 500 per s.

    Here of at most 50, which takes a thousandth of the time.
    """
    assert relaxation.LARGEST_MATRIX == 500
    monkeypatch.setattr(relaxation, "LARGEST_MATRIX", 50)
    slides = "".join(
        f'<body pos="{k} 0 0"><joint name="j{k}" type="slide"/>'
        '<geom size="0.1" mass="1" contype="0"/></body>'
        for k in range(count)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody>{slides}</worldbody></mujoco>'
    )
    friction = np.diag(np.full(count, 500.0))
    friction[0, 1] = friction[1, 0] = -499.99
    langevin = mm.Langevin(model, kT=1.0, friction=friction, splitting="o-step-o")
    found = unsettled(
        model, mujoco.MjData(model), read_friction(model, friction), langevin._scheme, None, 1.0,
        Sampling(10, 1, 10, 1),
    )  # fmt: skip
    assert re.match(said, found)
    assert said or not found


@pytest.mark.parametrize(("gravity", "said"), [
    ("0 0 -9.81", ""), ("0 0 0", "joint 'two': .* nothing damps it there: give a rate"),
])  # fmt: skip
def test_forces_that_couple_what_is_not_damped_let_it_relax(gravity, said):
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="{gravity}"><flag contact="disable"/></option>
      <worldbody>
        <body>
          <joint axis="0 1 0" damping="1"/><geom type="capsule" fromto="0 0 0 0 0 -1" size=".05"/>
          <body pos="0 0 -1">
            <joint name="two" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0 0 -1" size=".05"/>
          </body>
        </body>
      </worldbody>
    </mujoco>""")
    langevin = mm.Langevin(model, kT=1.0)
    found = unsettled(
        model, mujoco.MjData(model), model_friction(model), langevin._scheme, langevin.forces,
        1.0, Sampling(0, 1, 2_000_000, 1),
    )  # fmt: skip
    assert re.match(said, found)
    assert said or not found


SLIDE = """
<mujoco>
  <option timestep="0.5" gravity="0 0 0"/>
  <worldbody>
    <body><joint type="slide" stiffness="{}"/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(("stiffness", "friction"), [(0, 4.0), (400, 1e-6)])
@pytest.mark.parametrize("splitting", ["baoab", "middle"])
def test_motion_that_forgets_in_one_step_or_is_unstable_is_not_warned_of(
    stiffness, friction, splitting
):
    """Part O multiplies velocities by 0 at a friction of 2/h; the frequency is far above 2/h."""
    model = mujoco.MjModel.from_xml_string(SLIDE.format(stiffness))
    mm.Langevin(model, kT=1.0, friction=friction, splitting=splitting).sample(
        2 * model.opt.timestep
    )


def test_the_model_of_the_user_stays_as_it_is():
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    before = np.concatenate([model.dof_damping, model.actuator_biasprm.ravel(), model.opt.gravity])
    flags, counts = model.opt.disableflags, (model.ngeom, model.nsite, model.nplugin)
    mm.Langevin(model, kT=1, disable=CONTACT).step(mujoco.MjData(model), 5)
    after = np.concatenate([model.dof_damping, model.actuator_biasprm.ravel(), model.opt.gravity])
    np.testing.assert_array_equal(after, before)
    assert flags == model.opt.disableflags
    assert counts == (model.ngeom, model.nsite, model.nplugin)
