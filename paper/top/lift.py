"""Magnetic lift on the top's ball: the upward magnetic force over its weight.

The ball is at rest on the plane and leaves it where the lift exceeds 1.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize, root_scalar

from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.devices.ball.landscape import aligned_force, on_plane, packed_sources
from magmotor.devices.top.scene import Top
from magmotor.dipoles import force_of


class Lift(NamedTuple):
    """Largest lift on the plane."""

    aligned: float
    """Largest lift of a ball whose axis is along the field."""
    place: Array
    """Position of this lift in m, shape (2,)."""
    any_axis: float
    """Largest lift of a ball over all directions of its axis."""


def lift_map(scene: Top, points: ArrayLike) -> tuple[Array, Array]:
    """Compute the lift of a ball whose axis is along the field.

    Parameters
    ----------
    scene : Top
    points : array_like, shape (..., 2)
        Contact points on the plane, in m.

    Returns
    -------
    lift : ndarray, shape (...)
        Vertical magnetic force over weight.
    axis : ndarray, shape (..., 3)
        Unit vector.
    """
    force, axis = aligned_force(scene, points)
    return force[..., 2] / scene.weight, axis


def largest_lift_map(scene: Top, points: ArrayLike) -> Array:
    """Compute the largest lift of a ball over all directions of its axis.

    It is |m dB/dz| over the weight; the components of m dB/dz are the vertical forces on dipoles
    along the coordinate axes.

    Parameters
    ----------
    scene : Top
    points : array_like, shape (..., 2)
        Contact points on the plane, in m.

    Returns
    -------
    ndarray, shape (...)
        Vertical magnetic force over weight.
    """
    center = on_plane(scene, check_array("points", points, ..., 2))
    sources = packed_sources(scene)
    moments = [np.broadcast_to(unit, center.shape) for unit in scene.moment * np.eye(3)]
    lifts = [force_of(center, moment, sources)[..., 2] for moment in moments]
    return np.linalg.norm(lifts, axis=0) / scene.weight


@cache
def largest_lift(scene: Top) -> Lift:
    """Find the largest lift on the plane by local searches from the best points of a grid.

    Parameters
    ----------
    scene : Top

    Returns
    -------
    Lift
    """
    aligned, place = _largest(scene, lambda points: lift_map(scene, points)[0])
    return Lift(aligned, place, _largest(scene, lambda points: largest_lift_map(scene, points))[0])


def critical_height(scene: Top) -> float:
    """Find the height of the ring, in m, at which the largest lift of an aligned ball is 1.

    Parameters
    ----------
    scene : Top
        Its `ring_height` is not used.

    Raises
    ------
    ValueError
        There is no such height between 2.5 ball radii and 2 ring radii.
    """

    def excess(height: float) -> float:
        return np.log(largest_lift(scene.replace(ring_height=height)).aligned)

    ends = 2.5 * scene.ball_radius, 2 * scene.ring_radius
    return float(root_scalar(excess, bracket=ends, rtol=1e-4).root)


def _largest(scene: Top, lift: Callable[[Array], Array]) -> tuple[float, Array]:
    side = 1.3 * scene.ring_radius * np.linspace(-1, 1, 121)
    grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    best = grid[np.argsort(lift(grid))[-3:]]
    options = {"xatol": 1e-6, "fatol": 1e-9}
    found = [
        minimize(lambda point: -float(lift(point)), start, method="Nelder-Mead", options=options)
        for start in best
    ]
    highest = min(found, key=lambda result: result.fun)
    return -float(highest.fun), highest.x
