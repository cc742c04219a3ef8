"""The slip of a ball on its plane."""

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.hints import Vectors
from magmotor.devices.ball.scene import BallScene


@checked
def slip_velocity(scene: BallScene, velocity: Vectors, angular_velocity: Vectors) -> Array:
    """Return the slip velocity V_Q = v + omega x q, q = -r e_z, of the contact point; (slip).

    Parameters
    ----------
    velocity, angular_velocity : ndarray, shape (..., 3)
        In m/s and rad/s, in the world frame.

    Returns
    -------
    ndarray, shape (..., 3)
        In m/s.
    """
    return velocity + np.cross(angular_velocity, [0.0, 0.0, -scene.ball_radius])


def mobility(mass: float, radius: float, inertia: float) -> float:
    """Return the mobility A = 1/m + r^2/I of the slip, in 1/kg: its acceleration per force."""
    return 1 / mass + radius**2 / inertia
