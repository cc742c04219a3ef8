"""The upward magnetic force on the ball, over its weight."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize, root_scalar

from magmotor import dipoles
from magmotor.devices.ball.landscape import aligned_force, on_plane
from magmotor.devices.top.scene import Top

Array = NDArray[np.float64]


class Lift(NamedTuple):
    """The largest lift on the plane, over the weight."""

    aligned: float
    """Of a ball whose axis points along the field."""
    place: Array
    """Where that is, in m, shape (2,)."""
    any_axis: float
    """Of a ball whose axis points where it is lifted most."""


def lift_map(scene: Top, points: ArrayLike) -> tuple[Array, Array]:
    """Lift of the aligned ball over its weight, and its axis; shape (..., 2) -> (...), (..., 3)."""
    force, axis = aligned_force(scene, points)
    return force[..., 2] / (scene.ball_mass * scene.gravity), axis


def largest_lift(scene: Top) -> Lift:
    """The largest lift on the plane: of the best points of a grid, each made better."""
    aligned, place = _largest(scene, lambda points: lift_map(scene, points)[0])
    return Lift(aligned, place, _largest(scene, lambda points: any_axis(scene, points))[0])


def critical_height(scene: Top) -> float:
    """Height of the ring, in m, at which the lift of an aligned ball is its weight somewhere.

    Raises
    ------
    ValueError
        There is none between the ball's top and two ring radii.
    """

    def excess(height: float) -> float:
        return np.log(largest_lift(scene.replace(ring_height=height)).aligned)

    ends = 2.5 * scene.ball_radius, 2 * scene.ring_radius
    return float(root_scalar(excess, bracket=ends, rtol=1e-4).root)


def any_axis(scene: Top, points: Array) -> Array:
    """Length of m dB/dz, over the weight; its components are lifts of dipoles along the axes."""
    centre = on_plane(scene, points)
    sources = scene.ring_sources()
    units = scene.moment * np.eye(3)
    lifts = [dipoles.force_and_field(centre, unit, *sources)[0][..., 2] for unit in units]
    return np.linalg.norm(lifts, axis=0) / (scene.ball_mass * scene.gravity)


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
