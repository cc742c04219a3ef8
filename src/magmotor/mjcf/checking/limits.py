"""Whether limits of joints keep magnets apart: they are soft like contacts, with the same rule."""

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.contact_rule import (
    SHORTEST,
    SLACK,
    Approach,
    longest_time_constant,
    shortest_kept,
    softness_of,
)
from magmotor.mjcf.checking.reach import limited_slides
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.checking.touch import attraction


def soft_limit(
    model: mujoco.MjModel,
    magnets: tuple[Magnet, Magnet],
    ancestor: int,
    gaps: tuple[Array, Array],
    factor: Array,
    masses: tuple[float, float],
) -> int:
    """Return a slide whose limit is too soft to keep two magnets apart, or -1.

    Parameters
    ----------
    model : mujoco.MjModel
    magnets : tuple of Magnet
        Only the second one may be a plane.
    ancestor : int
        The lowest body that both hang on.
    gaps : tuple of ndarray
        How near their dipoles and their geoms come to each other at least, in m, all above 0.
    factor : ndarray, shape (n, m)
        How strongly their dipoles act on one another.
    masses : tuple of float
        Reduced masses, as for `closest_approach`.
    """
    one, other = magnets
    slides = [j for magnet in magnets for j in limited_slides(model, magnet.body, ancestor)]
    distance, room = gaps[0], min(gap.min(initial=np.inf) for gap in gaps)
    if other.images:
        distance = distance + distance.T
    force, gradient = attraction(one, other, distance, factor)
    if not (slides and 0 < force < np.inf and 0 < gradient < np.inf):
        return -1
    shortest, excess = shortest_kept(model, float(model.opt.timestep)), {}
    for joint in slides:
        limit = softness_of(model.jnt_solref[joint], model.jnt_solimp[joint])
        mass = 1 / float(model.dof_invweight0[model.jnt_dofadr[joint]])
        way = Approach(4 * force / gradient, force, mass, masses[1], room / len(slides))
        excess[joint] = limit.stiffness_time(shortest) / longest_time_constant(way, limit)
        if model.opt.timestep * SHORTEST > SLACK * limit.resolved_time(shortest):
            excess[joint] = np.inf
    worst = max(excess, key=lambda joint: excess[joint])
    return worst if excess[worst] > 1 else -1
