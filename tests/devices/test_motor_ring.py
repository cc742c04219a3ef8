"""The inner ring in the field of the outer one: stiffness, period and stability."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.devices.motor.device import MOTOR
from magmotor.devices.motor.energy import motor_energy

FAR = {"position": (3.0, 0.0), "alpha_ball": 0.0, "alpha_ring": 0.0, "friction_ball": 0.0}
"""A distant ball, no noise, and no friction of the ball."""

ALONE = mm.Motor(**FAR, friction_ring=0.0)


def tilted(angle, azimuth=0.0):
    """Return the axis of a ring that is tilted by an angle (rad)."""
    lean = np.sin(angle)
    return {"ring_axis": (lean * np.cos(azimuth), lean * np.sin(azimuth), np.cos(angle))}


def energy(angle, azimuth):
    state = MOTOR.initial_state(ALONE, tilted(angle, azimuth), None)
    return motor_energy(ALONE, state).total.item()


@pytest.mark.parametrize("azimuth", [0.0, 0.7, np.pi / 2])
def test_tilt_stiffness(azimuth):
    step = 1e-3
    gain = energy(step, azimuth) + energy(step, azimuth + np.pi) - 2 * energy(0.0, 0.0)
    assert gain / step**2 == pytest.approx(0.0735, abs=5e-5)  # 0.07345 to 0.07346


@pytest.mark.parametrize("method", ["variational/baoab", "mujoco/baoab", "mujoco/euler"])
def test_period_of_the_tilt(method):
    run = mm.simulate(
        ALONE, method=method, timestep=0.02, duration=100.0, initial=tilted(np.radians(0.1))
    )
    lean = run.ring_axis.values[:, 0]
    down = np.flatnonzero((lean[:-1] > 0) & (lean[1:] <= 0))
    crossings = run.time.values[down] + 0.02 * lean[down] / (lean[down] - lean[down + 1])
    assert np.diff(crossings) == pytest.approx(30.11, abs=0.01)  # 30.112; 30.24 at 1 degree


@pytest.mark.parametrize(("moments", "kept"), [(1.0, True), (-1.0, False)])
def test_the_ring_is_stable_with_parallel_dipoles_only(moments, kept):
    model = mm.build(ALONE)
    ring = model.body("inner_ring").id
    model.site_user[model.site_bodyid == ring] *= moments
    model.opt.timestep = 0.02
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    half = np.radians(0.5)
    start = model.joint(model.body_jntadr[ring]).qposadr[0]
    data.qpos[start : start + 4] = np.cos(half), 0.0, np.sin(half), 0.0
    largest = 0.0
    with mm.magnetism():
        for _ in range(100):
            mujoco.mj_step(model, data, nstep=50)
            upright = data.body("inner_ring").xmat[8]
            largest = max(largest, np.degrees(np.arccos(min(1.0, upright))))
    assert (largest < 1.01) == kept  # 0.999; 179 if antiparallel
    assert (largest > 90) != kept


def test_the_rings_cannot_touch():
    """However the inner ring is turned about its center, which is also that of the outer ring."""
    scene = mm.Motor()
    arms, _ = scene.inner_dipole_frame()
    fixed = scene.outer_sources()[0] - [0.0, 0.0, scene.inner_height]
    turns = Rotation.random(1000, rng=np.random.default_rng(1)).as_matrix()
    apart = np.linalg.norm((arms @ turns)[:, :, np.newaxis] - fixed, axis=-1)
    assert apart.min() >= scene.outer_radius - scene.inner_radius - 1e-12  # 0.230003 of 0.23
    assert apart.min() < 0.235
