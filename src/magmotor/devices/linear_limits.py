"""The timesteps at which methods become linearly unstable."""

import math

from magmotor.checks import check_number, reject
from magmotor.scenes.top import CONTACT_RATE

LARGEST_DECAY = {"euler": 2.0, "cayley": 2.0, "rk4": 2.785}
"""Product of step and friction rate at which a scheme with explicit friction becomes unstable."""

LARGEST_SWING = {"rk4": 2 * math.sqrt(2)}
"""Product of step and frequency likewise; 2 for all the schemes that kick and drift."""

BEARING = {"mujoco/rk4": 2.785 / CONTACT_RATE}
"""Step (s) at which the bearing contact of a plane becomes unstable; else (2 sqrt 2 - 2)/rate."""


def check_bearing_limit(method: str, timestep: float) -> None:
    """Check a timestep against the contact that bears a ball on a plane.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = BEARING.get(method, (2 * math.sqrt(2) - 2) / CONTACT_RATE)
    check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")


def check_linear_limits(
    method: str,
    timestep: float,
    *,
    friction_limit: float,
    swing_limit: float,
    swing: str,
    always_explicit: bool,
) -> None:
    """Check a timestep against the linear limits of its method.

    Parameters
    ----------
    method : str
    timestep : float
    friction_limit : float
        The longest step of Euler's scheme that the friction bears, 2 over its rate.
    swing_limit : float
        The longest step of a kick and drift that the stiffest well bears, 2 over its frequency.
    swing : str
        What to call that well in the message.
    always_explicit : bool
        Friction acts explicitly in the schemes of MuJoCo, too, that treat dampers implicitly: a
        contact does.

    Raises
    ------
    ValueError
        Names the timestep, the limit, and what sets it.
    """
    scheme = method.split("/")[1]
    explicit = always_explicit and scheme != "baoab"
    decay = LARGEST_DECAY.get(scheme, 2.0 if explicit else math.inf)
    rate = LARGEST_SWING.get(scheme, 2.0)
    limits = {
        f"{rate:.4g}/{swing}": swing_limit * rate / 2,
        f"{decay:.4g}/lambda, the friction's": friction_limit * decay / 2,
    }
    why, limit = min(limits.items(), key=lambda item: item[1])
    if timestep >= limit:
        raise reject("timestep", timestep, f"less than {limit:.4g}, the linear limit {why}")
