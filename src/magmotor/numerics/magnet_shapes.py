"""Uniformly magnetized bodies as clouds of point dipoles, by quadrature over the body.

The field outside the body is the mean, over all points of the body, of the field of a dipole with
the total moment at that point. With n Gauss points along each axis, the mean is exact for all
multipoles below order 2n + 1. Points at even distances have only the right second moments, but near
the body they need fewer dipoles, since all places of the surface are equally far from them.

A single point along an axis lacks that axis's second moment. The field of a dipole is a harmonic
function of the dipole's position, so that only differences of second moments matter: the other axes
shrink until they lack as much, if they can.
"""

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array

Cloud = tuple[Array, Array]
"""Points (P, 3) in m, and each point's fraction of the moment (P,); the fractions sum to 1."""

ORDER = 4
"""Gauss points along each axis, unless told otherwise."""


def cuboid(
    edges: tuple[float, float, float],
    orders: tuple[int, int, int] = (ORDER, ORDER, ORDER),
    even: bool = False,
) -> Cloud:
    """Return a cuboid centered at the origin.

    Parameters
    ----------
    edges : tuple of float
        Lengths along x, y and z, in m.
    orders : tuple of int
        Numbers of points along x, y and z.
    even : bool
        Whether the points are at even distances; Gauss points otherwise.

    Returns
    -------
    points : ndarray, shape (P, 3)
        In m.
    parts : ndarray, shape (P,)
        Fractions of the moment; their sum is 1.
    """
    missing = [edge**2 for edge, order in zip(edges, orders, strict=True) if order == 1]
    lost = sum(missing) / max(len(missing), 1)
    rule = _even if even else _gauss
    (x, along_x), (y, along_y), (z, along_z) = map(rule, orders)
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = np.einsum("i,j,k->ijk", along_x, along_y, along_z).ravel()
    return grid * [edge * _shrunk(edge**2, lost) for edge in edges], parts


def cylinder(
    length: float,
    radius: float,
    inner: float = 0.0,
    orders: tuple[int, int, int] = (ORDER, ORDER // 2, 2 * ORDER),
    even: bool = False,
) -> Cloud:
    """Return a cylinder, perhaps hollow, centered at the origin, with its axis along x.

    Parameters
    ----------
    length, radius : float
        In m.
    inner : float
        Radius of the hole, in m.
    orders : tuple of int
        Number of disks along the axis, of rings in a disk, and of points on the outer ring. A ring
        of one point is the point on the axis.
    even : bool
        Whether the disks are at even distances and, without a hole, the rings too, with numbers of
        points in proportion to their radii. Otherwise they are at Gauss points, with equal numbers.

    Returns
    -------
    points : ndarray, shape (P, 3)
        In m.
    parts : ndarray, shape (P,)
        Fractions of the moment; their sum is 1.
    """
    disks, rings, corners = orders
    axial, radial = length**2 / 12, (radius**2 + inner**2) / 4
    along, along_weights = (_even if even else _gauss)(disks)
    counts = ring_counts(rings, corners, even and not inner)
    if counts[0] == 1 < rings:
        bounds = np.append(0, np.arange(rings) + 0.5) ** 2 / (rings - 0.5) ** 2
        ring_weights, square = np.diff(bounds), (np.arange(rings) / (rings - 0.5)) ** 2
        square = square / (2 * (ring_weights @ square))
    else:
        square, ring_weights = _gauss(rings)  # in the squared radius, for uniform area
        square = square + 0.5
    hole = (inner / radius) ** 2
    distance = radius * np.sqrt(hole + (1 - hole) * square)
    x = length * along
    if corners == 1:
        x, distance = x * _shrunk(axial, radial), 0 * distance
    elif disks == 1:
        distance = distance * _shrunk(radial, axial)
    angle = np.concatenate([2 * np.pi / n * np.arange(n) for n in counts])
    distance, weights = np.repeat(distance, counts), np.repeat(ring_weights, counts)
    disk = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1)
    points = np.column_stack([np.repeat(x, len(disk)), np.tile(disk, (disks, 1))])
    parts = np.outer(along_weights, weights) / np.repeat(counts, counts)
    return points, parts.ravel()


def ring_counts(rings: int, corners: int, even: bool) -> list[int]:
    """Return the number of points on each ring of a disk, with the center as the first if even."""
    if not even or rings == 1 or corners == 1:
        return [corners] * rings
    return [1] + [max(3, math.ceil(corners * k / (rings - 1))) for k in range(1, rings)]


def ball(radius: float) -> Cloud:
    """Return a ball centered at the origin, as points on its surface.

    The field outside a ball, and the force on it, are means over any concentric sphere, since the
    fields are harmonic functions.

    Parameters
    ----------
    radius : float
        In m.

    Returns
    -------
    points : ndarray, shape (128, 3)
        In m.
    parts : ndarray, shape (128,)
        Fractions of the moment; their sum is 1.
    """
    height, parts = np.polynomial.legendre.leggauss(2 * ORDER)
    angle = np.pi / (2 * ORDER) * np.arange(4 * ORDER)
    z, phi = np.meshgrid(height, angle, indexing="ij")
    level = np.sqrt(1 - z**2)
    points = radius * np.stack([level * np.cos(phi), level * np.sin(phi), z], axis=-1)
    return points.reshape(-1, 3), np.repeat(parts / 2 / len(angle), len(angle))


def as_dipoles(
    magnet: Cloud, moment: float, centers: ArrayLike, directions: ArrayLike, normal: ArrayLike
) -> tuple[Array, Array]:
    """Return the point dipoles that represent copies of a magnet.

    Parameters
    ----------
    magnet : tuple of ndarray
        Points and fractions of the moment, as `cuboid`, `cylinder` and `ball` return them.
    moment : float
        Moment of each copy, in A m^2, along its own x axis.
    centers : array_like, shape (N, 3)
        Centers of the copies, in m.
    directions : array_like, shape (N, 3)
        Unit vectors along the x axes of the copies.
    normal : array_like, shape (3,)
        Unit vector along the z axes of all copies, perpendicular to the directions.

    Returns
    -------
    positions : ndarray, shape (N P, 3)
        In m.
    moments : ndarray, shape (N P, 3)
        In A m^2.
    """
    points, parts = magnet
    centers, directions = np.asarray(centers), np.asarray(directions)
    axis = np.broadcast_to(normal, directions.shape)
    rotations = np.stack([directions, np.cross(axis, directions), axis], axis=1)
    positions = centers[:, None] + points @ rotations
    moments = moment * parts[:, None] * directions[:, None]
    return positions.reshape(-1, 3), moments.reshape(-1, 3)


@cache
def _gauss(order: int) -> Cloud:
    """Return the Gauss-Legendre points and weights on the interval from -1/2 to 1/2."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return points / 2, weights / 2


@cache
def _even(order: int) -> Cloud:
    """Return points at even distances with equal weights and the interval's second moment."""
    if order == 1:
        return _gauss(1)
    points = (np.arange(order) + 0.5) / order - 0.5
    return points / math.sqrt(1 - 1 / order**2), np.full(order, 1 / order)


def _shrunk(moment: float, lost: float) -> float:
    """Return the factor for lengths that takes `lost` from a second moment, or all of it."""
    return math.sqrt(max(1 - lost / moment, 0.0))
