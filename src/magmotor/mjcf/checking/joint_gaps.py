"""How near the dipoles and the geoms of two magnets come to each other, as their joints say."""

from collections.abc import Collection

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.geoms import bounding_radii
from magmotor.mjcf.checking.reach import Reach, common_ancestor, reach
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.checking.swept import swept_gaps, swept_joints
from magmotor.mjcf.declarations.iron import PLANE


def possible_rows(
    touching: NDArray, geoms: list[NDArray], gaps: Array, *, whole: bool
) -> NDArray[np.int64]:
    """Return the rows of two geoms that can touch, by lower bounds of their distances.

    If `whole`, they are all rows, or none.
    """
    if whole:
        return touching if (gaps <= 0).any() else touching[:0]
    swapped = ~np.isin(touching[:, 0], geoms[0])
    first, second = np.where(swapped, touching[:, [1, 0]].T, touching[:, :2].T)
    places = np.searchsorted(geoms[0], first), np.searchsorted(geoms[1], second)
    return touching[gaps[places] <= 0]


def gaps_of(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    geoms: list[NDArray],
    level: float,
    walls: Collection[int],
) -> tuple[Array, Array]:
    """Return how near dipoles, and geoms, of two magnets come to each other at least.

    The columns are those of the other magnet; a plane has one, at the height `level` above it.
    `walls` are the joints that stop at their limits.
    """
    one, other = magnets
    ancestor = common_ancestor(model, one.body, other.body)
    bodies = one.body, other.body
    found, swept = [], swept_joints(model, *bodies, walls)
    for places in ([m.positions for m in magnets], [data.geom_xpos[own] for own in geoms]):
        reaches = [
            reach(model, data, magnet.body, ancestor, points, walls)
            for magnet, points in zip(magnets, places, strict=True)
        ]
        sizes = [bounding_radii(model, own) if found else np.zeros(1) for own in geoms]

        if other.images and ancestor != other.body:
            found.append(np.zeros((len(places[0]), 1)))
        elif other.images:
            plane = int(other.elements[0]) - model.nsite
            lowest = _lowest(model, data, reaches[0], places[0], plane, swept, walls, bodies)
            found.append((lowest - sizes[0] - level)[:, np.newaxis])
        else:
            least = reaches[0].gaps(reaches[1])
            if swept and least.size:
                within = swept_gaps(model, data, swept, walls, bodies, places)
                least = np.maximum(least, within)
            least = least - np.add.outer(*sizes)
            found.append(least)
    if not other.images:
        of_geoms = found[1]
        for side, rows in ((0, of_geoms), (1, of_geoms.T)):
            planes = [k for k in range(len(rows)) if model.geom_type[geoms[side][k]] == PLANE]
            ways = bodies[1 - side], bodies[side]
            for k in planes if bodies[side] == ancestor else ():
                lowest = _lowest(
                    model, data, reaches[1 - side], places[1 - side], geoms[side][k], swept, walls,
                    ways,
                )  # fmt: skip
                rows[k] = lowest - sizes[1 - side]
    return found[0], found[1]


def _lowest(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    own: Reach,
    points: Array,
    plane: int,
    joints: list[int],
    walls: Collection[int],
    bodies: tuple[int, int],
) -> Array:
    """Return how high the points of the first body stay at least above a plane of the second."""
    point, normal = data.geom_xpos[[plane]], data.geom_xmat[plane, 2::3]
    lowest = own.lowest(point[0], normal)
    if joints and lowest.size:
        within = swept_gaps(model, data, joints, walls, bodies, [points, point], normal)
        lowest = np.maximum(lowest, within[:, 0])
    return lowest


def room_of(gaps: tuple[Array, Array], bare: NDArray[np.bool_]) -> float:
    """Return the distance that limits keep: of bare dipoles, or of geoms; 0 if they keep none."""
    of_dipoles, of_geoms = gaps
    geoms = of_geoms.min(initial=np.inf)
    room = min(of_dipoles.min(), geoms) if geoms > 0 else of_dipoles[bare].min(initial=np.inf)
    return float(room) if np.isfinite(room) else 0.0
