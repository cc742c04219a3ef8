"""The sliding disk in MuJoCo, compared with the variational engine and NumPy."""

import ctypes
from typing import Any

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest
from refusals import misdeclared

import magmotor as mm
from magmotor import noise
from magmotor.device import ENERGY_GREW
from magmotor.run import in_mujoco as mujoco_run
from magmotor.run.in_mujoco import compose
from trials.numpy_twin import apply_magnetism, potential_forces

EULER = ("mujoco/euler", "variational/euler")
PAPER: dict[str, Any] = {"timestep": 0.01, "duration": 50.0}


def apart(run, other, name="x"):
    """Return the largest difference of two runs, relative to the largest value."""
    return float(abs(run[name] - other[name]).max() / abs(other[name]).max())


@pytest.mark.parametrize(
    "scene",
    [
        mm.Disk(),
        mm.Disk(friction_ratio=0.5),
        mm.Disk(potential="asymmetric"),
        mm.Disk(potential="cosine"),
        mm.Disk(potential=((0.3, -0.5), (0.2, 0.4), (0.0, 0.1)), sigma=2.0),
        mm.Disk(surface="plane"),
        mm.Disk(surface="plane", potential="cosine", sigma=2.0),
    ],
)
def test_euler_is_the_variational_euler(scene):
    """Along one noise path; the unstable equilibria of U amplify rounding errors.

    On the plane, the contact takes part A/R of the accelerations, too.
    """
    planar = scene.replace(surface="planar")
    run, twin = (
        mm.simulate(s, method=m, seed=2, replicas=4, **PAPER)
        for s, m in zip((scene, planar), EULER, strict=True)
    )
    assert float(abs(twin.x).max()) > 50
    # Measured: planar 7.3e-13, 4.7e-12, 3.0e-13, 5.9e-13; plane 6.0e-11, 3.8e-10, 9.2e-12, 4.9e-11.
    bounds = {"x": 2e-11, "v": 1e-10, "theta": 8e-12, "omega": 1.5e-11}
    if scene.surface == "plane":
        bounds = {"x": 1e-9, "v": 5e-9, "theta": 2e-10, "omega": 1e-9}
    for name, bound in bounds.items():
        assert apart(run, twin, name) < bound, name


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_without_potential_only_rounding_remains(surface):
    """And, on the plane, what the contact's regularization takes of the accelerations."""
    scene = mm.Disk(potential="flat", surface=surface)
    run = mm.simulate(scene, method="mujoco/euler", **PAPER)
    twin = mm.simulate(scene.replace(surface="planar"), method="variational/euler", **PAPER)
    bounds = (5e-14, 8e-15) if surface == "planar" else (3e-12, 3e-12)
    assert apart(run, twin) < bounds[0]  # 2e-15; plane 1.4e-13
    assert apart(run, twin, "v") < bounds[1]  # 3e-16; plane 1.1e-13


@pytest.mark.parametrize(("view", "bound"), [
    ("coarsened", 2e-14),  # 8e-16
    ("refined", 5e-13),  # 2.7e-14
])  # fmt: skip
def test_the_path_may_be_coarsened_or_refined(view, bound):
    path = noise.BrownianPath(5, 0.01)
    path = path.coarsened(4) if view == "coarsened" else path.refined(2)
    run, twin = (
        mm.simulate(mm.Disk(), method=m, timestep=path.timestep, duration=20, path=path)
        for m in EULER
    )
    assert apart(run, twin) < bound


@pytest.mark.parametrize("method", mm.methods(mm.Disk(surface="plane")))
def test_a_run_continues_another(method):
    settings: dict[str, Any] = {"method": method, "timestep": 0.01, "seed": 7, "replicas": 2}
    whole = mm.simulate(mm.Disk(), duration=6, **settings)
    first = mm.simulate(mm.Disk(), duration=2, **settings)
    rest = mm.simulate(mm.Disk(), duration=4, initial=first, **settings)
    np.testing.assert_array_equal(rest.x, whole.x[:, 200:])


def test_records_cross_chunks():
    settings: dict[str, Any] = {"method": "mujoco/rk4", "timestep": 0.01, "replicas": 300}
    every = mm.simulate(mm.Disk(), duration=2, **settings)
    third = mm.simulate(mm.Disk(), duration=2, record_interval=3, **settings)
    np.testing.assert_array_equal(third.x, every.x[:, ::3])


def test_a_diverging_replica_is_detected():
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(
            mm.Disk(noise=0.0), method="mujoco/euler", timestep=0.01, duration=1,
            replicas=2, initial={"v": np.array([0.0, 1e11])},
        )  # fmt: skip
    assert caught.value.reason != ENERGY_GREW
    assert caught.value.dataset.sizes["time"] <= 2  # MuJoCo ends the step in which it warns


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_friction_alone_damps_the_slip(surface):
    """No force acts through the callback then, which must not cause a warning."""
    scene = mm.Disk(noise=0.0, potential="flat", v=1.0, surface=surface)
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.01, duration=10)
    slip, turned = run.v + run.omega, -run.v + scene.sigma * run.omega
    # Measured: 2e-12 and 2e-15.
    np.testing.assert_allclose(slip, np.exp(-0.3 * run.time), rtol=1e-11)  # 2e-12
    np.testing.assert_allclose(turned, -1.0, rtol=4e-14)  # 2e-15


DRIVEN = """
<mujoco>
  <option gravity="0 0 0"/>
  <size nuserdata="5"/>
  <custom><text name="magmotor" data="all"/></custom>
  <worldbody>
    <body name="shell" pos="0 0 1" user="0 0 0 0 0 0  1 2 3 0.1 0.2 0.3  0 0 0 0 0 4">
      <freejoint/>
      <geom size="0.1" pos="0.1 0 0"/>
    </body>
    <body name="idle"><freejoint/><geom size="0.1" pos="3 0 0"/></body>
    <body name="turned" pos="0 3 0" euler="30 50 0" user="0 0 -2 0 0 0">
      <joint name="hinge" type="hinge" axis="0 1 2" user="0.4 -0.3 0.2 0.1"/>
      <geom size="0.1" pos="0.2 0 0"/>
      <body name="slider"><joint name="slide" type="slide" axis="1 1 0" user="0 2"/>
        <geom size="0.1"/></body>
    </body>
  </worldbody>
</mujoco>
"""


def expected_wrench(model, data, step):
    """Compute the Brownian wrenches on `DRIVEN` in a step with NumPy."""
    seed, replica, factor, level, first = data.userdata.astype(int)
    view = noise.BrownianPath(seed, model.opt.timestep, max(1, factor), level)
    applied, channel = np.zeros((model.nbody, 6)), 0
    for body, numbers in enumerate(model.body_user):
        for row in numbers.reshape(-1, 6):
            if row.any():
                (rise,) = view.increments(1, first=first + step, replica=replica, channel=channel)
                applied[body] += row * rise / model.opt.timestep
                channel += 1
    return applied


@pytest.mark.parametrize("userdata", [(0, 0, 0, 0, 0), (9, 3, 4, 0, 100), (9, 3, 1, 2, 7)])
def test_wrenches_and_potentials_act_on_any_model(userdata):
    model = mujoco.MjModel.from_xml_string(DRIVEN)
    data = mujoco.MjData(model)
    data.userdata[:] = userdata
    data.qpos[-2:] = 0.7, -0.3
    others = [0, model.body("idle").id, model.body("slider").id]
    data.xfrc_applied[others] = 5.0
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=20)
        mujoco.mj_forward(model, data)
    expected = expected_wrench(model, data, 20)
    expected[others] = 5.0  # no wrench of ours: the applied one remains
    # Measured: 3e-14, of 130.
    np.testing.assert_allclose(data.xfrc_applied, expected, rtol=0, atol=3e-13)
    forces = potential_forces(model, data)
    assert np.abs(forces).max() > 0.1
    np.testing.assert_allclose(data.qfrc_passive, forces, rtol=0, atol=1e-14)


def test_dipoles_and_noise_add_up():
    site = '<site user="7" pos="0 0.3 0.1"/>'
    xml = DRIVEN.replace('<joint name="hinge"', site + '<joint name="hinge"')
    xml = xml.replace("<freejoint/>\n", "<freejoint/>" + site, 1)
    model = mujoco.MjModel.from_xml_string(xml)
    model.site_user *= 1e4
    data = mujoco.MjData(model)
    data.qpos[-2:] = 0.7, -0.3
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    found = data.xfrc_applied.copy()
    data.xfrc_applied[:] = 0
    apply_magnetism(model, data)
    assert np.abs(data.xfrc_applied).max() > 1
    expected = data.xfrc_applied + expected_wrench(model, data, 0)
    # Measured: 1.4e-14, of 104.
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-13)


def test_without_userdata_the_path_is_the_first():
    model = mujoco.MjModel.from_xml_string(DRIVEN.replace('nuserdata="5"', 'nuserdata="1"'))
    data = mujoco.MjData(model)
    data.userdata[:] = 6
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    (rise,) = noise.BrownianPath(6, 0.002).increments(1)
    assert data.xfrc_applied[1, 0] == pytest.approx(rise / 0.002, rel=1e-15, abs=0)  # 0


def recorded_by_stage(model, data, steps):
    """Return the wrench on body 1 at each call of the callback."""
    calls = []
    with mm.magnetism():
        compiled = ctypes.cast(
            mujoco.get_mjcb_control(), ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)
        )

        def recorder(model, data):
            compiled(model._address, data._address)
            calls.append(data.xfrc_applied[1].copy())

        before = mujoco.get_mjcb_control()
        mujoco.set_mjcb_control(recorder)
        try:
            mujoco.mj_step(model, data, nstep=steps)
        finally:
            mujoco.set_mjcb_control(before)
    return np.array(calls)


@pytest.mark.parametrize(("integrator", "stages"), [("Euler", 1), ("implicitfast", 1), ("RK4", 4)])
@pytest.mark.parametrize("start", [0, 3, 1_000_003])
def test_noise_is_constant_over_a_step(integrator, stages, start):
    model = mm.build(mm.Disk(potential="flat"))
    model.opt.timestep, model.opt.integrator = 0.01, mujoco_run.INTEGRATORS[integrator.lower()]
    data = mujoco.MjData(model)
    data.time = start * 0.01 * (1 - 1e-8)  # rounding of the accumulated time
    wrenches = recorded_by_stage(model, data, 50)
    rises = noise.BrownianPath(0, 0.01).increments(50, first=start)
    forces = np.repeat(5 * rises / 0.01, stages)
    np.testing.assert_allclose(wrenches[:, 0], forces, rtol=5e-15)  # measured: 2.2e-16
    np.testing.assert_allclose(wrenches[:, 4], -forces, rtol=5e-15)  # measured: 2.5e-16


def test_rk4_of_a_free_body_is_exact():
    """With a force that is constant over each step, v and x are polynomials in time."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option gravity="0 0 0" integrator="RK4" timestep="0.1"/>
        <custom><text name="magmotor" data="noise"/></custom><worldbody>
        <body user="3 0 0 0 0 0"><joint type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=100)
    kicks = 3 / 2 * noise.BrownianPath(0, 0.1).increments(100)
    assert data.qvel[0] == pytest.approx(kicks.sum(), rel=3e-15, abs=0)  # 1.5e-16
    before = np.cumsum(kicks) - kicks
    place = 0.1 * np.sum(before + kicks / 2)
    assert data.qpos[0] == pytest.approx(place, rel=1e-14, abs=0)  # measured: 1.5e-15


@pytest.mark.parametrize("scheme", ["euler", "rk4"])
def test_threads_do_not_change_a_bit(scheme):
    model = mm.build(mm.Disk())
    model.opt.timestep, model.opt.integrator = 0.01, mujoco_run.INTEGRATORS[scheme]
    userdata = np.zeros((16, 5))
    userdata[:, :2] = np.stack(np.broadcast_arrays(4, np.arange(16)), axis=-1)
    finals = []
    with mm.magnetism():
        for threads in (1, 2):
            data = [mujoco.MjData(model) for _ in range(threads)]
            states, _ = mujoco.rollout.rollout(
                model, data, np.zeros(5), userdata[:, np.newaxis],
                control_spec=int(mujoco.mjtState.mjSTATE_USERDATA), nstep=300,
            )  # fmt: skip
            finals.append(states[:, -1, 1:3])
            batch = mujoco.batch.Batch(model, 16, threads)
            batch.userdata[:] = userdata
            batch.step(nstep=300)
            finals.append(batch.qpos.copy())
    run = mm.simulate(
        mm.Disk(), method=f"mujoco/{scheme}", timestep=0.01, duration=3, seed=4, replicas=16
    )
    finals.append(np.stack([run.x[:, -1], run.theta[:, -1]], axis=-1))
    assert np.ptp(finals[0]) > 1
    for final in finals[1:]:
        np.testing.assert_array_equal(final, finals[0])


@pytest.mark.parametrize(
    ("old", "new", "kind", "element"),
    [
        ("0 0 -2 0 0 0", " ".join(["1"] * 20), "wrench", 3),
        ('user="0 2"', 'user="0 2 0 0 1"', "potential", 3),
        ("<freejoint/>\n", '<joint type="free" name="f" user="1"/>', "potential", 0),
    ],
)
def test_invalid_user_fields_are_named(old, new, kind, element):
    """While a step is made in the words of `mm.describe`, with the number of body or joint."""
    model = mujoco.MjModel.from_xml_string(DRIVEN.replace(old, new))
    with misdeclared(kind, element) as told:
        mm.describe(model)
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as stop:
        mujoco.mj_forward(model, mujoco.MjData(model))
    assert str(stop.value) == str(told.value)


def test_shorter_lists_are_padded_with_zeros():
    model = mujoco.MjModel.from_xml_string(
        DRIVEN.replace("0 0 -2 0 0 0", "0 0 -2").replace('nuserdata="5"', 'nuser_body="20"')
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    assert data.xfrc_applied[3, 2] != 0


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_exported_mjcf_moves_the_same(tmp_path, surface):
    """The file contains noise, potential and friction, and the decoration."""
    scene = mm.Disk(potential="asymmetric", surface=surface, v=1.0)
    (tmp_path / "disk.xml").write_text(compose(scene, visual=True).to_xml_string())
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "disk.xml"))
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[0] = 8
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=1000)
    run = mm.simulate(scene, method="mujoco/euler", timestep=0.01, duration=10, seed=8)
    # Measured: 0 on both surfaces.
    np.testing.assert_allclose(data.qpos, [run.x[-1], run.theta[-1]], rtol=1e-15)
