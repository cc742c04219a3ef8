"""How deep the dipoles of a magnet are below the surfaces with which it touches others."""

import itertools
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.covers import Covers
from magmotor.mjcf.checking.depth import (
    CONVEX,
    NEVER,
    depth_and_normal,
    hull_directions,
    tangent_planes,
    tips,
)
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.unit_system import declares_units
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

INSIDE = 1 / 3
"""Depth, over the smaller one of two dipoles, at which what is between them is in their piece."""

ALIGNED = 0.87
"""Cosine of the angle below which two neighbors count as neighbors in one direction."""

PARALLEL = 0.99
"""Cosine of the angle below which two dipoles may represent one magnet."""

WEAKEST = 0.15
"""Least polarization in T, over the box around it, of a geom that counts as one magnet.

In units that a model declares, none does, since T is not known in them.
"""

CENTERED = 0.02
"""Distance of dipoles' middle from that of their geom, over its size, that counts as none."""

AXES = 4
"""Largest number of dipoles' directions that are turned toward each other."""

BARE, APART = 8, 0.9
"""Number of directions in which other geoms cover a magnet least, and the cosine of the angle at
least between two of them."""


class Side:
    """The dipoles of a magnet below the surfaces of its geoms.

    `margin` is the distance from these surfaces at which they begin to push, in m. Geoms of other
    bodies, which `covers` knows, count where they cover the dipoles least.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        magnet: Magnet,
        geoms: NDArray,
        margin: float,
        covers: Covers,
    ) -> None:
        self.magnet, self._places = magnet, magnet.positions
        self._model, self._data, self._geoms = model, data, geoms
        self._covers = covers
        self._surface = [
            lambda points, geom=geom: self._least_depth(geom, points) for geom in geoms.tolist()
        ]
        self._margin = margin
        self.depth, normals = self._below(self._places)
        self.dipole, self._level, self._normal = np.arange(len(normals)), self.depth, normals
        axes = np.unique(np.round(magnet.axes[magnet.strengths > 0], 9), axis=0)
        axes = np.vstack([axes, -axes])[: 2 * AXES]
        self._solid = magnet.elements[magnet.elements >= model.nsite] - model.nsite
        axes = np.vstack([axes, self._least_covered()])
        faces = np.union1d(geoms, self._solid) if magnet.shaped or magnet.responses.any() else geoms
        planes = [tangent_planes(model, data, geom, axes) for geom in faces.tolist()]
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
        if len(faces):
            frame = data.geom_xmat[faces[0]].reshape(3, 3)
            side = frame.T[abs(self._normal @ frame).argmin(axis=1)]
            side = side - (side * self._normal).sum(axis=1)[:, np.newaxis] * self._normal
            side /= np.linalg.norm(side, axis=1)[:, np.newaxis]
            self._sides = side
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

    @property
    def covered(self) -> bool:
        """Whether it has a geom in which none of its dipoles is."""
        return any((surface(self._places)[0] <= 0).all() for surface in self._surface)

    def _least_depth(self, geom: int, points: Array) -> tuple[Array, Array]:
        """Return the depths of points in a geom wherever it can be, and the normals there."""
        model, data, ways = self._model, self._data, self._covers.places(self.magnet, geom)
        found = [depth_and_normal(model, data, geom, points - way)
                 for way in ways]  # fmt: skip
        depths, normals = (np.array(parts) for parts in zip(*found, strict=True))
        least, each = depths.argmin(axis=0), np.arange(len(points))
        return depths[least, each], normals[least, each]

    def _least_covered(self) -> Array:
        """Return directions (k, 3) in which other geoms cover magnets and iron least.

        It is how much farther the convex hull of all geoms reaches than they do.
        """
        model, data = self._model, self._data
        convex = np.isin(model.geom_type[self._geoms], CONVEX)
        others = np.setdiff1d(self._geoms[convex], self._solid)
        if not len(others) or not len(self._solid) or not self.magnet.body:
            return np.zeros((0, 3))
        geoms = [*self._geoms[convex].tolist(), *self._solid.tolist()]
        directions = hull_directions(model, data, geoms)
        reached = [((tips(model, data, geom, directions) * directions).sum(axis=1), geom)
                   for geom in geoms]  # fmt: skip
        inner = np.max([level for level, geom in reached if geom in self._solid], axis=0)
        gaps = np.max([level for level, _ in reached], axis=0) - inner
        chosen: list[int] = []
        for k in np.argsort(gaps, kind="stable").tolist():
            if (directions[chosen] @ directions[k] < APART).all():
                chosen.append(k)
            if len(chosen) == BARE:
                break
        return directions[chosen]

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

    def frame(self, k: int) -> Array:
        """Return the rows of that frame: the real and the imaginary axis, and the normal."""
        side, normal = self._sides[k], self._normal[k]
        return np.array([side, np.cross(normal, side), normal])

    @property
    def normals(self) -> Array:
        """The normals of all planes, each once, shape (k, 3)."""
        return np.unique(self._normal.round(12) + 0.0, axis=0)

    def widths(self, axes: Array) -> Array:
        """Return half the widths of all geoms that have magnets or iron along axes (k, 3)."""
        ends = [tips(self._model, self._data, geom, np.vstack([axes, -axes])) @ axes.T
                for geom in self._solid.tolist()]  # fmt: skip
        if not ends:
            return np.zeros(len(axes))
        count, found = len(axes), np.array(ends)
        highest = found[:, :count].diagonal(axis1=1, axis2=2).max(axis=0)
        return (highest - found[:, count:].diagonal(axis1=1, axis2=2).min(axis=0)) / 2

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
        weak = declares_units(self._model) or polarization < WEAKEST
        if np.linalg.norm(offset) > CENTERED * half.max() or weak:
            return none
        return 2 * half[:, np.newaxis] * frame.T
