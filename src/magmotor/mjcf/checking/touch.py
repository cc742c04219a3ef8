"""What pulls two magnets in the pose in which they touch.

Two magnets touch with those points of their surfaces that are nearest to one dipole of each. In
this pose the distance of any two of their dipoles is at least that of their depths below the common
tangent plane, and of their distances from its normal. A plane of iron is touched with the surface
that is nearest to one dipole; the images are as far below it as the dipoles are above it.
"""

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf.checking.contact_rule import Approach
from magmotor.mjcf.checking.depth import NEVER, depth_and_normal
from magmotor.mjcf.checking.strengths import Magnet

SURFACE = 0.02
"""Depth, over the distance at touch, at which a dipole counts as one at the surface."""

INSIDE = 1 / 3
"""Depth, over the smaller one of two dipoles, at which what is between them is in their piece."""

ALIGNED = 0.87
"""Cosine of the angle below which two neighbors count as neighbors in one direction."""

PARALLEL = 0.99
"""Cosine of the angle below which two dipoles may represent one magnet."""


class Spacing(NamedTuple):
    """How near dipoles of two magnets come to each other, and to others of their own magnet."""

    apart: float
    """In m."""
    within: float
    """In m; 0 for dipoles that are alone."""


class Side:
    """The dipoles of a magnet below the surfaces of its geoms.

    `margin` is the distance from these surfaces at which they begin to push, in m.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        magnet: Magnet,
        geoms: NDArray,
        margin: float,
    ) -> None:
        self.magnet, self._places = magnet, magnet.positions
        self._surface = [
            lambda points, geom=geom: depth_and_normal(model, data, geom, points)
            for geom in geoms.tolist()
        ]
        self._margin = margin
        self.depth, self._normal = self._below(self._places)

    def _below(self, points: Array) -> tuple[Array, Array]:
        """Return the depths of points, and the normals of the surfaces nearest to them."""
        deepest, normals = np.full(len(points), NEVER), np.tile([0.0, 0, 1], (len(points), 1))
        for surface in self._surface:
            depth, normal = surface(points)
            deeper = depth > deepest
            deepest[deeper], normals[deeper] = depth[deeper], normal[deeper]
        return deepest + self._margin, normals

    def along(self, i: int) -> Array:
        """Return the depths of all dipoles below the tangent plane that is nearest to dipole i."""
        below = self.depth[i] + (self._places[i] - self._places) @ self._normal[i]
        return np.maximum(below, self.depth)

    def aside(self, i: int) -> Array:
        """Return the offsets of all dipoles from that plane's normal through dipole i, (n, 3)."""
        offset = self._places - self._places[i]
        return offset - np.outer(offset @ self._normal[i], self._normal[i])

    def distinct(self) -> NDArray[np.int64]:
        """Return one dipole of each kind, to which all others lie alike."""
        kinds, whole = {}, self.magnet
        scale = max(abs(self.depth).max(), 1e-12)
        for i in range(len(self.depth)):
            aside = np.linalg.norm(self.aside(i), axis=1)
            places = np.round(np.column_stack([self.along(i), aside]) / scale, 6)
            rows = np.column_stack([places, whole.strengths, whole.responses, whole.bodies]) + 0.0
            kinds.setdefault((self.depth[i].round(12), rows[np.lexsort(rows.T)].tobytes()), i)
        return np.array([*kinds.values()])

    def spacing(self, i: int) -> float:
        """Return how far dipole i is from the nearest others of its piece.

        It is the distance of the nearest one in the second direction, if there is any, since rows
        may be denser than they are apart; 0 for a dipole that is alone in its piece.
        """
        offset = self._places - self._places[i]
        length = np.linalg.norm(offset, axis=1)
        depth, _ = self._below(self._places[i] + offset / 2)
        near = depth > INSIDE * np.minimum(self.depth, self.depth[i])
        near &= (self.magnet.axes @ self.magnet.axes[i] > PARALLEL) & (length > 0)
        if not near.any():
            return 0.0
        offset, length = offset[near], length[near]
        first = length.argmin()
        others = abs(offset @ offset[first]) < ALIGNED * length * length[first]
        return float(length[others].min() if others.any() else length[first])


def closest_approach(
    sides: tuple[Side, Side], apart: Array, factor: Array, inverse_mass: float
) -> Approach | None:
    """Return the closest approach of two magnets; None if nothing attracts them.

    Parameters
    ----------
    sides : tuple of Side
        Only the second one may be a plane.
    apart : ndarray, shape (n, m)
        Least distances of dipoles of one from those of the other, or heights above the plane;
        infinite for those that do not act or that nothing keeps apart.
    factor : ndarray, shape (n, m)
        How strongly they act on one another.
    inverse_mass : float
        That of the reduced mass, in 1/kg.
    """
    one, other = (side.magnet for side in sides)
    weight, partner = np.where(apart < np.inf, factor, 0), other
    if other.images:
        weight, partner = weight * (weight.T > 0), one
    force = gradient = 0.0
    poses = np.stack(np.meshgrid(*(side.distinct() for side in sides)), axis=-1).reshape(-1, 2)
    for i, j in poses[apart[tuple(poses.T)] < np.inf].tolist() if weight.any() else ():
        distance = np.maximum(_distances(sides, i, j), COINCIDENCE)
        pull, power = _pull(one, partner, distance, weight, other.images or 1.0)
        slope = float((power * pull / distance).sum()) * (2 if other.images else 1)
        force, gradient = max((force, gradient), (float(pull.sum()), slope))
    if not (0 < force < np.inf and 0 < gradient < np.inf and inverse_mass > 0):
        return None  # as for a needle that only turns about its center
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    depths = np.array([side.depth[n] for side, n in zip(sides, nearest, strict=True)])
    depth = depths[depths > SURFACE * depths.sum()].min()
    return Approach(4 * force / gradient, force, 1 / inverse_mass, float(depth))


def coarsest(sides: tuple[Side, Side], apart: Array) -> Spacing:
    """Return the coarsest spacing where two magnets touch; `apart` as for `closest_approach`."""
    held = (apart < np.inf).nonzero()
    within = [np.zeros(length) for length in apart.shape]
    for side, found, dipoles in zip(sides, within, held, strict=True):
        for i in np.unique(dipoles).tolist():
            found[i] = side.spacing(i)
    spacing = np.maximum.outer(*within)
    distance = apart * (2 if sides[1].magnet.images else 1)
    worst = np.unravel_index((spacing / distance).argmax(), distance.shape)
    return Spacing(float(distance[worst]), float(spacing[worst]))


def _distances(sides: tuple[Side, Side], i: int, j: int) -> Array:
    """Return the distances of all dipoles, or images, in the pose where i and j are nearest."""
    one, other = sides
    if other.magnet.images:
        height, aside = one.along(i) + other.depth[j], one.aside(i)
        sideways = np.linalg.norm(aside[:, np.newaxis] - aside, axis=2)
        return np.hypot(height[:, np.newaxis] + height, sideways)
    first, second = (np.linalg.norm(each, axis=1) for each in (one.aside(i), other.aside(j)))
    return np.hypot(one.along(i)[:, np.newaxis] + other.along(j), first[:, np.newaxis] - second)


def _pull(
    one: Magnet, other: Magnet, distance: Array, factor: Array, images: float
) -> tuple[Array, Array]:
    """Return the forces with aligned moments of all pairs of dipoles, and their powers of 1/d.

    The power is 4, or 7 for iron that is not saturated. Dipoles of both sides magnetize it.
    """
    k, sides = PERMEABILITY_OVER_4PI, []
    for magnet, partner, away in ((one, other, distance), (other, one, distance.T)):
        within = np.linalg.norm(magnet.positions[:, np.newaxis] - magnet.positions, axis=2)
        within[within == 0] = np.inf
        near = images * partner.strengths / away**3
        field = 2 * k * (near.sum(axis=1) + (magnet.strengths / within**3).sum(axis=1))
        induced = magnet.responses * field
        free = (induced < magnet.saturations) & (magnet.responses > 0)
        sides.append((magnet.strengths + np.minimum(induced, magnet.saturations), free))
    (first, soft), (second, yielding) = sides
    power = 4 + 3 * np.logical_or.outer(soft, yielding)
    return 6 * k * factor * np.multiply.outer(first, second) / distance**4, power
