"""What pulls two magnets in the pose in which they touch.

Two magnets touch with those points of their surfaces that are nearest to one dipole of each, or
with the sides of their geoms, so that one dipole of each is on a common normal, and with the axes
of their geoms along each other. A plane of iron is touched by one magnet in the orientations that
its geoms allow; the images are as far below it as the dipoles are above it.
"""

import itertools
from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf.checking.contact_rule import Approach
from magmotor.mjcf.checking.depth import NEVER, depth_and_normal, tangent_planes
from magmotor.mjcf.checking.stand_off import Stand, frame_of
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.unit_system import is_si
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

SURFACE = 0.02
"""Depth, over the distance at touch, at which a dipole counts as one at the surface."""

INSIDE = 1 / 3
"""Depth, over the smaller one of two dipoles, at which what is between them is in their piece."""

ALIGNED = 0.87
"""Cosine of the angle below which two neighbors count as neighbors in one direction."""

PARALLEL = 0.99
"""Cosine of the angle below which two dipoles may represent one magnet."""

WEAKEST = 0.15
"""Least polarization in T, over the box around it, of a geom that counts as one magnet.

In units that are not SI, a geom with dipoles in its middle always does.
"""

CENTERED = 0.02
"""Distance of dipoles' middle from that of their geom, over its size, that counts as none."""

POSES = 200
"""Largest number of poses, of those whose two dipoles come nearest to each other."""

AXES = 4
"""Largest number of dipoles' directions that are turned toward each other."""


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
        self._model, self._data, self._geoms = model, data, geoms
        self._surface = [
            lambda points, geom=geom: depth_and_normal(model, data, geom, points)
            for geom in geoms.tolist()
        ]
        self._margin = margin
        self.depth, normals = self._below(self._places)
        self.dipole, self._level, self._normal = np.arange(len(normals)), self.depth, normals
        axes = np.unique(np.round(magnet.axes[magnet.strengths > 0], 9), axis=0)
        axes = np.vstack([axes, -axes])[: 2 * AXES]
        planes = [tangent_planes(model, data, geom, axes) for geom in geoms.tolist()]
        found = {}  # parallel planes of many geoms differ in few levels
        for point, normal in itertools.chain.from_iterable(planes):
            below = (point - self._places) @ normal + margin
            lowest = np.flatnonzero(below < below.min() + 1e-6 * abs(below).max())
            levels = np.maximum(below, self.depth)[lowest]
            key = (normal.round(9) + 0.0).tobytes(), lowest.tobytes(), levels.round(12).tobytes()
            found.setdefault(key, (lowest, levels, np.tile(normal, (len(lowest), 1))))
        if found:
            lowest, levels, across = zip(*found.values(), strict=True)
            self.dipole = np.concatenate([self.dipole, *lowest])
            self._level = np.concatenate([self._level, *levels])
            self._normal = np.concatenate([self._normal, *across])
        if len(geoms):
            frame = data.geom_xmat[geoms[0]].reshape(3, 3)
            side = frame.T[abs(self._normal @ frame).argmin(axis=1)]
            side = side - (side * self._normal).sum(axis=1)[:, np.newaxis] * self._normal
            side /= np.linalg.norm(side, axis=1)[:, np.newaxis]
            both = side, np.cross(self._normal, side)
            vectors = magnet.strengths[:, np.newaxis] * magnet.axes
            self._planar, self._across = (
                both[0] @ each.T + 1j * (both[1] @ each.T) for each in (self._places, vectors)
            )
            self._along = self._normal @ vectors.T

    def _below(self, points: Array) -> tuple[Array, Array]:
        """Return the depths of points, and the normals of the surfaces nearest to them."""
        deepest, normals = np.full(len(points), NEVER), np.tile([0.0, 0, 1], (len(points), 1))
        for surface in self._surface:
            depth, normal = surface(points)
            deeper = depth > deepest
            deepest[deeper], normals[deeper] = depth[deeper], normal[deeper]
        return deepest + self._margin, normals

    def along(self, k: int) -> Array:
        """Return the depths of all dipoles below tangent plane k, that below which dipole[k] is."""
        below = self._level[k] + (self._places[self.dipole[k]] - self._places) @ self._normal[k]
        return np.maximum(below, self.depth)

    def aside(self, k: int) -> NDArray[np.complex128]:
        """Return the offsets of all dipoles from that plane's normal through dipole[k], (n,).

        They are complex numbers in the plane, whose real axis is along a side of the first geom.
        """
        return self._planar[k] - self._planar[k, self.dipole[k]]

    def moments(self, k: int) -> tuple[NDArray[np.complex128], Array]:
        """Return the parts of all moments in that plane, and along its normal, each (n,)."""
        return self._across[k], self._along[k]

    @cached_property
    def distinct(self) -> NDArray[np.int64]:
        """One tangent plane of each kind, to which all dipoles lie alike."""
        kinds, whole = {}, self.magnet
        scale = max(abs(self.depth).max(), 1e-12)
        largest = max(whole.strengths.max(), 1e-300)
        for k in range(len(self.dipole)):
            places = np.column_stack([self.along(k), abs(self.aside(k))])
            places = np.round(places / scale, 6)
            parts = np.column_stack([abs(self._across[k]), self._along[k]])
            rows = [places, np.round(parts / largest, 6), whole.responses, whole.bodies]
            rows = np.column_stack(rows) + 0.0
            kinds.setdefault((self._level[k].round(12), rows[np.lexsort(rows.T)].tobytes()), k)
        return np.array([*kinds.values()])

    def spacing(self, i: int) -> float:
        """Return how far dipole i is from the nearest others of its piece.

        It is the distance of the nearest one in the second direction, since rows may be denser than
        they are apart. In directions without others, it is the width of the geom that the dipoles
        represent. It is 0 for a dipole that is alone in its piece and represents no geom.
        """
        offset = self._places - self._places[i]
        length = np.linalg.norm(offset, axis=1)
        near = self.magnet.axes @ self.magnet.axes[i] > PARALLEL
        if not near.any():  # of iron
            return 0.0
        depth, _ = self._below(self._places[i] + offset[near] / 2)
        near[near] = depth > INSIDE * np.minimum(self.depth[near], self.depth[i])
        widths = self._widths(i, near)
        near &= length > 0
        if not near.any():
            return max(np.linalg.norm(widths, axis=1), default=0.0)
        offset, length = offset[near], length[near]
        first = length.argmin()
        others = np.vstack([offset, widths])
        sizes = np.linalg.norm(others, axis=1)
        aside = abs(others @ offset[first]) < ALIGNED * sizes * length[first]
        if aside[: len(offset)].any():
            return float(length[aside[: len(offset)]].min())
        return max([float(length[first]), *sizes[aside]])

    def _widths(self, i: int, own: NDArray[np.bool_]) -> Array:
        """Return the edges (3, 3) of a box around the geom that dipoles represent, or (0, 3).

        They are in its middle, and magnetize it as a permanent magnet is. A dipole in the center of
        a ball is exact.
        """
        none = np.zeros((0, 3))
        depths = [surface(self._places[[i]])[0][0] for surface in self._surface]
        geom = int(self._geoms[np.argmax(depths)])
        if not own.any() or self._model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE:
            return none
        center, half = self._model.geom_aabb[geom].reshape(2, 3)
        frame = self._data.geom_xmat[geom].reshape(3, 3)
        offset = self._places[own].mean(axis=0) - self._data.geom_xpos[geom] - frame @ center
        polarization = VACUUM_PERMEABILITY * self.magnet.strengths[own].sum() / (8 * half.prod())
        weak = is_si(self._model) and polarization < WEAKEST
        if np.linalg.norm(offset) > CENTERED * half.max() or weak:
            return none
        return 2 * half[:, np.newaxis] * frame.T


def closest_approach(
    sides: tuple[Side, Side], apart: Array, factor: Array, masses: tuple[float, float]
) -> Approach | None:
    """Return the closest approach of two magnets; None if nothing attracts them.

    Parameters
    ----------
    sides : tuple of Side
    apart : ndarray, shape (n, m)
        Least distances of dipoles of one from those of the other; infinite for those that do not
        act or that nothing keeps apart.
    factor : ndarray, shape (n, m)
        How strongly they act on one another.
    masses : tuple of float
        The reduced mass that MuJoCo assumes, and that of the bodies alone, in kg.
    """
    one, other = (side.magnet for side in sides)
    weight = np.where(apart < np.inf, factor, 0)
    poses = np.stack(np.meshgrid(*(side.distinct for side in sides)), axis=-1).reshape(-1, 2)
    near = apart[tuple(side.dipole[k] for side, k in zip(sides, poses.T, strict=True))]
    poses = poses[np.argsort(near, kind="stable")[: min(POSES, (near < np.inf).sum())]]
    force = gradient = pull = 0.0
    coiled = any(magnet.coils - {-1} for magnet in (one, other))
    aligned = any(m.responses.any() or len(m.coils) > 1 for m in (one, other))
    for i, j in poses.tolist() if weight.any() else ():
        for aside, height, turn, mirrored in _poses(sides, i, j, aligned):
            found = attraction(one, other, np.hypot(height, abs(aside)), weight)
            force, gradient = max((force, gradient), found)
            if not aligned:
                (across, along), (tangent, normal) = sides[0].moments(i), sides[1].moments(j)
                tangent = turn * (tangent if mirrored else tangent.conj())
                moments = (across, along), (tangent, -normal)
                true, _ = _pull(*moments, aside, np.maximum(height, COINCIDENCE), weight)
                pull = max(pull, abs(true) if coiled or mirrored else true)
    if not (0 < force < np.inf and 0 < gradient < np.inf and masses[0] < np.inf):
        return None  # as for a needle that only turns about its center
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    depths = np.array([side.depth[n] for side, n in zip(sides, nearest, strict=True)])
    depth = depths[depths > SURFACE * depths.sum()].min()
    return Approach(4 * force / gradient, force, *masses, float(depth), pull=pull or force)


def closest_to_plane(
    magnet: Magnet, plane: Magnet, found: Stand, level: float, masses: tuple[float, float]
) -> tuple[Approach | None, int]:
    """Return the closest approach of a magnet to a plane of iron, and its number in `found`.

    `level` is the height of what it touches above the plane; see `closest_approach` for the others.
    """
    forces, gradients = attraction_of_images(magnet, plane.images, found)
    k = int(forces.argmax())
    force, gradient = float(forces[k]), float(gradients[k])
    if not (0 < force < np.inf and 0 < gradient < np.inf and masses[0] < np.inf):
        return None, k
    depths = np.array([found.heights.min() - level, level])
    depth = depths[depths > SURFACE * depths.sum()].min()
    return Approach(4 * force / gradient, force, *masses, float(depth), pull=force), k


def coarsest(sides: tuple[Side, Side], apart: Array) -> Spacing:
    """Return the coarsest spacing where two magnets touch; `apart` as for `closest_approach`.

    Above a plane, `apart` are heights.
    """
    held = (apart < np.inf).nonzero()
    within = [np.zeros(length) for length in apart.shape]
    for side, found, dipoles in zip(sides, within, held, strict=True):
        for i in np.unique(dipoles).tolist():
            found[i] = side.spacing(i)
    spacing = np.maximum.outer(*within)
    distance = apart * (2 if sides[1].magnet.images else 1)
    worst = np.unravel_index((spacing / distance).argmax(), distance.shape)
    return Spacing(float(distance[worst]), float(spacing[worst]))


def _poses(
    sides: tuple[Side, Side], i: int, j: int, aligned: bool
) -> Iterator[tuple[NDArray[np.complex128], Array, complex, bool]]:
    """Yield how far all dipoles are aside and above others, where planes i and j touch.

    One magnet is turned in quarters of a turn about the normal, and mirrored: what is yielded last.
    """
    one, other = sides
    first, second = one.aside(i)[:, np.newaxis], other.aside(j)
    height = one.along(i)[:, np.newaxis] + other.along(j)
    alone = aligned and not (abs(second).any() and abs(first).any())
    for mirrored, turn in itertools.product((False, True), (1, 1j, -1, -1j)):
        yield turn * (second if mirrored else second.conj()) - first, height, turn, mirrored
        if alone:
            return


def _pull(
    one: tuple[NDArray[np.complex128], Array],
    other: tuple[NDArray[np.complex128], Array],
    aside: NDArray[np.complex128],
    height: Array,
    weight: Array | float,
) -> tuple[float, float]:
    """Return the force in N by which moments attract others above them, and its gradient in N/m.

    Moments are their parts across and along the vertical axis, (n,) and (m,); the others are so far
    `aside` and above, (n, m).
    """
    (across, along), (tangent, normal) = (one[0][:, np.newaxis], one[1][:, np.newaxis]), other
    square = 1 / (height**2 + aside.real**2 + aside.imag**2)
    fifth = square**2 * np.sqrt(square)
    a = (across.conj() * aside).real + along * height
    b = (tangent.conj() * aside).real + normal * height
    both = along * normal
    c = (across.conj() * tangent).real + both
    v = a * normal + b * along + c * height
    pull = fifth * (5 * a * b * height * square - v)
    slope = 2 * both + c - 5 * square * ((2 * v - c * height) * height + a * b)
    slope = fifth * (slope + 35 * a * b * (height * square) ** 2)
    scale = 3 * PERMEABILITY_OVER_4PI * weight
    return float((scale * pull).sum()), float((scale * slope).sum())


def attraction_of_images(magnet: Magnet, images: float, found: Stand) -> tuple[Array, Array]:
    """Return the force in N, and its gradient in N/m, of a magnet on a plane of iron, each (k,).

    They are those of the model, in each of the orientations, if the magnet has no iron, and all its
    moments change alike; otherwise, all pairs of moments count as aligned.
    """
    moments = magnet.strengths[:, np.newaxis] * magnet.axes
    aligned = bool(magnet.responses.any()) or len(magnet.coils) > 1
    forces, gradients = np.zeros((2, len(found.directions)))
    for k, (direction, height) in enumerate(zip(found.directions, found.heights, strict=True)):
        apart = height[:, np.newaxis] + height
        if (apart < COINCIDENCE).any():
            continue
        _, *sides = frame_of(direction)
        place, across = (vectors @ sides[0] + 1j * (vectors @ sides[1])
                         for vectors in (magnet.positions, moments))  # fmt: skip
        aside, along = place - place[:, np.newaxis], -moments @ direction
        if aligned:
            weight, plane = np.full((len(apart), 1), images), magnet._replace(images=images)
            forces[k], gradients[k] = attraction(magnet, plane, np.hypot(apart, abs(aside)), weight)
        else:
            forces[k], slope = _pull((-across, along), (across, along), aside, apart, images)
            gradients[k] = 2 * slope
    return forces, gradients


def attraction(one: Magnet, other: Magnet, distance: Array, factor: Array) -> tuple[float, float]:
    """Return the force of two magnets with aligned moments, in N, and its gradient, in N/m.

    Dipoles of both sides magnetize iron. Above a plane, `distance` is that of dipoles from images,
    and `factor` has one column.
    """
    k, moments, images = PERMEABILITY_OVER_4PI, [], other.images or 1.0
    distance = np.maximum(distance, COINCIDENCE)
    partner = one if other.images else other
    weight = factor * (factor.T > 0) if other.images else factor
    for magnet, source, away in ((one, partner, distance), (partner, one, distance.T)):
        if not magnet.responses.any():
            moments.append((magnet.strengths, np.zeros(len(magnet.strengths), bool)))
            continue
        strong = magnet.strengths > 0
        within = np.linalg.norm(magnet.positions[:, None] - magnet.positions[strong], axis=2)
        within[within == 0] = np.inf
        near = (images * source.strengths / away**3).sum(axis=1)
        near += (magnet.strengths[strong] / within**3).sum(axis=1)
        induced = 2 * k * magnet.responses * near
        free = (induced < magnet.saturations) & (magnet.responses > 0)
        moments.append((magnet.strengths + np.minimum(induced, magnet.saturations), free))
    (first, soft), (second, yielding) = moments
    pull = 6 * k * weight * np.multiply.outer(first, second) / distance**4
    power = 4 + 3 * np.logical_or.outer(soft, yielding)  # of 1/d
    return float(pull.sum()), float((power * pull / distance).sum()) * (2 if other.images else 1)
