"""What a builder meets first: tilted floors, background fields, torsion, turning tilts."""

import math

import numpy as np
import pytest

import magmotor as mm
from magmotor.devices.top.scene import pose

ALONG = math.cos(0.5), math.sin(0.5)
LEVEL = mm.Top.paper(4, tilt=0.0)
EVERYTHING = {"floor_tilt": (1e-3, 5e-4), "background_field": (2e-5, 1e-5, -3e-5)}
TOP = mm.Top.paper(4, torsional_damping=1e-5, **EVERYTHING)
MOTOR = mm.Motor(
    alpha_ball=0.0, alpha_ring=0.0, position=(0.5, 0.1), axis=(0, 0, 1),
    floor_tilt=(2e-6, 1e-6), background_field=(2e-7, 1e-7, -3e-7),
)  # fmt: skip


def tilted(angle):
    return {"floor_tilt": (angle * ALONG[0], angle * ALONG[1])}


def field(strength):
    return {"background_field": (strength * ALONG[0], strength * ALONG[1], 0.0)}


@pytest.mark.parametrize(("scene", "spin"), [
    (mm.Top.paper(4), 7.17), (LEVEL, 0.08),
    (LEVEL.replace(**tilted(1e-4)), 1.77), (LEVEL.replace(**tilted(1e-3)), 4.95),
    (mm.Top.paper(4, floor_tilt=(1e-3, 0)), 8.31), (mm.Top.paper(4, floor_tilt=(-1e-3, 0)), 4.88),
    (LEVEL.replace(**field(20e-6)), 1.44), (LEVEL.replace(**field(2e-6)), 0.37),
    (mm.Top.paper(4, **field(20e-6)), 7.03),
    (mm.Top.paper(4, torsional_damping=1e-5), 4.73),
    (mm.Top.paper(4, torsional_damping=1e-4), 0.74),
])  # fmt: skip
def test_the_spin_after_a_minute(scene, spin):
    """By DOP853 and by another solver; the values are also those of an independent program."""
    largest = []
    for method, timestep in (("scipy/dop853", 0.02), ("mujoco/rk4", 0.0125)):
        run = mm.simulate(scene, method=method, timestep=timestep, duration=60)
        largest.append(float(abs(run.momentum_map).max()) / scene.inertia[2])
    assert largest == pytest.approx([spin, spin], abs=0.0051)  # two decimals


@pytest.fixture(scope="module")
def top_truth():
    return mm.simulate(TOP, method="scipy/dop853", timestep=0.0125, duration=60)


@pytest.mark.parametrize(("method", "finer", "bound", "balance"), [
    ("variational/blanes-moan4", 1, 3e-8, 3e-8),  # 1.1e-9, 2.2e-9
    ("mujoco/rk4", 1, 9e-7, 3e-5),  # 3.1e-8, 3.6e-6
    ("variational/baoab", 8, 1.5e-4, 3e-4),  # 5.3e-6, 1.3e-5
    ("variational/euler", 8, 8e-3, 3e-3),  # 2.8e-4, 1.4e-4
    ("variational/cayley", 8, 8e-3, 3e-3),  # 2.7e-4, 1.4e-4
    ("mujoco/euler", 8, 8e-3, 3e-3),  # 2.8e-4, 1.4e-4
    ("mujoco/implicitfast", 8, 4e-3, 8e-3),  # 1.4e-4, 4.2e-4
])  # fmt: skip
def test_the_top_with_all_of_it(method, finer, bound, balance, top_truth):
    """Against DOP853, and its balances of J and energy, relative to the largest J and the heat."""
    run = mm.simulate(
        TOP, method=method, timestep=0.0125 / finer, duration=60, record_interval=finer
    )
    scale = float(abs(top_truth.momentum_map).max())
    apart = np.abs(run.momentum_map.values - top_truth.momentum_map.values).max()
    assert apart < bound * scale
    assert abs(mm.observables.momentum_balance(run).residual).max() < balance * scale
    energies = mm.observables.energy_balance(run)
    assert abs(energies.residual).max() < balance * abs(energies.heat[-1])


def test_mujoco_and_the_variational_euler_agree_to_rounding():
    scene = TOP.replace(torsional_damping=0.0)
    runs = [
        mm.simulate(scene, method=method, timestep=0.0125, duration=20)
        for method in ("mujoco/euler", "variational/euler")
    ]
    apart = np.abs(runs[0].momentum_map.values - runs[1].momentum_map.values).max()
    assert apart < 3e-9 * abs(runs[0].momentum_map).max()  # 1e-10


@pytest.mark.parametrize(("method", "timestep", "bound"), [
    ("variational/blanes-moan4", 0.1, 1.4e-8),  # 4.6e-10
    ("mujoco/rk4", 0.1, 8e-7),  # 2.7e-8
    ("variational/baoab", 0.01, 1e-4),  # 3.8e-6
    ("mujoco/baoab", 0.01, 1e-4),  # 3.8e-6
])  # fmt: skip
def test_the_motor_on_a_tilted_floor_in_a_field(method, timestep, bound):
    """Against DOP853, relative to the distance traveled; without them it is at another place."""
    truth = mm.simulate(MOTOR, method="scipy/dop853", timestep=0.1, duration=200)
    run = mm.simulate(
        MOTOR, method=method, timestep=timestep, duration=200, record_interval=round(0.1 / timestep)
    )
    traveled = np.linalg.norm(truth.position.values - truth.position.values[0], axis=-1).max()
    assert np.abs(run.position.values - truth.position.values).max() < bound * traveled
    energies = mm.observables.energy_balance(run)
    assert abs(energies.residual).max() < 4e-3 * abs(energies.heat[-1])  # 2e-5 .. 1.4e-3
    plain = MOTOR.replace(floor_tilt=(0, 0), background_field=(0, 0, 0))
    other = mm.simulate(plain, method="scipy/dop853", timestep=0.1, duration=200)
    assert np.abs(other.position.values - truth.position.values).max() > 0.1 * traveled  # 0.39


@pytest.mark.parametrize("scene", [TOP, TOP.replace(tilt_azimuth=1.0)])
def test_the_ball_rests_in_the_minimum_of_the_effective_potential(scene):
    """Force and torque vanish at the rest state; the slope and the field move it by this much."""
    position, axis = mm.theory.resting_ball(scene)
    moment = scene.moment * axis
    force, torque = mm.dipoles.wrench(position, moment, *scene.ring_sources())
    force = force + scene.ball_mass * np.array(scene.gravity_vector)
    torque = torque + np.cross(moment, scene.background_field)
    assert np.abs(force[:2]).max() < 1e-12  # 4e-14 of 2e-2 N
    assert np.abs(torque).max() < 1e-16  # 4e-18
    plain = scene.replace(floor_tilt=(0, 0), background_field=(0, 0, 0))
    assert np.linalg.norm(position - mm.theory.resting_ball(plain)[0]) > 0.005


def test_the_linear_limit_knows_the_torsion():
    """At rest under a level ring, the spin about the vertical decays at the rate k/I."""
    scene = mm.Top(tilt=0.0, ring_height=0.8, torsional_damping=1e-3, friction=0.0)
    decay = mm.theory.small_motion(scene).decay
    assert decay.max() == pytest.approx(1e-3 / scene.inertia[2], rel=1e-9)


def test_a_ball_on_a_plane_that_bears_it_rolls_down():
    """5/7 g sin(angle), with friction strong enough that it does not slip, and no ring near."""
    scene = mm.Top(
        surface="plane", floor_tilt=(0.02, -0.01), friction=50.0, position=(0.0, 0.0),
        ring_height=30.0, tilt=0.0,
    )  # fmt: skip
    run = mm.simulate(
        scene, method="mujoco/implicitfast", timestep=1e-3, duration=0.5, allow_unstable=True
    )
    velocity = run.velocity.values[-1, :2]
    expected = 5 / 7 * 0.5 * np.array(scene.gravity_vector[:2])
    assert velocity == pytest.approx(expected, rel=0.02)  # 0.004


def test_a_tilt_that_turns():
    """The pose is that of the waypoints, MuJoCo agrees with DOP853, and the ball follows the tilt.

    The ring's normal turns once around; the low side, where V_e is deepest, turns with it.
    """
    script = [(0.0, 0.2, math.pi / 64, 0.0), (120.0, 0.2, math.pi / 64, 2 * math.pi)]
    scene = mm.Top(ring_script=script, position=(0.28, 0.01))
    w, x, y, _ = scene.ring_orientation(60.0)
    assert [2 * w * y, -2 * w * x] == pytest.approx([-math.sin(math.pi / 64), 0.0], abs=3e-16)
    runs = [
        mm.simulate(scene, method=method, timestep=0.025, duration=120, record_interval=10)
        for method in ("mujoco/rk4", "scipy/dop853")
    ]
    apart = np.abs(runs[0].momentum_map.values - runs[1].momentum_map.values).max()
    assert apart < 3e-4 * abs(runs[1].momentum_map).max()  # 1.1e-5
    x, y = runs[0].position.values[:, :2].T
    around = np.unwrap(np.arctan2(y, x))
    azimuth = [pose(scene.ring_script, time)[2] for time in runs[0].time.values]
    assert np.abs(around - azimuth).max() < 0.3  # 0.11
    assert around[-1] == pytest.approx(2 * math.pi, abs=0.01)  # 4e-4


@pytest.mark.parametrize(("scene", "fields", "message"), [
    (mm.Top, {"floor_tilt": (0.1,)}, r"floor_tilt = \(0.1,\): must be 2 numbers"),
    (mm.Top, {"floor_tilt": (0.6, 0)}, "floor_tilt = 0.6: must be less than 0.5 rad"),
    (mm.Top, {"floor_tilt": (0, -0.6)}, "floor_tilt = -0.6: must be at least -0.5 rad"),
    (mm.Top, {"floor_tilt": (0.1, 0), "gravity": 0}, "gravity = 0.0: .* floor_tilt is not zero"),
    (mm.Top, {"background_field": (0, math.nan, 0)}, "background_field = nan: must be a finite"),
    (mm.Top, {"torsional_damping": -1}, "torsional_damping = -1: must be at least 0 N m s"),
    (mm.Motor, {"background_field": (1e-5, 0, 0), "inner_dipoles": 1}, "background_field = .* one"),
    (mm.Top, {"ring_script": ((0, 0.2, 0, math.inf),)}, r"ring_script\[0\].azimuth = inf"),
])  # fmt: skip
def test_bad_values_are_named(scene, fields, message):
    with pytest.raises(ValueError, match=message):
        scene(**fields)


def test_a_floor_so_steep_that_the_ball_finds_no_rest_is_named():
    with pytest.raises(ValueError, match=r"floor_tilt = \(0.2, 0.0\): is too steep"):
        mm.simulate(mm.Top(floor_tilt=(0.2, 0)), method="mujoco/rk4", timestep=0.01, duration=1)
