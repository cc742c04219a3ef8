"""Whether limits of joints keep magnets apart: they are soft like contacts, with the same rule."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.mjcf.checking.contact_rule import (
    SHORTEST,
    SLACK,
    Approach,
    longest_time_constant,
    shortest_kept,
    softness_of,
)
from magmotor.mjcf.checking.failure import rounded_down
from magmotor.mjcf.checking.reach import STRAIGHT, joints_between, reach
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.user_numbers import HINGE

BALL = int(mujoco.mjtJoint.mjJNT_BALL)


class SoftLimit(NamedTuple):
    """A limit of a joint that does not keep magnets apart."""

    joint: int
    constant: float
    """The longest time constant in s with which it does."""
    timestep: float
    """The longest timestep in s with that."""


def softest_limit(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    joints: Sequence[int],
    pull: tuple[float, float],
    room: float,
) -> SoftLimit | None:
    """Return the softest of the limits that are too soft to stop two magnets, if there are any.

    Each limit is judged as if the whole force of the magnets pushed against it, at the far end of a
    hinge's arm. Each may yield an equal share of the distance that they keep.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its positions are up to date.
    magnets : tuple of Magnet
        Only the second one may be a plane.
    joints : sequence of int
        The slides and hinges that have limits.
    pull : tuple of float
        The largest force in N that pushes against them, and its gradient in N/m.
    room : float
        The distance in m that the limits must keep, above 0.
    """
    force, gradient = pull
    if not (0 < force < np.inf and 0 < gradient < np.inf):
        return None
    shortest, excess, longest = shortest_kept(model, float(model.opt.timestep)), {}, {}
    for joint in joints:
        limit = softness_of(model.jnt_solref[joint], model.jnt_solimp[joint])
        mass = 1 / float(model.dof_invweight0[model.jnt_dofadr[joint]])
        if model.jnt_type[joint] == HINGE:
            mass /= max(_arm(model, data, joint, magnets, joints) ** 2, 1e-300)
        way = Approach(4 * force / gradient, force, mass, mass, room / len(joints))
        longest[joint] = longest_time_constant(way, limit)
        excess[joint] = limit.stiffness_time(shortest) / longest[joint]
        if model.opt.timestep * SHORTEST > SLACK * limit.resolved_time(shortest):
            excess[joint] = np.inf
    softest = max(excess, key=lambda joint: excess[joint])
    if excess[softest] <= 1:
        return None
    constant = rounded_down(longest[softest])
    stiff = softness_of(np.array([constant, 1.0]), model.jnt_solimp[softest])
    return SoftLimit(softest, constant, rounded_down(stiff.resolved_time(0.0) / SHORTEST))


def _arm(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    joint: int,
    magnets: tuple[Magnet, Magnet],
    walls: Sequence[int],
) -> float:
    """Return how far from the axis of a hinge the dipoles that it moves can be at most.

    `walls` are the joints that stop at their limits. Where a slide has none, it is how far they are
    at present.
    """
    axis, longest = data.xaxis[joint], 0.0
    for magnet in magnets:
        chain = joints_between(model, 0, magnet.body)
        if joint not in chain:
            continue
        turning = [j for j in chain if model.jnt_type[j] in (HINGE, BALL)]
        place = turning.index(joint)
        links = reach(model, data, magnet.body, 0, magnet.positions, walls).links[place + 1 :]
        own = [j for j in turning[place:] if model.jnt_type[j] == HINGE]
        parallel = np.linalg.norm(np.cross(data.xaxis[own], axis), axis=1) <= STRAIGHT
        across = axis if parallel.all() and len(own) == len(turning[place:]) else None
        arms = sum(link.lengths(across)[1] for link in links)
        if not np.isfinite(arms).all():
            places = magnet.positions - data.xanchor[joint]
            arms = np.linalg.norm(np.cross(places, axis), axis=1)
        longest = max(longest, float(np.max(arms)))
    return longest
