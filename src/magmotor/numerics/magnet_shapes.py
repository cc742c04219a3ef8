"""Uniformly magnetized bodies as clouds of point dipoles, by quadrature over the body.

The field outside the body is the mean, over all points of the body, of the field of a dipole with
the total moment at that point. With n Gauss points along each axis, the mean is exact for all
multipoles below order 2n + 1.

A single point along an axis lacks that axis's second moment. The field of a dipole is a harmonic
function of the dipole's position, so that only differences of second moments matter: the other axes
shrink to have as much less, and no multipole below order 4 is lost where the shape allows it.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array

Cloud = tuple[Array, Array]
"""Points (P, 3) in m, and each point's fraction of the moment (P,); the fractions sum to 1."""

ORDER = 4
"""Gauss points along each axis, unless told otherwise."""


def cuboid(
    edges: tuple[float, float, float], orders: tuple[int, int, int] = (ORDER, ORDER, ORDER)
) -> Cloud:
    """Return a cuboid centered at the origin.

    Parameters
    ----------
    edges : tuple of float
        Lengths along x, y and z, in m.
    orders : tuple of int
        Numbers of points along x, y and z.

    Returns
    -------
    points : ndarray, shape (P, 3)
        In m.
    parts : ndarray, shape (P,)
        Fractions of the moment; their sum is 1.
    """
    missing = [edge**2 for edge, order in zip(edges, orders, strict=True) if order == 1]
    lost = sum(missing) / max(len(missing), 1)
    (x, along_x), (y, along_y), (z, along_z) = map(_gauss, orders)
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = np.einsum("i,j,k->ijk", along_x, along_y, along_z).ravel()
    return grid * [edge * _shrunk(edge**2, lost) for edge in edges], parts


def cylinder(
    length: float,
    radius: float,
    inner: float = 0.0,
    orders: tuple[int, int, int] = (ORDER, ORDER // 2, 2 * ORDER),
) -> Cloud:
    """Return a cylinder, perhaps hollow, centered at the origin, with its axis along x.

    Parameters
    ----------
    length, radius : float
        In m.
    inner : float
        Radius of the hole, in m.
    orders : tuple of int
        Number of disks along the axis, of rings in a disk, and of points on a ring. A ring of one
        point is the point on the axis.

    Returns
    -------
    points : ndarray, shape (P, 3)
        In m.
    parts : ndarray, shape (P,)
        Fractions of the moment; their sum is 1.
    """
    disks, rings, corners = orders
    axial, radial = length**2 / 12, (radius**2 + inner**2) / 4
    along, along_weights = _gauss(disks)
    square, square_weights = _gauss(rings)  # in the squared radius, for uniform area
    angle = 2 * np.pi / corners * np.arange(corners)
    x, s, phi = np.meshgrid(length * along, square + 0.5, angle, indexing="ij")
    hole = (inner / radius) ** 2
    distance = radius * np.sqrt(hole + (1 - hole) * s)
    if corners == 1:
        x, distance = x * _shrunk(axial, radial), 0 * distance
    elif disks == 1:
        distance *= _shrunk(radial, axial)
    points = np.stack([x, distance * np.cos(phi), distance * np.sin(phi)], axis=-1)
    parts = np.einsum("i,j,k->ijk", along_weights, square_weights, np.full(len(angle), 1.0))
    return points.reshape(-1, 3), parts.ravel() / len(angle)


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


def _gauss(order: int) -> Cloud:
    """Return the Gauss-Legendre points and weights on the interval from -1/2 to 1/2."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return points / 2, weights / 2


def _shrunk(moment: float, lost: float) -> float:
    """Return the factor for lengths that takes `lost` from a second moment, or all of it."""
    return math.sqrt(max(1 - lost / moment, 0.0))
