"""The scene of the motor: presets and derived quantities."""

import math

import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.devices.motor import theory as motor_steps
from magmotor.devices.motor.device import MOTOR
from magmotor.devices.motor.scene import PAPER
from magmotor.devices.motor.theory import slip_mobility


def test_rings_at_different_heights_may_have_similar_radii():
    mm.Motor(outer_radius=0.7, outer_height=0.98)  # the inner ring sweeps out a sphere


def test_presets_are_the_papers_seven_runs():
    for run, (temperature, alpha, _) in PAPER.items():
        scene = mm.Motor.paper(run)
        assert (scene.temperature, scene.alpha_ring) == (temperature, alpha)
        if temperature == "uniform":
            assert scene.alpha_ball == alpha
            assert scene.friction_ring == scene.friction_ball == 0.15
        else:
            assert scene.alpha_ball == scene.friction_ring == 0
    assert [temperature for temperature, _, _ in PAPER.values()].count("uniform") == 4
    assert len({seed for t, a, seed in PAPER.values() if (t, a) == ("uniform", 1e-3)}) == 2
    assert mm.Motor.si().moment == pytest.approx(20.0, rel=1e-15, abs=0)  # 0
    assert mm.Motor().moment == pytest.approx(math.sqrt(20.0), rel=1e-15, abs=0)  # 0


def test_temperature_is_half_the_value_in_the_papers_text():
    assert mm.Motor().kT == pytest.approx(1e-6 / 0.3, rel=1e-15, abs=0)  # 0
    assert mm.Motor().beta == pytest.approx(2 * 0.15 / 1e-6, rel=1e-15, abs=0)  # 0
    assert mm.Motor(alpha_ball=0.0, alpha_ring=0.0).beta == math.inf


def test_another_temperature_resets_the_noise():
    uniform = mm.Motor(ball_mass=0.4)
    other = uniform.replace(temperature="nonuniform")
    assert other == mm.Motor(temperature="nonuniform", ball_mass=0.4)
    assert other.replace(temperature="uniform") == uniform
    strong = uniform.replace(temperature="nonuniform", alpha_ring=3e-4)
    assert strong == mm.Motor(temperature="nonuniform", ball_mass=0.4, alpha_ring=3e-4)
    assert uniform.replace(ball_mass=0.5) == mm.Motor()


def test_inertia_is_the_papers():
    scene = mm.Motor()
    np.testing.assert_allclose(scene.inner_moments, [1.6875, 1.6875, 3.375], rtol=1e-15)  # 0
    assert scene.ball_inertia == pytest.approx(3.2e-4, rel=1e-15, abs=0)  # 0


def test_a_motor_is_restored_from_attributes():
    from magmotor.device.provenance import attributes_of, scene_of

    for scene in (mm.Motor(position=(0.5, 0.1)), mm.Motor.paper("nonuniform-c")):
        import xarray as xr

        assert scene_of(xr.Dataset(attrs=attributes_of(scene))) == scene


@pytest.mark.parametrize(
    ("method", "limit"),
    [
        ("variational/euler", 1.383),
        ("mujoco/euler", 1.383),
        ("mujoco/implicitfast", 1.383),
        ("mujoco/rk4", 3.389),
        ("variational/baoab", 2.283),
        ("mujoco/baoab", 2.283),
    ],
)
def test_timesteps_beyond_the_linear_limits_are_rejected(method, limit):
    scene = mm.Motor()
    MOTOR.check_run(scene, method, limit - 0.002, None)
    with refused("timestep"):
        MOTOR.check_run(scene, method, limit + 0.002, None)


def test_the_reference_rates():
    scene = mm.Motor()
    assert scene.friction_ball * slip_mobility(scene) == pytest.approx(1.05, rel=2e-15, abs=0)  # 0
    assert motor_steps.euler_slip_overheating(scene, 0.1) == pytest.approx(
        1 / (1 - 0.0525), rel=2e-15, abs=0
    )  # 0
