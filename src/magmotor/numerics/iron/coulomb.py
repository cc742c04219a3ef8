"""Potential and mutual energy of uniformly charged quadrilaterals.

The potential of a charge of 1 T m^2, which is mu0 times a magnetic charge, is 1/(4 pi r) in T m.
"""

import numpy as np

from magmotor.common.arrays import Array
from magmotor.numerics.iron.meshes import triangles

NEAR = 3.0
"""Quadrilaterals nearer than this, in units of their radii, are no clouds of points."""

CHUNK = 200_000
"""Number of pairs of a point and a triangle at a time."""

RULE_OF_THREE = (np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6, np.full(3, 1 / 3))
"""Barycentric coordinates and weights of three points in a triangle, exact to degree 2."""


def _seven() -> tuple[Array, Array]:
    """Return the rule of seven points for a triangle, exact to degree 5 (J. Radon, 1948)."""
    points, weights = [np.full(3, 1 / 3)], [9 / 40]
    for sign in (-1, 1):
        small = (6 + sign * np.sqrt(15)) / 21
        points += list(np.full((3, 3), small) + (1 - 3 * small) * np.eye(3))
        weights += 3 * [(155 + sign * np.sqrt(15)) / 1200]
    return np.array(points), np.array(weights)


RULE_OF_SEVEN = _seven()


def triangle_potential(points: Array, corners: Array) -> Array:
    """Return int dS/|x - y| over a triangle, in m.

    Parameters
    ----------
    points : ndarray, shape (..., 3)
        In m.
    corners : ndarray, shape (..., 3, 3)
        In m.

    Notes
    -----
    The integral is a sum over the edges, t log((p + q + l)/(p + q - l)), minus the solid angle
    times the distance to the plane. An edge has the length l, its ends the distances p and q from
    the point, and its line the distance t from the point's projection.

    References
    ----------
    D. R. Wilton et al., IEEE Trans. Antennas Propag. 32 (1984) 276; for the solid angle,
    A. Van Oosterom, J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125.
    """
    to = corners - points[..., None, :]
    distance = np.sqrt(np.einsum("...i,...i->...", to, to))
    normal = np.cross(
        corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    )
    size = np.sqrt(np.einsum("...i,...i->...", normal, normal))
    normal = normal / np.where(size > 0, size, 1.0)[..., None]
    total = np.zeros(distance.shape[:-1])
    for k in range(3):
        m = (k + 1) % 3
        edge = corners[..., m, :] - corners[..., k, :]
        length = np.sqrt(np.einsum("...i,...i->...", edge, edge))
        inward = np.cross(normal, edge)
        offset = -np.einsum("...i,...i->...", inward, to[..., k, :])
        sides = distance[..., k] + distance[..., m]
        good = (sides - length > 1e-14 * sides) & (length > 0)
        ratio = np.where(good, (sides + length) / np.where(good, sides - length, 1.0), 1.0)
        total += offset / np.where(length > 0, length, 1.0) * np.log(ratio)
    a, b, c = distance[..., 0], distance[..., 1], distance[..., 2]
    ab = np.einsum("...i,...i->...", to[..., 0, :], to[..., 1, :])
    bc = np.einsum("...i,...i->...", to[..., 1, :], to[..., 2, :])
    ca = np.einsum("...i,...i->...", to[..., 2, :], to[..., 0, :])
    height = np.abs(np.einsum("...i,...i->...", normal, to[..., 0, :]))
    angle = 2 * np.arctan2(height * size, a * b * c + ab * c + bc * a + ca * b)
    return np.where(size > 0, total - height * angle, 0.0)


def mutual_energies(quadrilaterals: Array) -> Array:
    """Compute the matrix of the mutual energies of unit charges that are uniform on quadrilaterals.

    Parameters
    ----------
    quadrilaterals : ndarray, shape (N, 4, 3)
        In m.

    Returns
    -------
    ndarray, shape (N, N)
        Means of 1/(4 pi r) over both quadrilaterals, in 1/m: half the charges' quadratic form in
        T m^2, divided by mu0, is the energy in J.
    """
    parts, areas = triangles(quadrilaterals)
    share = areas / areas.sum(axis=1, keepdims=True)
    energies = _far(parts, share)
    center = np.einsum("nt,nti->ni", share, parts.mean(axis=2))
    radius = np.linalg.norm(quadrilaterals - center[:, None], axis=-1).max(axis=1)
    distance = np.linalg.norm(center[:, None] - center[None], axis=-1)
    one, two = np.nonzero(distance < NEAR * np.maximum(radius[:, None], radius[None]))
    rule, weights = RULE_OF_SEVEN
    step = CHUNK // (4 * len(weights))
    for start in range(0, len(one), step):
        i, j = one[start : start + step], two[start : start + step]
        points = np.einsum("qc,ntci->ntqi", rule, parts[i])[:, :, :, None]
        potential = triangle_potential(points, parts[j][:, None, None])
        density = share[j] / np.where(areas[j] > 0, areas[j], 1.0)
        energies[i, j] = np.einsum("nt,q,ntqs,ns->n", share[i], weights, potential, density)
    return (energies + energies.T) / (8 * np.pi)


def _far(parts: Array, share: Array) -> Array:
    """Return means of 1/r over clouds of points."""
    rule, weights = RULE_OF_THREE
    points = np.einsum("qc,ntci->ntqi", rule, parts)
    count = len(parts)
    points, weights = points.reshape(count, -1, 3), (share[:, :, None] * weights).reshape(count, -1)
    flat, energies = points.reshape(-1, 3), np.empty((count, count))
    square = np.einsum("pi,pi->p", flat, flat)
    step = max(1, 4_000_000 // (len(flat) * points.shape[1]))
    for start in range(0, count, step):
        some = points[start : start + step].reshape(-1, 3)
        gaps = np.einsum("pi,pi->p", some, some)[:, None] + square - 2 * some @ flat.T
        inverse = 1 / np.sqrt(np.maximum(gaps, 1e-12 * square.max()))
        inverse = inverse.reshape(-1, points.shape[1], count, points.shape[1])
        energies[start : start + step] = np.einsum(
            "iq,iqjp,jp->ij", weights[start : start + step], inverse, weights, optimize=True
        )
    return energies
