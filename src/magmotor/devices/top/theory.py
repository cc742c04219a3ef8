"""Closed forms of Hamel's top, each with its source in the paper."""

import math

from magmotor.common.arguments import NotNegative, checked
from magmotor.devices.top.scene import Top
from magmotor.dipoles import PERMEABILITY_OVER_4PI


@checked
def field_under_centre(scene: Top) -> float:
    """|B| in tesla at the ball's height under the centre of a level ring.

    B_z = 3 N (mu0 m/(4 pi)) R h/(R^2 + h^2)^(5/2), h = H - r: the sum of (magneticfield) over the
    ring, exact for any number N of dipoles.
    """
    height = scene.ring_height - scene.ball_radius
    strength = PERMEABILITY_OVER_4PI * scene.moment * scene.ring_dipoles
    distance = math.hypot(scene.ring_radius, height)
    return 3 * strength * scene.ring_radius * abs(height) / distance**5


@checked
def libration_frequency(scene: Top, field: NotNegative) -> float:
    """Angular frequency sqrt(m |B|/I) in rad/s of the axis about a field (tesla) at rest.

    Linearised Lie-Poisson equation (magtopc) of a ball that does not spin.
    """
    return math.sqrt(scene.moment * field / scene.inertia[0])


@checked
def slip_relaxation_rate(scene: Top) -> float:
    """Rate c (1/m + r^2/I) in 1/s at which friction alone makes the slip velocity decay.

    Of a ball that turns freely; one whose axis the field holds slips longer. From equation
    (magtopnc): dV_Q/dt = -c V_Q/m + (torque r c V_Q)/I in the plane.
    """
    return scene.friction * (1 / scene.ball_mass + scene.ball_radius**2 / scene.inertia[0])


@checked
def highest_valley(scene: Top) -> float:
    """Height of a level ring, in m, above which the ball's place under its centre is stable.

    Below, the effective potential has a maximum there and a circular valley around it. Near the
    axis B.B = f^2 + rho^2 (f'^2/4 - f f''/2) with f = B_z on the axis, the field of
    `field_under_centre`; the bracket vanishes at (H - r)/R = sqrt((11 + sqrt(145))/24) = 0.980.
    """
    return scene.ball_radius + math.sqrt((11 + math.sqrt(145)) / 24) * scene.ring_radius
