"""Uniformly magnetised bodies as point dipoles: quadrature of the field's integral over them.

Outside, the field of such a body is the mean of those of dipoles of its whole moment all over it.
With Gauss points of order n an axis it is exact for all multipoles below order 2n + 1.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Cloud = tuple[Array, Array]
"""Points (n, 3) in m and their parts of the moment (n,), which sum to 1."""

ORDER = 4
"""Gauss points along each axis."""


def cuboid(edges: tuple[float, float, float]) -> Cloud:
    """A cuboid about the origin, with these edges in m."""
    points, weights = _gauss(ORDER)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = np.einsum("i,j,k->ijk", weights, weights, weights).ravel()
    return grid * edges, parts


def cylinder(length: float, radius: float) -> Cloud:
    """A cylinder about the origin, its axis along x; length and radius in m."""
    along, along_weights = _gauss(ORDER)
    square, square_weights = _gauss(ORDER // 2)  # of the squared radius, in which area is uniform
    angle = np.pi / ORDER * np.arange(2 * ORDER)
    x, s, phi = np.meshgrid(length * along, square + 0.5, angle, indexing="ij")
    distance = radius * np.sqrt(s)
    points = np.stack([x, distance * np.cos(phi), distance * np.sin(phi)], axis=-1)
    parts = np.einsum("i,j,k->ijk", along_weights, square_weights, np.full(len(angle), 1.0))
    return points.reshape(-1, 3), parts.ravel() / len(angle)


def ball(radius: float) -> Cloud:
    """A ball about the origin; its radius in m.

    The mean over any sphere is what counts, for the field outside as for the force by one.
    """
    height, parts = np.polynomial.legendre.leggauss(2 * ORDER)
    angle = np.pi / (2 * ORDER) * np.arange(4 * ORDER)
    z, phi = np.meshgrid(height, angle, indexing="ij")
    level = np.sqrt(1 - z**2)
    points = radius * np.stack([level * np.cos(phi), level * np.sin(phi), z], axis=-1)
    return points.reshape(-1, 3), np.repeat(parts / 2 / len(angle), len(angle))


def cube(edge: float) -> Cloud:
    """A cube; its first correction to a dipole is of the fourth order in edge over distance."""
    return cuboid((edge, edge, edge))


def bar(edge: float) -> Cloud:
    """Four times as long, along x, as it is wide, with the volume of a cube of this edge."""
    width = edge / 4 ** (1 / 3)
    return cuboid((4 * width, width, width))


def plate(edge: float) -> Cloud:
    """Four times as wide as it is thick, along x, with the volume of a cube of this edge."""
    width = edge * 4 ** (1 / 3)
    return cuboid((width / 4, width, width))


def rod(edge: float) -> Cloud:
    """A cylinder as long, along x, as it is wide, with the volume of a cube of this edge."""
    length = edge * (4 / np.pi) ** (1 / 3)
    return cylinder(length, length / 2)


SHAPES: dict[str, Callable[[float], Cloud]] = {"cube": cube, "rod": rod, "plate": plate, "bar": bar}
"""By the edge, in m, of a cube of the same volume; the moment is along x."""


def _gauss(order: int) -> Cloud:
    """Gauss-Legendre points and weights of the interval from -1/2 to 1/2."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return points / 2, weights / 2
