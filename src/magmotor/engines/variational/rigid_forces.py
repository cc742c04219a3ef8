"""Magnetic forces and torques on a ball, and on a ring that turns above it."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.dipoles import NOBODY, sum_over_sources
from magmotor.rotations import columns, cross, place_dipoles, plus, scaled, third_axis


class Magnets(NamedTuple):
    """The dipoles of a scene; arrays as `dipoles.pack_sources` makes them.

    `fixed` are those at rest, `frame` those of the ring in its own frame, whose origin is at
    `height` on the axis z; the ball has one, `moment` in A m^2. The interaction of ring and ball
    counts `factor` times.
    """

    moment: float
    fixed: NDArray[np.float64]
    frame: NDArray[np.float64]
    height: float
    factor: float


@njit(inline="always")
def force_and_field(position, moment, sources):
    """Force on a dipole in the field of sources, and that field."""
    x, y, z = position
    mx, my, mz = moment
    total = sum_over_sources((x, y, z, mx, my, mz), NOBODY, sources, sources.shape[1])
    return (total[0], total[1], total[2]), (total[3], total[4], total[5])


@njit(inline="always")
def torque_about(centre, position, moment, force, field):
    """Torque about a point of what acts on a dipole."""
    return plus(cross(plus(position, -1.0, centre), force), 1.0, cross(moment, field))


@njit(inline="always")
def wrenches(place, ball, inner, ring, magnets):
    """Force and torque on the ball, and torque on the ring about its centre.

    Parameters
    ----------
    place, ball, inner
        Where the ball is, its orientation and that of the ring.
    ring : ndarray, shape of `magnets.frame`
        Room for the ring's dipoles in the world frame; their labels are there already.

    The torque on the ring is a reaction: about any point, what two bodies do to one another has no
    torque in total.
    """
    moment = scaled(magnets.moment, third_axis(ball))
    force, field = force_and_field(place, moment, magnets.fixed)
    reaction = (0.0, 0.0, 0.0)
    if ring.shape[1]:
        centre = (0.0, 0.0, magnets.height)
        place_dipoles(ring, columns(inner), centre, magnets.frame)
        near, nearby = force_and_field(place, moment, ring)
        force, field = plus(force, magnets.factor, near), plus(field, magnets.factor, nearby)
        on_ball = torque_about(centre, place, moment, near, nearby)
        reaction = scaled(magnets.factor, on_ball)
        for j in range(magnets.fixed.shape[1]):
            x, y, z, mx, my, mz, label = magnets.fixed[:, j]
            if label != NOBODY:
                pull, there = force_and_field((x, y, z), (mx, my, mz), ring)
                on_fixed = torque_about(centre, (x, y, z), (mx, my, mz), pull, there)
                reaction = plus(reaction, 1.0, on_fixed)
    return force, cross(moment, field), scaled(-1.0, reaction)
