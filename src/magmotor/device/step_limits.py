"""The largest timesteps at which methods are linearly stable."""

import math
from functools import lru_cache

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
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
"""The linearized step of each scheme; with the Cayley map it is the same as Euler's."""

SLACK = 1e-6
"""Relative margin below the limit, which is found to about this accuracy."""


@checked
@lru_cache
def small_motion(scene: Scene) -> SmallMotion:
    """Linearize a scene about rest: the ball in the deepest minimum of V_e, its axis along B.

    The motor's ring is level, or almost: its tilt balances the ball. The disk is where |U''| is
    largest. A scripted ring is at its first waypoint. The coordinates are x and y of the ball, its
    rotations about x, y and z, and those of the ring, in m and rad; for the disk, x and theta.
    """
    return scene.device.small_motion(scene)


def step_limit(scene: Scene, method: str, enough: float = math.inf) -> float:
    """Return the largest timestep, in s, at which a method is linearly stable about rest.

    It is infinite for `scipy/dop853`, which chooses its steps. See `magmotor.theory.small_motion`
    for the state of rest; the contact of a ball with a plane that bears it has its own limit. If
    the ring follows a script, the stiffest waypoint counts. If the limit exceeds `enough`, the
    result may be any time above `enough`, which is faster to find.
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
    """Check that a method is linearly stable at a timestep.

    Raises
    ------
    ValueError
        The method is unstable; the message names the timestep and the limit.
    """
    limit = step_limit(scene, method, enough=(1 + 2 * SLACK) * timestep)
    if timestep >= (1 - SLACK) * limit:
        why = "the linear limit: beyond it, the smallest motion about rest grows"
        raise ArgumentError("timestep", timestep, f"must be less than {limit:.4g}, {why}")
