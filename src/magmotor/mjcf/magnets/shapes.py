"""The shapes of magnets: a cuboid, a cylinder with or without a hole, and a ball.

A body is centered at the origin; the axis of a cylinder is z. `orders` are numbers of points along
its three directions, as in `magmotor.numerics.magnet_shapes`.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array
from magmotor.numerics.magnet_shapes import Cloud, cuboid, cylinder, ring_counts

Orders = tuple[int, int, int]
Geom = dict[str, str | ArrayLike]
"""Attributes of an element of MJCF: words, numbers and lists of numbers."""

SIZES = {
    "cuboid": ("edge along x", "edge along y", "edge along z"),
    "cylinder": ("diameter", "height"),
    "ring": ("inner diameter", "outer diameter", "height"),
    "sphere": ("diameter",),
}
"""Shapes, and the lengths that each one's size consists of."""

SIDES = 16
"""Smallest number of boxes that a ring is made of."""


class Cuboid(NamedTuple):
    """Edges along x, y and z."""

    x: float
    y: float
    z: float

    @property
    def extents(self) -> tuple[float, float, float]:
        """Lengths along x, y and z."""
        return self

    @property
    def volume(self) -> float:
        """In the cube of the unit of length."""
        return math.prod(self)

    def cloud(self, orders: Orders, even: bool = False) -> Cloud:
        """Points and their fractions of the moment."""
        return cuboid(self, orders, even)

    def dipoles(self, orders: Orders, even: bool) -> int:
        """Number of points."""
        return math.prod(orders)

    def orders(self, gap: float, folds: float) -> Orders:
        """Orders for errors of about exp(-folds) at a distance, by Bernstein's ellipses."""
        x, y, z = (_gauss_order(edge, gap, folds) for edge in self)
        return x, y, z

    def around(self, distance: float, count: int) -> Array:
        """Return points (count, 3) at a distance from the surface, spread over it."""
        return _beside(np.array(self) / 2, distance, _spread(4, count))

    def geoms(self, mass: float) -> Iterator[Geom]:
        """Geoms of the body."""
        yield {"type": "box", "size": [edge / 2 for edge in self], "mass": mass}


class Tube(NamedTuple):
    """Diameters of the hole, which may be 0, and of the cylinder; its height along z."""

    inner: float
    outer: float
    height: float

    @property
    def extents(self) -> tuple[float, float, float]:
        """Lengths along x, y and z."""
        return self.outer, self.outer, self.height

    @property
    def volume(self) -> float:
        """In the cube of the unit of length."""
        return math.pi / 4 * (self.outer - self.inner) * (self.outer + self.inner) * self.height

    def cloud(self, orders: Orders, even: bool = False) -> Cloud:
        """Points and their fractions of the moment."""
        points, parts = cylinder(self.height, self.outer / 2, self.inner / 2, orders, even)
        return points[:, [1, 2, 0]], parts

    def dipoles(self, orders: Orders, even: bool) -> int:
        """Number of points."""
        disks, rings, corners = orders
        return disks * sum(ring_counts(rings, corners, even and not self.inner))

    def orders(self, gap: float, folds: float) -> Orders:
        """Orders for errors of about exp(-folds) at a distance, by Bernstein's ellipses."""
        wall = (self.outer - self.inner) / 2
        corners = math.ceil(folds / math.asinh(2 * gap / self.outer))
        return (
            _gauss_order(self.height, gap, folds),
            _gauss_order(wall, gap, folds),
            max(corners, 3),
        )

    def around(self, distance: float, count: int) -> Array:
        """Return at most `count` points at a distance from the surface, spread over it."""
        spread = _spread(4, count)
        middle = (self.outer + self.inner) / 4 if self.inner else 0.0
        wall = np.array([self.outer / 2 - middle, self.height / 2])
        radius, z = _beside(wall, distance, spread[:, :3]).T
        radius, angle = radius + middle, math.pi * spread[:, 3]
        points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
        return points[radius >= 0] if self.inner else points

    def geoms(self, mass: float) -> Iterator[Geom]:
        """Geoms of the body.

        MuJoCo has no hollow cylinder. A full one of the radius sqrt(R^2 + r^2) has the inertia of
        the ring, and touches nothing; boxes without mass surround the hole.
        """
        hole, radius = self.inner / 2, self.outer / 2
        inertial = [math.hypot(hole, radius), self.height / 2]
        solid: Geom = {"type": "cylinder", "size": inertial, "mass": mass}
        if not hole:
            yield solid
            return
        yield {**solid, "contype": 0, "conaffinity": 0, "group": 3}
        # The edges of the boxes lie on the outer cylinder and their inner faces touch the hole.
        sides = max(SIDES, math.ceil(math.pi / math.acos((1 + hole / radius) / 2)))
        half = math.pi / sides
        flat = radius * math.cos(half)
        for k in range(sides):
            middle, turn = (hole + flat) / 2, 2 * half * k
            yield {
                "type": "box",
                "size": [(flat - hole) / 2, radius * math.sin(half), self.height / 2],
                "pos": [middle * math.cos(turn), middle * math.sin(turn), 0.0],
                "quat": [math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2)],
                "mass": 0.0,
            }


class Ball(NamedTuple):
    """Diameter."""

    diameter: float

    @property
    def extents(self) -> tuple[float, float, float]:
        """Lengths along x, y and z."""
        return self.diameter, self.diameter, self.diameter

    @property
    def volume(self) -> float:
        """In the cube of the unit of length."""
        return math.pi / 6 * self.diameter**3

    def geoms(self, mass: float) -> Iterator[Geom]:
        """Geoms of the body."""
        yield {"type": "sphere", "size": [self.diameter / 2], "mass": mass}


Body = Cuboid | Tube | Ball


def body_of(shape: str, size: tuple[float, ...]) -> Body:
    """Return the body of a shape and size in `SIZES`."""
    if shape == "cuboid":
        return Cuboid(*size)
    if shape == "sphere":
        return Ball(*size)
    return Tube(0.0, *size) if shape == "cylinder" else Tube(*size)


def _gauss_order(length: float, gap: float, folds: float) -> int:
    return math.ceil(folds / (2 * math.asinh(2 * gap / length)))


def _spread(dimensions: int, count: int) -> Array:
    """Points (count, dimensions) that fill a cube from -1 to 1 evenly, by Roberts's sequence."""
    ratio = 2.0
    for _ in range(60):  # ratio^(dimensions + 1) = ratio + 1
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    return 2 * (np.outer(np.arange(1, count + 1), steps) % 1) - 1


def _beside(half: Array, distance: float, spread: Array) -> Array:
    """Return points at a distance from a box of half edges `half`, in any number of dimensions.

    The first coordinate in `spread` chooses a pair of faces of a box that is larger by the
    distance, in proportion to their areas, and the others a point there. It moves toward the inner
    box until it is at the distance.
    """
    shares = np.cumsum(1 / (half + distance))
    axis = np.searchsorted(shares / shares[-1], (spread[:, 0] + 1) / 2)
    faces, row = spread[:, 1:].copy(), np.arange(len(spread))
    faces[row, axis] = np.where(faces[row, axis] < 0, -1.0, 1.0)
    points = faces * (half + distance)
    nearest = np.clip(points, -half, half)
    outward = points - nearest
    return nearest + distance * outward / np.linalg.norm(outward, axis=1, keepdims=True)
