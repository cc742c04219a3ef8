"""Whether limits of joints keep magnets apart: they are soft like contacts, with the same rule."""

from collections.abc import Sequence

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.attraction import attraction
from magmotor.mjcf.checking.contact_rule import (
    SHORTEST,
    SLACK,
    Approach,
    longest_time_constant,
    shortest_kept,
    softness_of,
)
from magmotor.mjcf.checking.strengths import Magnet


def softest_limit(
    model: mujoco.MjModel,
    magnets: tuple[Magnet, Magnet],
    slides: Sequence[int],
    gaps: tuple[Array, Array],
    factor: Array,
) -> int:
    """Return the slide whose limit is the softest of those too soft to stop two magnets, or -1.

    Each limit is judged as if the whole force of the magnets pushed against it. Each may yield an
    equal share of the distance that they keep.

    Parameters
    ----------
    model : mujoco.MjModel
    magnets : tuple of Magnet
        Only the second one may be a plane.
    slides : sequence of int
        The slides that have limits.
    gaps : tuple of ndarray
        How near their dipoles and their geoms come to each other at least, in m, all above 0.
    factor : ndarray, shape (n, m)
        How strongly their dipoles act on one another.
    """
    one, other = magnets
    distance, room = gaps[0], min(gap.min(initial=np.inf) for gap in gaps)
    if other.images:
        distance = distance + distance.T
    force, gradient = attraction(one, other, distance, factor)
    if not (0 < force < np.inf and 0 < gradient < np.inf):
        return -1
    shortest, excess = shortest_kept(model, float(model.opt.timestep)), {}
    for joint in slides:
        limit = softness_of(model.jnt_solref[joint], model.jnt_solimp[joint])
        mass = 1 / float(model.dof_invweight0[model.jnt_dofadr[joint]])
        way = Approach(4 * force / gradient, force, mass, mass, room / len(slides))
        excess[joint] = limit.stiffness_time(shortest) / longest_time_constant(way, limit)
        if model.opt.timestep * SHORTEST > SLACK * limit.resolved_time(shortest):
            excess[joint] = np.inf
    softest = max(excess, key=lambda joint: excess[joint])
    return softest if excess[softest] > 1 else -1
