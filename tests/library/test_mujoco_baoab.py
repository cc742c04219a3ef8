"""The splitting BAOAB in MuJoCo: against the variational engine and closed forms.

Statistical tests have fixed seeds; their bounds are 4 standard errors (false alarm rate 6e-5), and
the standard error stands beside the measured value.
"""

import copy
import signal
import subprocess
import sys
import threading
from functools import partial
from typing import Any

import mujoco
import numpy as np
import pytest
from advised_models import NEEDLE, started
from refusals import misdeclared
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor import noise, theory
from magmotor.common.environment import data_folder
from magmotor.mjcf.langevin import loop_calls
from magmotor.numerics import native_library

BOTH = ("mujoco/baoab", "variational/baoab")


def apart(run, other, name):
    """Largest difference between two runs, relative to the largest value."""
    return float(abs(run[name] - other[name]).max() / abs(other[name]).max())


@pytest.mark.parametrize(
    "scene",
    [
        mm.Disk(),
        mm.Disk(potential="asymmetric", sigma=2.0),
        mm.Disk(friction_ratio=0.5),
        mm.Disk(potential="flat"),
    ],
    ids=["symmetric", "asymmetric", "two frictions", "flat"],
)
def test_the_disk_follows_the_variational_baoab(scene):
    """Along one noise path; the unstable equilibria of U amplify rounding errors."""
    run, twin = (
        mm.simulate(scene, method=m, timestep=0.01, duration=50, seed=2, replicas=4) for m in BOTH
    )
    assert float(abs(twin.x).max()) > 50
    bound = 1e-13 if scene.potential == "flat" else 1e-8
    for name in ("x", "v", "theta", "omega"):
        assert apart(run, twin, name) < bound  # measured: 6.4e-11; flat 1.1e-14


@pytest.mark.parametrize("view", ["coarsened", "refined"])
def test_the_path_may_be_coarsened_or_refined(view):
    path = noise.BrownianPath(5, 0.01)
    path = path.coarsened(4) if view == "coarsened" else path.refined(2)
    run, twin = (
        mm.simulate(mm.Disk(), method=m, timestep=path.timestep, duration=20, path=path)
        for m in BOTH
    )
    assert apart(run, twin, "x") < 2e-12  # 1e-13, 5e-14


def test_the_top_follows_the_variational_baoab():
    run, twin = (mm.simulate(mm.Top.paper(4), method=m, timestep=0.0125, duration=20) for m in BOTH)
    for name in ("position", "axis", "angular_velocity", "momentum_map"):
        assert apart(run, twin, name) < 1e-13  # measured: 5e-15


@pytest.mark.parametrize(
    "scene",
    [
        mm.Motor(),
        mm.Motor(ball_ring_factor=1.0),
        mm.Motor(temperature="nonuniform"),
        mm.Motor(inner_inertia=2.5),
    ],
    ids=["uniform", "physical", "nonuniform", "another inertia"],
)
def test_the_motor_follows_the_variational_baoab(scene):
    """Ball and ring, heat and work; the ring tumbles slightly, which needs the exact flow."""
    spinning = {"ring_angular_velocity": (0.002, 0.001, 0.3)}
    run, twin = (
        mm.simulate(
            scene, method=m, timestep=0.05, duration=50, seed=3, replicas=2, initial=spinning
        )
        for m in BOTH
    )
    for name in ("position", "axis", "ring_axis", "ring_angular_velocity", "heat", "work"):
        assert apart(run, twin, name) < 5e-11  # 5.7e-12, the work on a ring that spins fast


WARM = mm.Disk(sigma=0.5, friction=0.5, noise=1.0, potential="flat")
"""kT = 1."""

H = 0.5


def slip_variance_by_diagonal_damping():
    """MuJoCo's implicitfast, which treats only the diagonal of the damping implicitly."""
    c, k = WARM.friction, sum(1 / (mass + H * WARM.friction) for mass in WARM.masses)
    return WARM.noise**2 * k / (c * (2 - H * c * k))


@pytest.mark.parametrize(
    ("scheme", "expected"),
    [
        ("baoab", theory.gibbs_mean_squares(WARM)["slip"]),
        ("euler", theory.euler_slip_variance(WARM, H)),
        ("implicitfast", slip_variance_by_diagonal_damping()),
    ],
)
def test_slip_temperature_at_a_large_step(scheme, expected):
    """lambda h = 0.75: Euler is 60 % too hot, implicitfast 3 % too cold; 4e5 samples."""
    run = mm.simulate(
        WARM, method=f"mujoco/{scheme}", timestep=H, duration=1000, seed=1, replicas=200
    )
    square = ((run.v + run.omega) ** 2).values[:, 20:].mean(axis=1)
    error = square.std(ddof=1) / np.sqrt(len(square))
    assert error < 0.004 * expected  # 0.0025, 0.0021, 0.0025 of it
    assert abs(square.mean() - expected) < 4 * error  # 0.5, 0.7, 0.5 errors


KT = 1e-6


def alpha(damping):
    """The noise at which a damper has the temperature KT."""
    return np.sqrt(2 * damping * KT)


def rows(strength, *wrenches):
    """Rows of six, for a body's user numbers."""
    return " ".join(map(str, strength * np.eye(6)[list(wrenches)].ravel()))


WARM_BODIES = f"""
<mujoco>
  <option timestep="0.05" gravity="0 0 -9.81"/>
  <size nuserdata="1"/>
  <custom><text name="magmotor" data="noise potentials"/></custom>
  <worldbody>
    <body name="needle" user="{rows(alpha(2e-3), 5)}">
      <joint type="hinge" axis="0 0 1" damping="2e-3" user="0 0 0 -3e-2"/>
      <inertial pos="0 0 0" mass="0.01" diaginertia="1e-3 1e-3 3e-4"/>
    </body>
    <body name="cart" pos="1 0 0" euler="20 30 40" gravcomp="1" user="{rows(alpha(1.0), 0, 1, 2)}">
      <joint type="slide" axis="3 4 0" damping="1" armature="0.4"/>
      <inertial pos="0.1 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>
    </body>
    <body name="ball" pos="0 1 0" euler="20 30 40" gravcomp="1"
          user="{rows(alpha(0.5), 0, 1, 2, 3, 4, 5)}">
      <joint type="free" damping="0.5"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
    </body>
    <body name="ring" pos="0 2 0" euler="20 30 40" user="{rows(alpha(0.5), 3, 4, 5)}">
      <joint type="ball" damping="0.5"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.2 0.1 0.2"/>
    </body>
    <body name="brick" pos="0 3 0" user="{rows(alpha(0.5), 3, 4, 5)}">
      <joint type="ball" damping="0.5"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.2 0.1 0.25"/>
    </body>
  </worldbody>
</mujoco>
"""
"""The cart's slide has a share in three noises; the needle has omega h = 1."""


def test_a_users_model_has_its_temperature():
    """Variances of all velocities, and of the oscillator's angle, from 40 000 samples."""
    model = mujoco.MjModel.from_xml_string(WARM_BODIES)
    data = mujoco.MjData(model)
    data.userdata[0] = 7
    langevin = mm.Langevin(model)
    langevin.step(data, 2000)
    samples = []
    for _ in range(40_000):
        langevin.step(data, 10)
        samples.append([data.qpos[0], *data.qvel])
    blocks = np.square(samples).reshape(100, -1, 1 + model.nv).mean(axis=1)
    masses = [3e-4, 0.5, 2, 2, 2, 0.1, 0.1, 0.1, 0.2, 0.1, 0.2, 0.2, 0.1, 0.25]
    expected = KT / np.array([4 * 3e-2, *masses])
    expected[1] *= 1 - (20 * model.opt.timestep) ** 2 / 4  # of the velocity, the scheme's own
    ratio = blocks.mean(axis=0) / expected
    error = blocks.std(axis=0, ddof=1) / 10 / expected
    assert error.max() < 0.03  # 0.006 to 0.022
    assert (abs(ratio - 1) < 4 * error).all()  # 0.965 to 1.006, at most 2.4 errors


def test_bodies_that_differ_in_attitude_follow_one_path():
    """A body's frame does not matter if damping and noise are isotropic."""
    text = WARM_BODIES.replace("0.1 0.1 0.1", "0.2 0.2 0.2").replace("0.2 0.1 0.2", "0.2 0.2 0.2")
    turned = text.replace('pos="0 2 0" euler="20 30 40"', 'pos="0 2 0" euler="80 -30 10"')
    spins = []
    for xml in (text, turned):
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        mm.Langevin(model).step(data, 500)
        spins.append(data.body("ring").xmat.reshape(3, 3) @ data.joint(3).qvel)
    assert np.abs(spins[0] - spins[1]).max() < 1e-14 * np.abs(spins[0]).max()  # measured: 5e-16


def tumbler(moments, timestep):
    """A free body that rotates about none of its principal axes, and its model."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 0" timestep="{timestep}"/><worldbody><body>
        <joint type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="{moments}"/>
        </body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[:] = np.array([0.5, 0.1, -0.7, 0.5])
    data.qvel[:] = 0.4, 0.5, 2.0
    return model, data


def exact_tumble(model, data, duration):
    """Quaternion and angular velocity by DOP853 on Euler's equations."""
    inertia = model.body_inertia[1]

    def rate(_, state):
        w = state[4:]
        turn = np.zeros(4)
        mujoco.mju_mulQuat(turn, state[:4], np.array([0.0, *w]))
        return np.concatenate([turn / 2, np.cross(inertia * w, w) / inertia])

    start = np.concatenate([data.qpos / np.linalg.norm(data.qpos), data.qvel])
    end = solve_ivp(rate, (0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13)
    return end.y[:, -1]


def angular_momentum(model, data):
    turn = Rotation.from_quat(data.qpos, scalar_first=True)
    return turn.apply(model.body_inertia[1] * data.qvel)


@pytest.mark.parametrize("moments", ["1 1 1", "1 1 1.7", "0.3 1 1", "1 0.2 1"])
def test_a_free_symmetric_body_moves_exactly(moments):
    model, data = tumbler(moments, timestep=3.0)
    exact, before = exact_tumble(model, data, 30.0), angular_momentum(model, data)
    energy = model.body_inertia[1] @ data.qvel**2
    langevin = mm.Langevin(model)
    langevin.step(data, 10)
    found = np.concatenate([data.qpos, data.qvel])
    assert np.abs(found - exact).max() < 1e-11  # measured: 6e-13
    langevin.step(data, 1000)
    assert np.abs(angular_momentum(model, data) - before).max() < 5e-12  # measured: 2.2e-13, of 3
    found = model.body_inertia[1] @ data.qvel**2
    assert found == pytest.approx(energy, rel=5e-12, abs=0)  # 2.7e-13


def test_a_free_asymmetric_body_keeps_its_momentum_and_converges_at_second_order():
    steps, errors = (100, 200, 400, 800), []
    for n in steps:
        model, data = tumbler("0.7 1 1.4", timestep=10 / n)
        exact, before = exact_tumble(model, data, 10.0), angular_momentum(model, data)
        mm.Langevin(model).step(data, n)
        errors.append(np.abs(np.concatenate([data.qpos, data.qvel]) - exact).max())
        assert np.abs(angular_momentum(model, data) - before).max() < 5e-13  # measured: 2.6e-14
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(order - 2) < 0.01  # 4e-4


def test_constant_forces_are_exact():
    """Gravity, `qfrc_applied`, and `xfrc_applied` of a body without other forces."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.5"/><worldbody><body><freejoint/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 2 2"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qfrc_applied[0], data.xfrc_applied[1, 1], data.xfrc_applied[1, 3] = 3.0, 5.0, 0.1
    mm.Langevin(model).step(data, 20)
    np.testing.assert_allclose(data.qpos[:3], 50 * np.array([1.5, 2.5, -9.81]), rtol=1e-15)  # 0
    assert data.qvel[3] == pytest.approx(1.0, rel=1e-15, abs=0)  # 0
    np.testing.assert_allclose(data.xpos[1], data.qpos[:3], rtol=0, atol=0)  # 0


NOISY = """
<mujoco>
  <custom><text name="magmotor" data="noise"/></custom>
  <option timestep="0.01" gravity="0 0 0"/>
  <size nuserdata="5"/>
  <worldbody>
    <body name="bead" user="0.1 0 0 0 0 0">
      <joint type="slide" axis="1 0 0" damping="2"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("kT", [None, 1e-3])
def test_a_users_force_on_a_noisy_body_acts_and_old_noise_does_not(kT):
    """On the same noise, a force of 4 N makes the bead faster by F/c = 2 m/s."""
    model = mujoco.MjModel.from_xml_string(NOISY)
    ends = []
    for force in (0.0, 4.0):
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=3)
        assert data.xfrc_applied[1, 0] != 0.0  # the noise of the last step
        data.time, data.qpos[0], data.qvel[0] = 0.0, 0.0, 0.0
        if force:
            data.xfrc_applied[1, 0] = force
        for _ in range(2):  # also in the second call
            mm.Langevin(model, kT).step(data, 500)
        assert data.xfrc_applied[1, 0] == force
        ends.append(data.qvel[0])
    assert ends[1] - ends[0] == pytest.approx(2.0, rel=1e-3)  # 7e-5


def driven(path):
    """The paper's disk, and data that select replica 1 of a path."""
    model = mm.build(mm.Disk())
    model.opt.timestep = path.timestep
    data = mujoco.MjData(model)
    data.userdata[:] = path.seed, 1, path.factor, path.level, 0
    return model, data


def end(data):
    return np.array([*data.qpos, *data.qvel, data.time])


def test_neither_calls_nor_threads_nor_a_block_of_magnetism_change_a_bit():
    model, data = driven(noise.BrownianPath(4, 0.01))
    fresh = copy.copy(data)
    langevin = mm.Langevin(model)
    langevin.step(data, 300)
    ends = []
    for pieces in ((151, 148, 1), (300,)):
        other = copy.copy(fresh)
        with mm.magnetism():
            for steps in pieces:
                langevin.step(other, steps)
        ends.append(end(other))
    start = np.zeros((5, 5))
    chosen = np.zeros((5, 1, 5))
    chosen[:, 0, :2] = np.stack([np.full(5, 4), np.arange(5)], axis=-1)
    spec = int(mujoco.mjtState.mjSTATE_USERDATA)
    paths = [
        langevin.rollout(
            [mujoco.MjData(model) for _ in range(threads)], start, chosen,
            control_spec=spec, nstep=300,
        )
        for threads in (1, 2, 3)
    ]  # fmt: skip
    run = mm.simulate(
        mm.Disk(), method="mujoco/baoab", timestep=0.01, duration=3, seed=4, replicas=5
    )
    simulated = np.stack([run.x, run.theta, run.v, run.omega], axis=-1)[:, 1:]
    assert abs(data.qpos[0]) > 1
    for other in ends:
        np.testing.assert_array_equal(other, end(data))
    for path in paths:
        np.testing.assert_array_equal(path, simulated)
    np.testing.assert_array_equal(simulated[1, -1], end(data)[:4])


@pytest.mark.parametrize("start", [0.0, 1e14], ids=["from 0", "where the time loses steps"])
def test_checks_for_ctrl_c_change_no_bit(start, monkeypatch):
    """A timestep of 0.09375 s at a time where consecutive doubles are 1/64 s apart."""
    model, data = driven(noise.BrownianPath(4, 0.1))
    data.time = start
    langevin, ends = mm.Langevin(model), []
    for first in (10**6, 1):
        monkeypatch.setattr(loop_calls, "FIRST_STEPS", first)
        monkeypatch.setattr(loop_calls, "SECONDS_BETWEEN_CHECKS", 0.0)
        other = copy.copy(data)
        langevin.step(other, 300)
        ends.append(end(other))
    assert start == 0 or abs(ends[0][-1] - start - 30) > 1
    np.testing.assert_array_equal(*ends)


def test_ctrl_c_interrupts_stepping():
    model, data = driven(noise.BrownianPath(4, 0.01))
    langevin = mm.Langevin(model)
    ctrl_c = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        langevin.step(data, 2**53 - 1)
    ctrl_c.join()
    whole = driven(noise.BrownianPath(4, 0.01))[1]
    mm.Langevin(whole.model).step(whole, round(data.time / 0.01))
    np.testing.assert_array_equal(end(whole), end(data))


@pytest.mark.parametrize("view", ["coarsened", "refined"])
def test_userdata_selects_the_path(view):
    path = noise.BrownianPath(4, 0.01)
    path = path.coarsened(3) if view == "coarsened" else path.refined(1)
    model, data = driven(path)
    mm.Langevin(model).step(data, 100)
    run = mm.simulate(
        mm.Disk(), method="mujoco/baoab", timestep=path.timestep, duration=100 * path.timestep,
        replicas=2, path=path,
    )  # fmt: skip
    np.testing.assert_array_equal([run.x[1, -1], run.omega[1, -1]], end(data)[[0, 3]])


@pytest.mark.parametrize("scene", [mm.Disk(), mm.Motor()])
def test_a_run_continues_another(scene, monkeypatch):
    """With any chunks, and from where another run stopped."""
    settings: dict[str, Any] = {"method": "mujoco/baoab", "timestep": 0.01, "replicas": 2}
    whole = mm.simulate(scene, duration=3, **settings)
    monkeypatch.setattr("magmotor.run.in_mujoco.CHUNK", 38)
    monkeypatch.setattr("magmotor.device.job.CHUNK", 100)
    chopped = mm.simulate(scene, duration=3, **settings)
    name = "x" if isinstance(scene, mm.Disk) else "position"
    np.testing.assert_array_equal(chopped[name], whole[name])
    if isinstance(scene, mm.Disk):
        first = mm.simulate(scene, duration=1, **settings)
        rest = mm.simulate(scene, duration=2, initial=first, **settings)
        np.testing.assert_array_equal(rest.x, whole.x[:, 100:])


def test_noise_is_that_of_the_package_to_the_bit():
    """A slide without damping, from rest."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option gravity="0 0 0" timestep="1"/><size nuserdata="5"/>
        <custom><text name="magmotor" data="noise"/></custom><worldbody>
        <body user="0 0 0 0 0 0  1 0 0 0 0 0"><joint type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    )
    langevin = mm.Langevin(model)
    for first in (0, 5):
        data = mujoco.MjData(model)
        data.userdata[:] = 3, 2, 1, 0, first
        rises = noise.BrownianPath(3, 1.0).increments(7, first=first, replica=2)
        for rise in rises:
            data.qvel[0] = 0.0
            langevin.step(data)
            assert data.qvel[0] == rise
        data.time = 0.0
        data.qvel[0] = 0.0
        langevin.step(data, 7)
        assert data.qvel[0] == pytest.approx(rises.sum(), rel=1e-15, abs=0)  # 0, or rounding


def kinetic_energy(model, data):
    mujoco.mj_fwdPosition(model, data)
    momentum = np.empty(model.nv)
    mujoco.mj_mulM(model, data, momentum, data.qvel)
    return momentum @ data.qvel / 2


def test_the_heat_is_that_which_the_motor_sums_up_itself():
    """What the noise gives less what friction takes, from the exact part O of ball and ring."""
    scene, h, steps = mm.Motor(), 0.05, 1000
    run = mm.simulate(scene, method="mujoco/baoab", timestep=h, duration=steps * h, seed=5)
    model = mm.build(scene)
    model.opt.timestep = h
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[0] = 5
    before = kinetic_energy(model, data)
    found = mm.Langevin(model).step(data, steps)
    np.testing.assert_array_equal(data.qvel[:2], run.velocity.values[-1, :2])
    given = float(run.work[-1] - run.heat[-1])
    assert found["noise"] == pytest.approx(given, rel=1e-12, abs=0)  # 3.3e-14
    gained = kinetic_energy(model, data) - before
    assert found["noise"] + found["work"] == pytest.approx(gained, rel=1e-13, abs=0)  # 5e-15


def test_a_sample_without_kT_follows_the_replicas_of_the_models_noise():
    model, data = driven(noise.BrownianPath(4, 0.01))
    langevin = mm.Langevin(model)
    run = langevin.sample(1.0, replicas=3, record_interval=25, initial=data)
    assert run.bath.values.tolist() == ["noise"]
    for replica in range(3):
        data.time, data.qpos[:], data.qvel[:], data.userdata[1] = 0.0, 0.0, 0.0, 1 + replica
        exchanged = langevin.step(data, 100)
        np.testing.assert_array_equal(run.qpos[replica, -1], data.qpos)
        np.testing.assert_array_equal(run.qvel[replica, -1], data.qvel)
        assert float(run.heat[replica, -1, 0]) == exchanged["noise"]
    assert len(np.unique(run.qpos[:, -1, 0])) == 3


def test_the_wrench_of_a_step_by_mujoco_does_not_stay():
    """A block of `magnetism` leaves the noise of its last step in `xfrc_applied`."""
    model, data = driven(noise.BrownianPath(4, 0.01))
    with mm.magnetism():
        mujoco.mj_step(model, data)
    assert data.xfrc_applied[1].any()
    clean = copy.copy(data)
    clean.xfrc_applied[:] = 0.0
    langevin = mm.Langevin(model)
    for used in (data, clean):
        langevin.step(used, 20)
    np.testing.assert_array_equal(end(data), end(clean))


@pytest.mark.parametrize("scene", [mm.Disk(), mm.Disk(surface="plane"), mm.Top(), mm.Motor()])
def test_the_decorated_model_moves_as_the_plain_one(scene):
    ends = []
    for visual in (False, True):
        model = mm.build(scene, visual=visual)
        model.opt.timestep = 0.01
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mm.Langevin(model).step(data, 500)
        ends.append(end(data))
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-15)  # 0


TWO_NEEDLES = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body name="left"><joint name="a" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1"
      diaginertia="1 1 1"/><site name="north" user="1" zaxis="1 0 0"/></body>
    <body name="right"><joint name="b" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1"
      diaginertia="1 1 1"/><site name="south" user="1" zaxis="1 0 0"/></body>
  </worldbody>
</mujoco>
"""


def test_mujocos_errors_are_raised_and_do_not_end_the_process():
    model = mujoco.MjModel.from_xml_string(TWO_NEEDLES)
    langevin = mm.Langevin(model)
    for _ in range(2):
        with pytest.raises(mujoco.FatalError) as caught:
            langevin.step(mujoco.MjData(model), 5)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        with misdeclared("coincidence", 1) as known:
            mm.magnetic_energy(model, data)
        assert str(caught.value).endswith(str(known.value))
    data = mujoco.MjData(model)
    data.qpos[0] = 0.5
    langevin.step(data, 5)  # nothing is left of the error
    assert data.qvel[0] == -data.qvel[1] != 0


def test_a_state_that_is_not_finite_is_reported():
    model = mujoco.MjModel.from_xml_string(TWO_NEEDLES)
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = 0.5, np.inf
    with pytest.raises(FloatingPointError):
        mm.Langevin(model).step(data, 5)
    assert data.time == pytest.approx(0.002)
    model, data = driven(noise.BrownianPath(1, 0.01))
    start = np.array([[0.0, 0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, np.nan, 1.0]])
    paths = mm.Langevin(model).rollout([data], start, None, control_spec=0, nstep=5)
    assert np.isfinite(paths[0]).all()
    assert np.isnan(paths[1, 1:]).all()


@pytest.mark.skipif(native_library.library() is None, reason="there is no library")
def test_with_the_library_a_process_compiles_nothing():
    """Neither the callback nor the splitting."""
    program = (
        "import sys, mujoco, magmotor as mm; model = mm.build(mm.Disk());"
        " data = mujoco.MjData(model); mm.Langevin(model).step(data);"
        " hook = mm.magnetism(); hook.__enter__(); mujoco.mj_step(model, data);"
        " print('numba' in sys.modules)"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"]


@pytest.mark.parametrize("scene", ["top", "motor", "disk"])
def test_a_model_with_the_plugin_has_no_second_forces(scene):
    """Langevin applies the forces itself, whichever hook they have elsewhere."""
    states = []
    for name in (scene, f"{scene}_magnetic"):
        model = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{name}.xml"))
        data = mujoco.MjData(model)
        mm.Langevin(model).step(data, nstep=1000)
        states.append(np.concatenate([data.qpos, data.qvel]))
    assert abs(states[0][: model.nq] - model.qpos0).max() > 1e-3
    np.testing.assert_array_equal(*states)


@pytest.mark.parametrize("langevin", [mm.Langevin, partial(mm.Langevin, kT=1e-9, friction=1)])
def test_what_a_thermostat_leaves_in_xfrc_applied_is_not_taken_for_the_users(langevin):
    """By a block afterwards, whose warning would be an error."""
    start, end = NEEDLE.index("<extension>"), NEEDLE.index("</extension>")
    model, data = started(NEEDLE[:start] + "<extension>" + NEEDLE[end:])
    langevin(model).step(data, nstep=3)
    left = data.xfrc_applied.copy()
    assert left.any()
    data.qpos[0] += 0.1
    with mm.magnetism():
        mujoco.mj_step(model, data)
    assert (data.xfrc_applied != left).any()
