"""A short tour of what depends on MuJoCo's version, run on the oldest and the newest."""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.common.environment import data_folder
from magmotor.mjcf import layout
from trials.numpy_twin import apply_magnetism

MAJOR = int(mujoco.__version__.split(".")[0])
LEAST_RK4_ORDER = 4 if MAJOR >= 4 else 2


def test_struct_layout():
    layout.verify(layout.current())


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_callback_agrees_with_its_twin(surface):
    model = mm.build(mm.Top(surface=surface))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=10)
        mujoco.mj_forward(model, data)
    compiled = data.xfrc_applied.copy()
    apply_magnetism(model, data)
    assert np.abs(compiled - data.xfrc_applied).max() <= 1e-14 * np.abs(compiled).max()  # 9e-16


def test_momentum_map_is_constant_without_friction():
    run = mm.simulate(mm.Top.paper(2), method="mujoco/euler", timestep=0.025, duration=500)
    assert np.abs(run.momentum_map).max() <= 1e-17  # measured: 6.4e-19 (3.17), 3.1e-19 (4.0)


def test_case_4_converges_to_dop853(case4_truth):
    steps, errors = (8, 12, 16, 24, 32), []
    for n in steps:
        run = mm.simulate(
            mm.Top.paper(4), method="mujoco/rk4", timestep=0.1 / n, duration=20, record_interval=n
        )
        errors.append(np.abs(run.position.values - case4_truth.position.values[:201]).max())
    order = np.polyfit(np.log(1 / np.array(steps)), np.log(errors), 1)[0]
    assert order > LEAST_RK4_ORDER - 0.15  # 2.00 (3.17), 3.95 (4.0)


def test_plane_follows_planar():
    planar, plane = (
        mm.simulate(mm.Top(surface=s), method="mujoco/rk4", timestep=0.0125, duration=20)
        for s in ("planar", "plane")
    )
    assert np.abs(plane.position - planar.position).max() < 1e-5  # 1.5e-6


def test_the_decorated_model_moves_like_the_plain_one():
    states = []
    for visual in (False, True):
        model = mm.build(mm.Top(), visual=visual)
        model.opt.timestep = 0.01
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=500)
        states.append(data.qpos.copy())
    np.testing.assert_allclose(states[0], states[1], rtol=0, atol=4e-16)  # 1.4e-17


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_the_disk_follows_the_variational_engine(surface):
    run, twin = (
        mm.simulate(scene, method=method, timestep=0.01, duration=10, seed=1, replicas=2)
        for scene, method in (
            (mm.Disk(surface=surface), "mujoco/euler"),
            (mm.Disk(), "variational/euler"),
        )
    )
    bound = 5e-14 if surface == "planar" else 3e-12  # 3e-15; plane 1.4e-13 (both)
    assert abs(run.x - twin.x).max() < bound * abs(twin.x).max()


def test_noise_is_constant_over_the_stages_of_rk4():
    model = mm.build(mm.Disk(potential="flat"))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 0.01
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=1000)
    rises = mm.noise.BrownianPath(0, 0.01).increments(1000)
    np.testing.assert_allclose(data.qvel, rises.sum() * np.array([5, 10]), rtol=3e-14)  # 2.5e-15


@pytest.mark.skipif(MAJOR >= 4, reason="dm_control's Physics does not support MuJoCo 4")
def test_the_plugin_acts_in_dm_control():
    """Its Physics steps the same model to the same bits."""
    from dm_control import mujoco as control

    path = str(data_folder("models") / "top_magnetic.xml")
    physics = control.Physics.from_xml_path(path)
    for _ in range(500):
        physics.step()
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=500)
    assert abs(data.qpos[0] - model.qpos0[0]) > 1e-4
    np.testing.assert_array_equal(physics.data.qpos, data.qpos)
