"""Which recorded states of the motor end a run, and what is said of them."""

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


def wrong(tilt, work, scene=SCENE):
    """What is wrong with a state whose ring leans by so many degrees after work in J by noise."""
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
def test_a_ring_that_has_tipped_is_what_is_told_first(tilt, work, rows, failure):
    """Between two records it may tip and, whirling, get more energy than a step can follow."""
    assert wrong(tilt, work) == (rows, failure)


def test_a_warm_motor_has_no_more_energy_for_the_work_that_its_noise_has_done():
    assert wrong(0, 1, mm.Motor()) == (1, None)
    assert wrong(10, 1, mm.Motor()) == (0, (ENERGY_GREW, ""))


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_lift_is_what_the_energy_falls_by_when_the_ball_rises(factor):
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
