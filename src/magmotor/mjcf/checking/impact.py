"""How deep magnets that fall from far away penetrate each other in a soft contact.

It is computed along the line between them, step by step as MuJoCo does. With x = r/d, and the
time in units of T = sqrt(d m/F), the pull is 1/(1 - x)^4, and the speed as they meet is
sqrt(2/3). See docs/contact.md.
"""

import math

import numpy as np

from magmotor.mjcf.checking.contact_rule import FALL, Approach, Softness

PHASES = 200
"""Number of moments within a timestep at which the magnets touch."""

FASTER = 1.02
"""Speed over that of magnets that fall from infinity, since timesteps add some energy."""

LOST = 0.9
"""Penetration over the distance at touch from which nothing comes back."""

FINEST, LONGEST = 100, 4000
"""Most steps per time constant or per T, and of a whole run."""


def deepest_impact(approach: Approach, contact: Softness, constant: float, step: float) -> float:
    """Return the largest penetration over the distance at touch; infinite if they fly apart.

    Parameters
    ----------
    approach : Approach
    contact : Softness
    constant : float
        Time constant times damping ratio, in s.
    step : float
        Timestep in s.
    """
    s = constant / approach.fall_time
    h = max(step / approach.fall_time, min(s, 1.0) / FINEST)
    largest = contact.solimp[1]
    stiffness, damping = 1 / (largest * s) ** 2, 2 * contact.ratio / (largest * s)
    softening = contact.cone * approach.least_mass / approach.mass
    first = -min(1.0, 30 * h)
    x = first - np.arange(PHASES) / PHASES * h * FALL / (1 - first) ** 1.5
    u, deepest = FASTER * FALL / (1 - x) ** 1.5, 0.0
    for _ in range(LONGEST):
        pull = (1 - x) ** -4
        impedance = contact.impedance(np.maximum(x, 0) * approach.distance)
        push = pull + damping * u + stiffness * impedance * x
        push /= 1 + softening * (1 - impedance) / impedance
        u = u + h * (pull - np.where(x > 0, np.maximum(push, 0), 0))
        x = x + h * u
        deepest = max(deepest, float(x.max()))
        if deepest > LOST:
            return math.inf
        moving = u > 0
        if not moving.any():
            break
        x, u = x[moving], u[moving]
    return deepest
