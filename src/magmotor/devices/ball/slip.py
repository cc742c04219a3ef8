"""The slip of a ball on its plane."""

import math

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.hints import NotNegative, Vectors
from magmotor.devices.ball.scene import BallScene
from magmotor.dipoles import PERMEABILITY_OVER_4PI


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


@checked
def eddy_drag(scene: BallScene, conductivity: NotNegative) -> float:
    """Return the drag by eddy currents in a conducting floor, in kg/s: force = -drag v.

    mu_0^2 sigma m^2/(128 pi h^3) is that on a vertical dipole at the height h = r above a
    half-space, along which it moves slowly. It acts on the velocity v of the center, not on the
    slip.

    Parameters
    ----------
    scene : Top or Motor
    conductivity : float
        In S/m; 3.5e7 for aluminum.
    """
    permeability = 4 * math.pi * PERMEABILITY_OVER_4PI
    strength = (permeability * scene.moment) ** 2 * conductivity
    return strength / (128 * math.pi * scene.ball_radius**3)


def mobility(mass: float, radius: float, inertia: float) -> float:
    """Return the mobility A = 1/m + r^2/I of the slip, in 1/kg: its acceleration per force."""
    return 1 / mass + radius**2 / inertia
