"""The timesteps at which methods become linearly unstable."""

import math
from functools import lru_cache

from magmotor.checks import check_number, reject
from magmotor.engines.variational.schemes import SPLITTINGS
from magmotor.scenes import Disk, LangevinParticle, Motor, Top
from magmotor.scenes.top import CONTACT_RATE
from magmotor.theory.linear import (
    StableSteps,
    Step,
    euler_step,
    implicit_step,
    runge_kutta_step,
    splitting_step,
)
from magmotor.theory.linear_scenes import poses, small_motion

Scene = Top | Motor | Disk | LangevinParticle

STEPS: dict[str, Step] = {
    "euler": euler_step,
    "cayley": euler_step,
    "implicitfast": implicit_step,
    "rk4": runge_kutta_step,
    **{name: splitting_step(s.parts, s.fractions, exact=s.exact) for name, s in SPLITTINGS.items()},
}
"""What a step of each scheme does to small motions; by the Cayley map it is Euler's."""

BEARING = {"rk4": 2.785 / CONTACT_RATE}
"""Step (s) at which the bearing contact of a plane becomes unstable; else (2 sqrt 2 - 2)/rate."""

SLACK = 1e-6
"""Part by which a step stays short of its limit, which is found to about this."""


def step_limit(scene: Scene, method: str, enough: float = math.inf) -> float:
    """Largest timestep, in s, at which a method keeps a scene at rest, from linear theory.

    Infinite for `scipy/dop853`, which chooses its steps. See `magmotor.theory.small_motion` for the
    resting state; on a plane that bears a ball the contact has a limit of its own. Where the ring
    follows a script, the stiffest of its waypoints counts. For a limit longer than `enough` another
    such time may stand, which costs less to find.
    """
    scheme = method.split("/")[1]
    if scheme == "dop853":
        return math.inf
    if isinstance(scene, Top) and scene.ring_script:
        return min(step_limit(pose, method, enough) for pose in poses(scene))
    limit = _stable_steps(scene, STEPS[scheme]).end(enough)
    borne = isinstance(scene, Top | Motor) and scene.surface == "plane"
    return min(limit, bearing_limit(method)) if borne else limit


@lru_cache
def _stable_steps(scene: Scene, step: Step) -> StableSteps:
    return StableSteps(small_motion(scene), step)


def bearing_limit(method: str) -> float:
    """Step, in s, at which the contact that bears a ball on a plane becomes unstable."""
    return BEARING.get(method.split("/")[1], (2 * math.sqrt(2) - 2) / CONTACT_RATE)


def check_bearing_limit(method: str, timestep: float) -> None:
    """Check a timestep against the contact that bears a ball on a plane.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = bearing_limit(method)
    check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")


def check_step_limit(scene: Scene, method: str, timestep: float) -> None:
    """Check a timestep against linear theory.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = step_limit(scene, method, enough=(1 + 2 * SLACK) * timestep)
    if timestep >= (1 - SLACK) * limit:
        why = "the linear limit: beyond it, the smallest motion about rest grows"
        raise reject("timestep", timestep, f"less than {limit:.4g}, {why}")
