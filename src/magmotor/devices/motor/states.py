"""States of the motor: recorded states and the initial state."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.ball.landscape import packed_sources, total_field, valley_radius
from magmotor.devices.ball.states import axes, smallest_turn
from magmotor.devices.motor.scene import Motor


class MotorStates(NamedTuple):
    """Recorded states, shape (T, replicas) or (T, replicas, n), and their times, shape (T,).

    Vectors are in the world frame; orientations are quaternions (w, x, y, z). Heat and work are
    counted from the start of the run. Heat is dissipated by friction of the ball's slip and of the
    ring; work is the Stratonovich integral of the noise.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]
    orientation: NDArray[np.float64]
    ring_angular_velocity: NDArray[np.float64]
    ring_orientation: NDArray[np.float64]
    ball_heat: NDArray[np.float64]
    ring_heat: NDArray[np.float64]
    ball_work: NDArray[np.float64]
    ring_work: NDArray[np.float64]


def start_motor(scene: Motor, replicas: int = 1) -> MotorStates:
    """Return the initial state of the scene for all replicas, with the ring level and at rest."""
    position = scene.position or (valley_radius(scene), 0.0)
    center = np.array([*position, scene.ball_radius])
    axis = scene.axis or total_field(scene, center, packed_sources(scene))
    orientation = smallest_turn(axis)
    state = {
        "position": center,
        "velocity": [*scene.velocity, 0.0],
        "angular_velocity": scene.spin * axes(orientation),
        "orientation": orientation,
        "ring_angular_velocity": [0.0, 0.0, 0.0],
        "ring_orientation": [1.0, 0.0, 0.0, 0.0],
    }
    vectors = {name: np.tile(value, (1, replicas, 1)) for name, value in state.items()}
    sums = {name: np.zeros((1, replicas)) for name in MotorStates._fields[-4:]}
    return MotorStates(time=np.zeros(1), **vectors, **sums)
