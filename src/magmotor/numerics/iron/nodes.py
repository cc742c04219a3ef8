"""Nodes on the surface of a piece, and the interpolation of a potential from its values there.

The potential of magnets outside is smooth on a smooth surface: a few nodes describe it on any
number of panels. The charges that answer it belong to the nodes.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array
from magmotor.numerics.iron.unions import Rectangle

LARGEST_ORDER = 4
"""Number of Gauss points in an interval; a longer line has several intervals."""


FEWEST = 3
"""Number of nodes along an edge at least: those of two would be far from it."""


@functools.cache
def _gauss_points(order: int) -> Array:
    """Return the points of Gauss and Legendre between -1 and 1."""
    return np.polynomial.legendre.leggauss(order)[0]


class Line(NamedTuple):
    """A line from 0 to 1, with intervals of equal length and Gauss points in each of them."""

    intervals: int
    order: int

    @classmethod
    def spaced(cls, length: float, spacing: float, fewest: int = FEWEST) -> "Line":
        """Return a line whose nodes have the mean distance `spacing` or less."""
        count = max(fewest, int(np.ceil(length / spacing - 1e-9)))
        intervals = int(np.ceil(count / max(fewest, LARGEST_ORDER)))
        return cls(intervals, int(np.ceil(count / intervals)))

    @property
    def nodes(self) -> Array:
        """The nodes (intervals order,)."""
        inside = (_gauss_points(self.order) + 1) / 2
        return ((np.arange(self.intervals)[:, None] + inside) / self.intervals).ravel()

    def basis(self, x: Array) -> Array:
        """Return the values at x (N,) of the nodes' Lagrange polynomials, (N, nodes)."""
        interval = np.clip((x * self.intervals).astype(int), 0, self.intervals - 1)
        nodes = self.nodes.reshape(self.intervals, self.order)
        basis = np.zeros((len(x), self.intervals, self.order))
        for k in range(self.order):
            others = np.delete(nodes, k, axis=1)[interval]
            basis[np.arange(len(x)), interval, k] = np.prod(
                (x[:, None] - others) / (nodes[interval, k, None] - others), axis=1
            )
        return basis.reshape(len(x), nodes.size)


RADIUS = 0.6
"""Radius of the balls of charge at the nodes, over the distance of nodes: large enough for charges
of two pieces to attract each other less than they repel themselves."""

FLAT = Line(1, 1)
"""A line along which there is nothing but one node."""

INTO_WALL = 0.25
"""How far faces reach into what rises beside them, over the distance of nodes, so that their images
do not end there; see `mjcf/forces/faces.py`."""

NARROWEST = 0.1
"""Width of the narrowest face from which magnets are lifted less, over the distance of nodes."""

CLOSE = 1e-9
"""How far points may be outside of a rectangle, over the size of the piece."""


def face(
    axis: int, side: int, center: Array, half: Array, free: Array, apart: float
) -> list[float]:
    """Return what is needed of a flat face: a row of numbers.

    Parameters
    ----------
    axis, side : int
        The axis of its normal, and the sign of that.
    center, half : ndarray, shape (3,)
        The center and half of the edges along x, y and z, in m. A disk has its radius as the first
        edge after the normal, and no second one.
    free : ndarray, shape (2, 3)
        Whether the piece ends at the lower and the upper edges along the axes.
    apart : float
        Mean distance of its nodes, in m.

    Returns
    -------
    list of float
        The axis; the sign; the height of the face along its normal; along the two next axes, the
        center, half of the edges, and whether the lower and the upper one are free; and the mean
        distance of nodes. This is at most the width of the face, or `NARROWEST` of it if that is
        more: what lifts a magnet from a narrow face takes away more than images return.
    """
    next_axes = [(axis + 1) % 3, (axis + 2) % 3]
    width = min(2 * length for length in half[next_axes] if length > 0)
    apart = min(apart, max(width, NARROWEST * apart))
    frame = [*center[next_axes], *half[next_axes], *free[:, next_axes].T.ravel()]
    return [axis, side, side * center[axis], *frame, apart]


def with_depths(rows: list[list[float]]) -> Array:
    """Return faces (F, 13), to each of which the least distance from an opposite one is added."""
    faces = np.array(rows)
    opposite = (faces[:, None, 0] == faces[:, 0]) & (faces[:, None, 1] == -faces[:, 1])
    depths = np.where(opposite, faces[:, None, 2] + faces[:, 2], np.inf)
    return np.column_stack([faces, np.where(depths > 0, depths, np.inf).min(axis=1)])


class FlatNodes:
    """Nodes on rectangles whose normals are along the axes."""

    def __init__(self, rectangles: list[Rectangle], spacing: float):
        self._rectangles = rectangles
        self._lines, found = [], []
        for rectangle in rectangles:
            lengths = rectangle.upper - rectangle.lower
            lines = [Line.spaced(length, spacing) if length else FLAT for length in lengths]
            grid = np.stack(np.meshgrid(*(line.nodes for line in lines), indexing="ij"), axis=-1)
            found.append(rectangle.lower + lengths * grid.reshape(-1, 3))
            self._lines.append(lines)
        self.points = np.concatenate(found)

    @property
    def faces(self) -> Array:
        """The rectangles, and what is behind inner edges; see `face`."""
        rows = []
        for rectangle, lines in zip(self._rectangles, self._lines, strict=True):
            lengths = rectangle.upper - rectangle.lower
            apart = max(lengths / [line.nodes.size for line in lines])
            more = INTO_WALL * apart * rectangle.risen
            lower, upper = rectangle.lower - more[0], rectangle.upper + more[1]
            center, half = (lower + upper) / 2, (upper - lower) / 2
            rows.append(face(rectangle.axis, rectangle.side, center, half, rectangle.free, apart))
        return with_depths(rows)

    def interpolation(self, points: Array) -> Array:
        """Return the matrix (N, nodes) from values at the nodes to those at points (N, 3)."""
        matrix, start = np.zeros((len(points), len(self.points))), 0
        close = CLOSE * np.abs(points).max()
        for rectangle, lines in zip(self._rectangles, self._lines, strict=True):
            inside = (points > rectangle.lower - close) & (points < rectangle.upper + close)
            here = np.flatnonzero(inside.all(axis=1))
            lengths = rectangle.upper - rectangle.lower
            along = (points[here] - rectangle.lower) / np.where(lengths > 0, lengths, 1.0)
            bases = [line.basis(along[:, k]) for k, line in enumerate(lines)]
            end = start + math.prod(line.nodes.size for line in lines)
            product = np.einsum("ni,nj,nk->nijk", *bases)
            matrix[here, start:end] = product.reshape(len(here), end - start)
            start = end
        return matrix

    def onto_surface(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Move points (N, 3) on panels to the true surface, and return its normals there."""
        return points, normals


class RingNodes:
    """Nodes on rings about the z axis, as many on each as its length needs.

    On a smooth surface, what varies around a ring more often than the ring has nodes is small,
    since it vanishes at the axis as a power of the radius.
    """

    def __init__(self, segments: list[Line], rings: list[tuple[Array, Array]], spacing: float):
        self._segments = segments
        self._counts, found = [], []
        for radii, heights in rings:
            for radius, height in zip(radii, heights, strict=True):
                count = 2 * int(max(1, np.ceil(np.pi * radius / spacing - 0.5))) + 1
                phi = 2 * np.pi / count * np.arange(count)
                self._counts.append(count)
                circle = [radius * np.cos(phi), radius * np.sin(phi), np.full(count, height)]
                found.append(np.stack(circle, axis=-1))
        self.points = np.concatenate(found)

    @property
    def faces(self) -> Array:
        """The flat faces; see `face`."""
        return np.zeros((0, 13))

    def _interpolate(self, segment: Array, along: Array, phi: Array) -> Array:
        """Return the matrix for points on segments, from 0 to 1 along each, at angles phi."""
        offsets = np.cumsum([0] + [line.nodes.size for line in self._segments])
        meridian = np.zeros((len(along), offsets[-1]))
        for number, line in enumerate(self._segments):
            here = segment == number
            meridian[here, offsets[number] : offsets[number + 1]] = line.basis(along[here])
        blocks = []
        for ring, count in enumerate(self._counts):
            angle = phi[:, None] - 2 * np.pi / count * np.arange(count)
            order = np.arange(1, count // 2 + 1)[:, None, None]
            waves = (1 + 2 * np.cos(order * angle).sum(axis=0)) / count
            blocks.append(meridian[:, ring, None] * waves)
        return np.concatenate(blocks, axis=1)


class CylinderNodes(RingNodes):
    """Nodes on cylinders along z.

    Their walls and bases are rectangles whose coordinates are radii, angles and heights. At each
    height, there is either one base or one wall.
    """

    def __init__(self, rectangles: list[Rectangle], spacing: float):
        self._rectangles, lines, rings = rectangles, [], []
        for each in rectangles:
            radii, _, heights = lengths = each.upper - each.lower
            line = Line.spaced(max(radii, heights), spacing)
            points = each.lower + lengths * line.nodes[:, None]
            rings.append((points[:, 0], points[:, 2]))
            lines.append(line)
        super().__init__(lines, rings, spacing)

    @property
    def faces(self) -> Array:
        """The bases; see `face`."""
        rows = []
        for each, line in zip(self._rectangles, self._segments, strict=True):
            apart = (each.upper[0] - each.lower[0]) / line.nodes.size
            if each.axis == 2:
                center, half = each.lower * [0, 0, 1], each.upper * [1, 0, 0]
                free = np.full((2, 3), each.free[1, 0])
                rows.append(face(2, each.side, center, half, free, apart))
        return with_depths(rows)

    def interpolation(self, points: Array) -> Array:
        """Return the matrix (N, nodes) from values at the nodes to those at points (N, 3)."""
        x, y, z = points.T
        r, close = np.hypot(x, y), CLOSE * np.abs(points).max()
        segment, along = np.zeros(len(x), dtype=int), np.zeros(len(x))
        for number, each in enumerate(self._rectangles):
            lengths = each.upper - each.lower
            if each.axis == 0:
                here = (z > each.lower[2] + close) & (z < each.upper[2] - close)
                along[here] = (z[here] - each.lower[2]) / lengths[2]
            else:
                here = np.abs(z - each.lower[2]) <= close
                along[here] = (r[here] - each.lower[0]) / lengths[0]
            segment[here] = number
        return self._interpolate(segment, along, np.arctan2(y, x))

    def onto_surface(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Move points (N, 3) on panels to the true surface, and return its normals there."""
        r = np.hypot(points[:, 0], points[:, 1])
        walls = np.array([each.lower[0] for each in self._rectangles if each.axis == 0])
        nearest = walls[np.abs(r[:, None] - walls).argmin(axis=1)]
        on_wall = np.abs(normals[:, 2:]) < 0.5
        radial = points * [1, 1, 0] / r[:, None]
        side = np.sign((radial * normals).sum(axis=1, keepdims=True))
        moved = nearest[:, None] * radial + points * [0, 0, 1]
        return np.where(on_wall, moved, points), np.where(on_wall, side * radial, normals)


class CapsuleNodes(RingNodes):
    """Nodes on a capsule along z."""

    def __init__(self, radius: float, half_length: float, spacing: float):
        self._radius, self._half_length = radius, half_length
        arc = Line.spaced(np.pi / 2 * radius, spacing, 3)
        side = Line.spaced(2 * half_length, spacing)
        angle, wall = np.pi / 2 * arc.nodes, half_length * (2 * side.nodes - 1)
        cap, height = radius * np.sin(angle), half_length + radius * np.cos(angle)
        rings = [(cap, -height), (np.full(wall.size, radius), wall), (cap, height)]
        super().__init__([arc, side, arc], rings, spacing)

    def interpolation(self, points: Array) -> Array:
        """Return the matrix (N, nodes) from values at the nodes to those at points (N, 3)."""
        x, y, z = points.T
        above = np.abs(z) - self._half_length
        segment = np.where(above < 0, 1, np.where(z > 0, 2, 0))
        along = np.arctan2(np.hypot(x, y), above) / (np.pi / 2)
        along = np.where(segment == 1, (z / self._half_length + 1) / 2, along)
        return self._interpolate(segment, along, np.arctan2(y, x))

    def onto_surface(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Move points (N, 3) on panels to the true surface, and return its normals there."""
        middle = np.clip(points * [0, 0, 1], -self._half_length, self._half_length)
        normals = points - middle
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return middle + self._radius * normals, normals


class EllipsoidNodes(RingNodes):
    """Nodes on an ellipsoid, at even angles on the sphere that becomes it."""

    def __init__(self, semi_axes: ArrayLike, spacing: float):
        self._axes = np.asarray(semi_axes, dtype=float)
        longest = self._axes.max()
        line = Line.spaced(np.pi * longest, spacing, 6)
        angle = np.pi * line.nodes
        super().__init__([line], [(np.sin(angle), np.cos(angle))], spacing / longest)
        self.points = self._axes * self.points

    def interpolation(self, points: Array) -> Array:
        """Return the matrix (N, nodes) from values at the nodes to those at points (N, 3)."""
        x, y, z = (points / self._axes).T
        along = np.arctan2(np.hypot(x, y), z) / np.pi
        return self._interpolate(np.zeros(len(x), dtype=int), along, np.arctan2(y, x))

    def onto_surface(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Move points (N, 3) on panels to the true surface, and return its normals there."""
        points = points / np.linalg.norm(points / self._axes, axis=1, keepdims=True)
        normals = points / self._axes**2
        return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


Nodes = FlatNodes | CapsuleNodes | CylinderNodes | EllipsoidNodes
"""What a response needs to know of its surface."""
