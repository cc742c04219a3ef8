"""The motor in MuJoCo: model, forces, friction, noise, heat and work."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor import noise
from magmotor.devices.motor.energy import motor_energy
from magmotor.devices.motor.mjcf import MotorCoordinates
from magmotor.devices.motor.states import start_motor
from magmotor.run.in_mujoco import compose

QUIET: dict[str, Any] = {"temperature": "nonuniform", "alpha_ring": 0.0, "friction_ball": 0.0}
"""No friction and no noise."""

WEAK: dict[str, Any] = {"coupling": 1e-30, "axis": (0.0, 0.0, 1.0), "spin": 100.0}
"""Negligible magnetism, and a spin without slip."""

EULER: dict[str, Any] = {"method": "mujoco/euler", "timestep": 0.025}


def test_the_model_is_the_scene():
    scene = mm.Motor()
    model = mm.build(scene)
    assert [model.body(i).name for i in range(4)] == ["world", "ball", "inner_ring", "outer_ring"]
    assert (model.nq, model.nv, model.njnt) == (10, 8, 4)
    np.testing.assert_allclose(model.body_inertia[1], 0.4 * 0.5 * 0.04**2, rtol=1e-15)  # 0
    np.testing.assert_allclose(model.body_inertia[2], [1.6875, 1.6875, 3.375], rtol=1e-15)  # 0
    np.testing.assert_array_equal(model.body_ipos[:3], 0)
    np.testing.assert_array_equal(model.body_pos[:, 2], [0, 0.04, 0.48, 0.48])
    np.testing.assert_array_equal(model.dof_damping, [0] * 5 + [0.15] * 3)
    assert not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER
    assert np.bincount(model.site_bodyid).tolist() == [0, 1, 20, 5]
    np.testing.assert_array_equal(model.site_user[:, 0], scene.moment)
    assert model.nuserdata == 5
    assert model.tuple("coupling_ball_inner_ring").objid.tolist() == [1, 2]
    np.testing.assert_array_equal(model.tuple("coupling_ball_inner_ring").objprm, 2)


@pytest.mark.parametrize("visual", [False, True])
def test_a_scene_does_not_affect_the_next(visual):
    """Although their MJCF is read only once."""
    before = compose(mm.Motor(), visual=visual).to_xml_string()
    compose(mm.Motor(ball_radius=0.03, inner_dipoles=7, coupling=1e-5), visual=visual)
    assert compose(mm.Motor(), visual=visual).to_xml_string() == before


@pytest.mark.parametrize("visual", [False, True])
def test_damping_is_explicit(visual):
    model = mm.build(mm.Motor(), visual=visual)
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP


def test_wrenches_are_those_of_the_slip_and_of_the_ring():
    rows = mm.build(mm.Motor(alpha_ball=2e-3, friction_ball=0.6)).body_user.reshape(4, 3, 6)
    r = 0.04
    ball = 2e-3 * np.array([[1, 0, 0, 0, -r, 0], [0, 1, 0, r, 0, 0], [0] * 6])
    np.testing.assert_allclose(rows[1], ball, rtol=1e-15)  # 0
    np.testing.assert_array_equal(rows[2], 1e-3 * np.eye(3, 6, 3))
    assert not rows[[0, 3]].any()


def test_absent_features_are_disabled():
    model = mm.build(mm.Motor(temperature="nonuniform", ball_ring_factor=1.0))
    assert not model.body_user[1].any()
    assert model.ntuple == 0
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER
    assert mm.build(mm.Motor(**QUIET)).nuser_body == 0
    assert mm.build(mm.Motor(**QUIET)).opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT


def posed(scene, **parts):
    """Return model and data in the initial state of a scene, with some parts replaced."""
    model = mm.build(scene)
    data = mujoco.MjData(model)
    state = start_motor(scene)
    state = state._replace(**{k: np.reshape(v, (1, 1, -1)) for k, v in parts.items()})
    qpos, qvel = MotorCoordinates(scene).joints(state)
    data.qpos[:], data.qvel[:] = qpos[0], qvel[0]
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return model, data


TILTED = Rotation.from_rotvec([0.15, -0.1, 0.7]).as_quat(scalar_first=True)
ROTATED = Rotation.from_rotvec([0.4, 0.8, -0.5]).as_quat(scalar_first=True)


@pytest.mark.parametrize("surface", ["planar", "plane"])
@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_forces_are_the_gradient_of_the_energy(factor, surface):
    scene = mm.Motor(**QUIET, ball_ring_factor=factor, surface=surface)
    model, data = posed(
        scene, position=[0.5, 0.3, 0.04], orientation=ROTATED, ring_orientation=TILTED
    )
    coordinates = MotorCoordinates(scene)

    def energy(direction, distance):
        qpos = data.qpos.copy()
        mujoco.mj_integratePos(model, qpos, direction, distance)
        rest, no_sums = np.zeros((1, 1, model.nv)), np.zeros((1, 1, 4))
        states = coordinates.states(np.zeros(1), qpos[np.newaxis, np.newaxis], rest, no_sums)
        return motor_energy(scene, states).total[0, 0]

    step = 1e-5
    directions = np.eye(model.nv)
    rise = [(energy(d, step) - energy(d, -step)) / (2 * step) for d in directions]
    scale = np.abs(data.qfrc_smooth[-3:]).max()
    assert np.abs(data.qfrc_smooth + rise).max() < 1e-7 * scale  # 5e-9


def test_without_friction_and_noise_energy_is_conserved():
    scene = mm.Motor(**QUIET, position=(0.5, 0.1), axis=(0.3, 0.2, 0.9), spin=3.0)
    errors = []
    for timestep in (0.02, 0.01):
        run = mm.simulate(scene, method="mujoco/rk4", timestep=timestep, duration=60)
        gain = np.abs(run.energy - run.energy[0]).max()
        errors.append(float(gain / np.ptp(run.energy.values - run.ring_energy.values)))
        np.testing.assert_array_equal(run.heat, 0)
        np.testing.assert_array_equal(run.work, 0)
    assert errors[1] < 1e-6  # 4.8e-8
    assert errors[0] > 12 * errors[1]  # 32: the energy's error is of fifth order


def test_friction_is_minus_c_times_slip():
    scene = mm.Motor(coupling=1e-30)
    _, data = posed(
        scene, velocity=[0.02, -0.05, 0], angular_velocity=[0.3, -0.7, 2.0], orientation=ROTATED
    )
    slip = np.array([0.02 + 0.04 * 0.7, -0.05 + 0.04 * 0.3, 0])
    np.testing.assert_allclose(data.qfrc_constraint[:2], -0.15 * slip[:2], rtol=5e-12)  # 2.5e-13
    rotation = data.xmat[1].reshape(3, 3)
    torque = np.cross([0, 0, -0.04], -0.15 * slip)
    np.testing.assert_allclose(
        rotation @ data.qfrc_constraint[2:5], torque, rtol=0, atol=1e-15
    )  # 5.8e-17
    assert not data.qfrc_constraint[5:].any()


def test_the_rings_friction_is_minus_c_times_spin():
    spin = np.array([0.2, -0.3, 0.5])
    model, data = posed(
        mm.Motor(friction_ring=0.3, friction_ball=0.3),
        ring_angular_velocity=spin,
        ring_orientation=TILTED,
    )
    rotation = data.xmat[model.body("inner_ring").id].reshape(3, 3)
    np.testing.assert_allclose(rotation @ data.qfrc_passive[5:], -0.3 * spin, rtol=1e-14)  # 4e-16


@pytest.mark.parametrize("temperature", ["uniform", "nonuniform"])
def test_kicks_from_rest(temperature):
    """V and omega_R after a step are wrench of the noise times increments over inertia."""
    scene = mm.Motor(temperature=temperature, **WEAK)
    path = noise.BrownianPath(7, 0.05)
    replicas = 3
    run = mm.simulate(
        scene, method="mujoco/euler", timestep=0.05, duration=0.05, seed=7, replicas=replicas,
        initial={"ring_orientation": TILTED},
    ).isel(time=1)  # fmt: skip
    driven = np.flatnonzero(scene.noises)
    for replica in range(replicas):
        kicks = np.zeros(5)
        for channel, k in enumerate(driven):
            rise = path.increments(1, replica=replica, channel=channel)
            kicks[k] = scene.noises[k] * rise[0]
        force = np.array([*kicks[:2], 0.0])
        np.testing.assert_allclose(
            run.velocity[replica], force / 0.5, rtol=1e-12, atol=1e-20
        )  # 6e-14, 2e-29
        spin = np.cross([0, 0, -0.04], force) / scene.ball_inertia + [0, 0, 100]
        np.testing.assert_allclose(
            run.angular_velocity[replica], spin, rtol=0, atol=1e-14
        )  # 5.6e-16
        rotation = Rotation.from_quat(TILTED, scalar_first=True)
        local = rotation.apply(kicks[2:], inverse=True) / scene.inner_moments
        expected = rotation.apply(local)
        np.testing.assert_allclose(
            run.ring_angular_velocity[replica], expected, rtol=3e-14
        )  # 1.1e-15


def test_rk4_holds_the_noise_over_its_stages():
    """With a constant force in each step, v and x are polynomials in time."""
    scene = mm.Motor(temperature="nonuniform", alpha_ball=1e-3, friction_ball=0.0, **WEAK)
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.1, duration=10, seed=3)
    rises = noise.BrownianPath(3, 0.1).increments(100, channel=1)
    velocity = np.cumsum(1e-3 / 0.5 * rises)
    np.testing.assert_allclose(run.velocity[1:, 1], velocity, rtol=0, atol=5e-16)  # 2e-17
    before = np.concatenate([[0.0], velocity[:-1]])
    position = np.cumsum(0.1 * (before + velocity) / 2)
    np.testing.assert_allclose(run.position[1:, 1], position, rtol=0, atol=5e-16)  # 1.7e-17


@pytest.mark.parametrize("method", ["mujoco/euler", "mujoco/implicitfast"])
@pytest.mark.parametrize("temperature", ["uniform", "nonuniform"])
def test_heat_and_work_use_the_mean_velocity_of_a_step(method, temperature):
    scene = mm.Motor(temperature=temperature)
    path = noise.BrownianPath(5, 0.0125).coarsened(4)
    run = mm.simulate(scene, method=method, timestep=0.05, duration=20, path=path, replicas=2)
    ends = np.concatenate([run.slip_velocity[..., :2], run.ring_angular_velocity], axis=-1)
    mean = (ends[:, 1:] + ends[:, :-1]) / 2
    heat = 0.05 * np.array(scene.frictions) * mean**2
    work = np.zeros_like(mean)
    for channel, k in enumerate(np.flatnonzero(scene.noises)):
        rises = [path.increments(400, replica=i, channel=channel) for i in range(2)]
        work[..., k] = scene.noises[k] * mean[..., k] * rises
    for name, steps in (("heat", heat), ("work", work)):
        whole, ring = np.cumsum(steps.sum(-1), axis=1), np.cumsum(steps[..., 2:].sum(-1), axis=1)
        scale = np.abs(whole).max()
        np.testing.assert_allclose(run[name][:, 1:], whole, rtol=0, atol=2e-14 * scale)  # 2.2e-15
        np.testing.assert_allclose(run[f"ring_{name}"][:, 1:], ring, rtol=0, atol=2e-14 * scale)


VARIABLES = ("position", "velocity", "orientation", "ring_orientation", "ring_angular_velocity",
             "energy", "heat", "work", "ring_work")  # fmt: skip


def difference(scene, path, names):
    """Return the largest relative difference from the variational engine in 40 s."""
    run, reference = (
        mm.simulate(scene, method=m, timestep=path.timestep, duration=40, path=path, replicas=2)
        for m in ("mujoco/euler", "variational/euler")
    )
    every = round(0.1 / path.timestep)
    gap = (run - reference).isel(time=slice(None, None, every))
    return {n: float(abs(gap[n]).max() / abs(reference[n]).max()) for n in names}


@pytest.mark.parametrize("factor", [1.0, 2.0])
@pytest.mark.parametrize("temperature", ["uniform", "nonuniform"])
def test_euler_equals_variational_euler_for_an_isotropic_ring(temperature, factor):
    isotropic: dict[str, Any] = {"inner_inertia": 3.375, "inner_axial_inertia": 3.375}
    scene = mm.Motor(temperature=temperature, ball_ring_factor=factor, **isotropic)
    found = difference(scene, noise.BrownianPath(3, 0.05), VARIABLES)
    for name in VARIABLES:
        # 1.4e-14, 3.2e-12: at two temperatures the slip is tiny
        assert found[name] < {"uniform": 4e-13, "nonuniform": 5e-11}[temperature], name


@pytest.mark.parametrize("temperature", ["uniform", "nonuniform"])
def test_euler_equals_variational_euler_to_first_order_for_other_rings(temperature):
    """The gyroscopic torque is explicit in MuJoCo and implicit in the variational step."""
    scene, fine = mm.Motor(temperature=temperature), noise.BrownianPath(3, 0.0125)
    small, large = (difference(scene, fine.coarsened(k), VARIABLES) for k in (2, 4))
    for name in VARIABLES:
        assert large[name] < 1e-4, name  # 2.2e-5, the ring's angular velocity
        assert 1.9 < large[name] / small[name] < 2.1, name


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_the_energy_is_balanced_to_first_order(surface):
    """Along one Brownian path, E - E(0) is the work of the noise minus the heat."""
    scene, fine = mm.Motor(surface=surface), noise.BrownianPath(2, 0.00625)
    factors, errors = (1, 2, 4), []
    for factor in factors:
        path = fine.coarsened(factor)
        run = mm.simulate(
            scene, method="mujoco/euler", timestep=path.timestep, duration=100, path=path
        )
        residual = run.energy - run.energy[0] + run.heat - run.work
        errors.append(float(np.abs(residual).max() / run.work[-1]))
    order = np.polyfit(np.log(factors), np.log(errors), 1)[0]
    assert abs(order - 1) < 0.15  # 0.955, 0.940
    assert errors[0] < 1e-3  # 1.1e-4


def test_replicas_are_single_runs_with_different_paths():
    many = mm.simulate(mm.Motor(), **EULER, duration=30, seed=1, replicas=3)
    one = mm.simulate(mm.Motor(), **EULER, duration=30, seed=1)
    for name in one.data_vars:
        np.testing.assert_array_equal(many[name][0], one[name])
    assert float(abs(many.position[1] - many.position[0]).max()) > 1e-3


def test_records_and_chunks_do_not_change_the_motion():
    every = mm.simulate(mm.Motor(), **EULER, duration=750, seed=1)
    third = mm.simulate(mm.Motor(), **EULER, duration=750, seed=1, record_interval=3)
    for name in every.data_vars:
        np.testing.assert_array_equal(third[name], every[name][::3])


def test_a_run_continues_another():
    whole = mm.simulate(mm.Motor(), **EULER, duration=40, seed=4)
    first = mm.simulate(mm.Motor(), **EULER, duration=15, seed=4)
    rest = mm.simulate(mm.Motor(), **EULER, duration=25, seed=4, initial=first)
    np.testing.assert_allclose(rest.position, whole.position[600:], rtol=0, atol=4e-16)  # 1.6e-17
    work = rest.work + first.work[-1]
    np.testing.assert_allclose(work, whole.work[600:], rtol=0, atol=5e-18)  # 3e-19


def test_the_plane_model_follows_the_planar_one():
    planar, plane = (
        mm.simulate(mm.Motor(surface=s), **EULER, duration=20) for s in ("planar", "plane")
    )
    reach = np.ptp(planar.position.values, axis=0).max()
    assert np.abs(plane.position - planar.position).max() < 3e-5 * reach  # 1.8e-6
    assert np.abs(plane.position[:, 2] - 0.04).max() < 1e-8  # 4.9e-10


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_a_lost_ring_ends_the_run(surface):
    scene = mm.Motor(temperature="nonuniform", alpha_ring=0.02, surface=surface)
    with pytest.raises(mm.PhysicalEvent) as caught:
        mm.simulate(scene, **EULER, duration=2000, seed=1)
    assert caught.value.event == "ring tipped"
    run = caught.value.dataset
    assert (
        1 < caught.value.time == pytest.approx(float(run.time[-1]) + 0.025, rel=1e-15, abs=0)
    )  # 0
    assert float(run.ring_axis[..., 2].min()) > math.cos(math.radians(20))


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_the_exported_motor_moves_in_the_same_way(surface):
    """Its decorated MJCF takes the same steps, with all features of MuJoCo enabled."""
    scene = mm.Motor(surface=surface)
    root = compose(scene, visual=True)
    ends = []
    for model in (
        mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets()),
        mm.build(scene),
    ):
        model.opt.timestep = 0.025
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.userdata[0] = 6
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=400)
        ends.append(np.concatenate([data.qpos, data.qvel]))
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=5e-15)  # 2e-16
