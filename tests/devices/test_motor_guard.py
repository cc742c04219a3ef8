"""The guard of the motor: states that end a run, and their messages."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.device.guard import ENERGY_GREW
from magmotor.devices.motor.energy import motor_energy
from magmotor.devices.motor.guard import TIPPED, MotorGuard
from magmotor.devices.motor.states import start_motor

SCENE = mm.Motor.paper("nonuniform-a")


LOST = "the inner ring is lost: it is tilted by 25.0 degrees, beyond 20"


def fault(tilt, work, scene=SCENE):
    """Return the fault of a state with a tilted ring (degrees) after some work (J) of the noise."""
    first = start_motor(scene)
    ring = Rotation.from_euler("x", tilt, degrees=True).as_quat(scalar_first=True)
    state = first._replace(
        ring_orientation=np.broadcast_to(ring, first.ring_orientation.shape),
        ring_work=np.full_like(first.ring_work, work),
    )
    return MotorGuard(scene, first).first_wrong(state)


@pytest.mark.parametrize(
    ("tilt", "work", "rows", "failure"),
    [
        (10, 1, 1, None),
        (10, 0, 0, (ENERGY_GREW, "")),
        (25, 1, 0, (LOST, TIPPED)),
        (25, 0, 0, (f"{LOST}; {ENERGY_GREW}", TIPPED)),
    ],
)
def test_a_tipped_ring_is_reported_before_energy(tilt, work, rows, failure):
    """A ring that tips between two records may also gain energy by an unstable step."""
    assert fault(tilt, work) == (rows, failure)


def test_work_of_the_noise_does_not_raise_the_energy_bound_at_uniform_temperature():
    assert fault(0, 1, mm.Motor()) == (1, None)
    assert fault(10, 1, mm.Motor()) == (0, (ENERGY_GREW, ""))


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_lift_is_minus_the_vertical_gradient_of_the_energy(factor):
    scene = mm.Motor(ball_ring_factor=factor, gravity=0.0)
    random = np.random.default_rng(3)
    states = start_motor(scene, 8)
    states = states._replace(
        position=states.position + random.uniform(-0.1, 0.1, (1, 8, 3)),
        orientation=random.normal(size=(1, 8, 4)),
        ring_orientation=Rotation.from_quat(random.normal(size=(8, 4))).as_quat()[None],
    )
    lift = motor_energy(scene, states).lift
    up, down = (
        motor_energy(scene, states._replace(position=states.position + step)).total
        for step in np.array([(0, 0, 1e-5), (0, 0, -1e-5)])
    )
    assert np.abs(lift + (up - down) / 2e-5).max() < 1e-7 * np.abs(lift).max()  # 5e-9
