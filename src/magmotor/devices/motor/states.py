"""Recorded states of the motor."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor import dipoles
from magmotor.devices.ball.landscape import valley_radius
from magmotor.devices.ball.states import axes, smallest_turn
from magmotor.devices.motor.scene import Motor


class MotorStates(NamedTuple):
    """Recorded states, shape (T, replicas) or (T, replicas, n) but for time, which is (T,).

    Vectors are in the world frame, orientations quaternions (w, x, y, z). Heat and work count from
    the start of the run: `heat` what friction has taken from the ball's slip and from the ring,
    `work` what their noises have done, the Stratonovich integrals.
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
    """The scene's own initial state, the same in each replica: the ring level and at rest."""
    position = scene.position or (valley_radius(scene), 0.0)
    center = np.array([*position, scene.ball_radius])
    axis = scene.axis or dipoles.field(center, *scene.ring_sources())
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
    none = {name: np.zeros((1, replicas)) for name in MotorStates._fields[-4:]}
    return MotorStates(time=np.zeros(1), **vectors, **none)
