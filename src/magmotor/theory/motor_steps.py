"""What a finite timestep does to the motor: biases and linear limits."""

import numpy as np

from magmotor.arguments import Seconds, checked
from magmotor.checks import check_number
from magmotor.scenes import Motor
from magmotor.theory.landscape import effective_potential, valley_radius
from magmotor.theory.motor import slip_mobility


@checked
def libration_frequency(scene: Motor) -> float:
    """Angular frequency sqrt(|V_e|/J_B), in rad/s, at which xi_3 swings about B in the valley."""
    deepest = float(effective_potential(scene, [valley_radius(scene), 0.0]))
    return float(np.sqrt(-deepest / scene.ball_inertia))


@checked
def euler_slip_overheating(scene: Motor, timestep: Seconds) -> float:
    """Factor 1/(1 - lambda h/2) by which explicit Euler overheats the slip, lambda = c_B A.

    That of the slip alone, V' = (1 - lambda h) V + alpha A sqrt(h) N(0, 1).

    Raises
    ------
    ValueError
        A step that is not in (0, 2/lambda).
    """
    rate = scene.friction_ball * slip_mobility(scene)
    check_number("timestep", timestep, above=0, below=2 / rate if rate else np.inf, unit="s")
    return 1 / (1 - rate * timestep / 2)
