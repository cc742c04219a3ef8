"""Uniformly magnetized bodies as clouds of point dipoles: a quadrature over the body.

Outside the body, its field is the mean of the fields of dipoles that have the moment of the whole
and lie anywhere in it. With Gauss points of order n along an axis, the mean is exact for all
multipoles below order 2n + 1.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Cloud = tuple[Array, Array]
"""Points (P, 3) in m, and each point's part of the moment (P,); the parts sum to 1."""

ORDER = 4
"""Gauss points along each axis."""


def cuboid(edges: tuple[float, float, float]) -> Cloud:
    """Cuboid about the origin.

    Parameters
    ----------
    edges : tuple of float
        Along x, y and z, in m.

    Returns
    -------
    points : ndarray, shape (64, 3)
        In m.
    parts : ndarray, shape (64,)
        Of the moment; their sum is 1.
    """
    points, weights = _gauss(ORDER)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = np.einsum("i,j,k->ijk", weights, weights, weights).ravel()
    return grid * edges, parts


def cylinder(length: float, radius: float) -> Cloud:
    """Cylinder about the origin, with its axis along x.

    Parameters
    ----------
    length, radius : float
        In m.

    Returns
    -------
    points : ndarray, shape (64, 3)
        In m.
    parts : ndarray, shape (64,)
        Of the moment; their sum is 1.
    """
    along, along_weights = _gauss(ORDER)
    square, square_weights = _gauss(ORDER // 2)  # of the squared radius, in which area is uniform
    angle = np.pi / ORDER * np.arange(2 * ORDER)
    x, s, phi = np.meshgrid(length * along, square + 0.5, angle, indexing="ij")
    distance = radius * np.sqrt(s)
    points = np.stack([x, distance * np.cos(phi), distance * np.sin(phi)], axis=-1)
    parts = np.einsum("i,j,k->ijk", along_weights, square_weights, np.full(len(angle), 1.0))
    return points.reshape(-1, 3), parts.ravel() / len(angle)


def ball(radius: float) -> Cloud:
    """Ball about the origin, as points on its surface.

    The field outside a ball and the force on it are means over any sphere about its center, since
    the fields are harmonic functions.

    Parameters
    ----------
    radius : float
        In m.

    Returns
    -------
    points : ndarray, shape (128, 3)
        In m.
    parts : ndarray, shape (128,)
        Of the moment; their sum is 1.
    """
    height, parts = np.polynomial.legendre.leggauss(2 * ORDER)
    angle = np.pi / (2 * ORDER) * np.arange(4 * ORDER)
    z, phi = np.meshgrid(height, angle, indexing="ij")
    level = np.sqrt(1 - z**2)
    points = radius * np.stack([level * np.cos(phi), level * np.sin(phi), z], axis=-1)
    return points.reshape(-1, 3), np.repeat(parts / 2 / len(angle), len(angle))


def as_dipoles(
    magnet: Cloud, moment: float, places: ArrayLike, directions: ArrayLike, normal: ArrayLike
) -> tuple[Array, Array]:
    """Point dipoles that stand for copies of a magnet.

    Parameters
    ----------
    magnet : tuple of ndarray
        Points and parts of the moment, as `cuboid`, `cylinder` and `ball` return them.
    moment : float
        Of each copy, in A m^2, along its own x axis.
    places : array_like, shape (N, 3)
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
    places, directions = np.asarray(places), np.asarray(directions)
    axis = np.broadcast_to(normal, directions.shape)
    turns = np.stack([directions, np.cross(axis, directions), axis], axis=1)
    positions = places[:, None] + points @ turns
    moments = moment * parts[:, None] * directions[:, None]
    return positions.reshape(-1, 3), moments.reshape(-1, 3)


def _gauss(order: int) -> Cloud:
    """Gauss-Legendre points and weights of the interval from -1/2 to 1/2."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return points / 2, weights / 2
