"""The timesteps at which methods become linearly unstable."""

import math
from functools import lru_cache

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.device.device import Scene
from magmotor.numerics.linear_stability import (
    SmallMotion,
    StableSteps,
    Step,
    euler_step,
    implicit_step,
    runge_kutta_step,
    splitting_step,
)
from magmotor.numerics.splittings import SPLITTINGS

STEPS: dict[str, Step] = {
    "euler": euler_step,
    "cayley": euler_step,
    "implicitfast": implicit_step,
    "rk4": runge_kutta_step,
    **{name: splitting_step(s.parts, s.fractions, exact=s.exact) for name, s in SPLITTINGS.items()},
}
"""What a step of each scheme does to small motions; by the Cayley map it is Euler's."""

SLACK = 1e-6
"""Part by which a step stays short of its limit, which is found to about this."""


@checked
@lru_cache
def small_motion(scene: Scene) -> SmallMotion:
    """A scene about rest: the ball in the deepest minimum of V_e with its axis along the field.

    The motor's ring is level, or almost: its tilt balances the ball. The disk is where U is
    steepest. A scripted ring stands where it begins. Coordinates are x and y of the ball, its turns
    about x, y and z and those of the ring, in m and rad; x and theta of the disk.
    """
    return scene.device.small_motion(scene)


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
    device = scene.device
    limits = [_stable_steps(pose, STEPS[scheme]).end(enough) for pose in device.poses(scene)]
    return min(*limits, device.contact_limit(scene, method))


@lru_cache
def _stable_steps(scene: Scene, step: Step) -> StableSteps:
    return StableSteps(small_motion(scene), step)


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
        raise reject("timestep", timestep, f"must be less than {limit:.4g}, {why}")
