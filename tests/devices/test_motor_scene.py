"""The scene of the motor: checks of its fields, presets, and derived quantities."""

import dataclasses
import math

import numpy as np
import pytest

import magmotor as mm
from magmotor.devices.motor import theory as motor_steps
from magmotor.devices.motor.device import MOTOR
from magmotor.devices.motor.scene import PAPER
from magmotor.devices.motor.theory import slip_mobility

BAD = [
    ({"temperature": "unifrom"}, "temperature = 'unifrom': must be one of .*'uniform'"),
    ({"alpha_ball": -1.0}, "alpha_ball = -1.0: must be at least 0"),
    ({"alpha_ring": math.nan}, "alpha_ring = nan: must be a finite number"),
    ({"friction_ball": -0.1}, "friction_ball = -0.1: must be at least 0 kg/s"),
    ({"friction_ball": 0.0}, "friction_ball = 0.0: must be positive with alpha_ball"),
    ({"friction_ring": 0.0}, "friction_ring = 0.0: must be positive with alpha_ring"),
    (
        {"friction_ring": 0.2},
        r"friction_ring/alpha_ring\^2 = 2000.*: must be friction_ball/alpha_ball\^2 = 150000",
    ),
    ({"alpha_ball": 2e-3}, r"alpha_ring\^2 = 150000.*: must be friction_ball/.* = 37500"),
    ({"alpha_ball": 0.0}, r"alpha_ring\^2 = 150000.*: must be friction_ball/.* = inf"),
    ({"ball_ring_factor": 0}, "ball_ring_factor = 0: must be greater than 0"),
    ({"coupling": 0}, "coupling = 0: must be greater than 0 J m"),
    ({"ball_mass": -1}, "ball_mass = -1: must be greater than 0 kg"),
    ({"ball_radius": 0}, "ball_radius = 0: must be greater than 0 m"),
    ({"inner_dipoles": 2.5}, "inner_dipoles = 2.5: must be an integer"),
    ({"inner_radius": 1.0}, "inner_radius = 1.0: must be less than 0.98 m: otherwise"),
    ({"inner_radius": 0}, "inner_radius = 0: must be greater than 0 m"),
    ({"inner_height": 0.3}, r"inner_height = 0.3: must be greater than 0.3365\d* m \(the ball"),
    ({"inner_mass": 0}, "inner_mass = 0: must be greater than 0 kg"),
    ({"inner_inertia": -1.0}, "inner_inertia = -1.0: must be greater than 0 kg m"),
    ({"inner_axial_inertia": 9.0, "inner_inertia": 2.0}, "inner_axial_inertia = 9.0: must be at"),
    ({"inner_dipole_angle": math.nan}, "inner_dipole_angle = nan: must be a finite number"),
    ({"load_torque": math.inf}, "load_torque = inf: must be a finite number"),
    ({"load_torque": 1.0, "surface": "plane"}, "load_torque = 1.0: must be zero when surface"),
    ({"outer_dipoles": 0}, "outer_dipoles = 0: must be at least 1"),
    ({"outer_radius": 0.7}, "inner_radius = 0.75: must be less than 0.7 m: otherwise"),
    ({"outer_height": 0.08}, "outer_height = 0.08: must be greater than 0.08 m"),
    ({"position": (0.6,)}, r"position = \(0.6,\): must be 2 numbers"),
    ({"position": 0.6}, "position = 0.6: must be 2 numbers"),
    ({"velocity": (0.0, math.nan)}, "velocity = nan: must be a finite number"),
    ({"axis": (0, 0, 0)}, "axis = .*: must have a nonzero"),
    ({"spin": math.inf}, "spin = inf"),
    ({"gravity": -9.81}, "gravity = -9.81: must be at least 0"),
    ({"surface": "plane", "gravity": 0.0}, "gravity = 0.0: must be positive when surface"),
]


@pytest.mark.parametrize(("fields", "message"), BAD, ids=[str(f) for f, _ in BAD])
def test_bad_fields_are_named_with_value_and_bound(fields, message):
    with pytest.raises(ValueError, match=message):
        mm.Motor(**fields)


def test_every_field_has_a_unit_a_doc_and_a_bad_value_among_the_tests():
    tried = {name for fields, _ in BAD for name in fields}
    # These are in test_real_world.py:
    tried |= {"floor_tilt", "background_field", "drag", "rotational_drag", "drag_temperature"}
    for field in dataclasses.fields(mm.Motor):
        assert field.name in tried, field.name
        assert {"unit", "doc"} <= field.metadata.keys()


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
    with pytest.raises(ValueError, match="temperature = 'nonuniform': must be uniform"):
        _ = mm.Motor.paper("nonuniform-a").kT


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
    with pytest.raises(ValueError, match=f"less than {limit}, the linear limit"):
        MOTOR.check_run(scene, method, limit + 0.002, None)


def test_the_reference_rates():
    scene = mm.Motor()
    assert scene.friction_ball * slip_mobility(scene) == pytest.approx(1.05, rel=2e-15, abs=0)  # 0
    assert motor_steps.euler_slip_overheating(scene, 0.1) == pytest.approx(
        1 / (1 - 0.0525), rel=2e-15, abs=0
    )  # 0
