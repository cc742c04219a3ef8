"""Meshes of hexahedra that fill boxes, cylinders, capsules and ellipsoids.

The outer faces of a mesh are the panels of the surface. They are narrower beside sharp edges, where
the density of charge is singular.
"""

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array, Integers

HALVINGS = 2
"""Number of times that the last interval before a sharp edge is divided."""

FEWEST = 6
"""Number of panels along the edges of the cube that becomes an ellipsoid, at least."""


def _lines(length: float, spacing: float, sharp: tuple[bool, bool] = (True, True)) -> Array:
    """Return coordinates from 0 to 1 at even distances, with more of them before sharp ends."""
    count = int(np.ceil(length / spacing))
    lines = np.arange(count + 1) / count
    more = 0.5 ** np.arange(1, HALVINGS + 1 if count > 1 else 2) / count
    ends = [more[::-1]] * sharp[0] + [1 - more] * sharp[1]
    return np.unique(np.concatenate([lines, *ends]))


def box(half_edges: ArrayLike, spacing: float) -> Array:
    """Return the cells of a box.

    Parameters
    ----------
    half_edges : array_like, shape (3,)
        Half of the lengths along x, y and z, in m.
    spacing : float
        Largest edge of a cell, in m.

    Returns
    -------
    ndarray, shape (N, 2, 2, 2, 3)
        Corners of the cells in m, along three coordinates of the cell.
    """
    half = np.asarray(half_edges, dtype=float)
    return cells_between([spaced([-length, length], spacing) for length in half])


def spaced(edges: ArrayLike, spacing: float, axis: bool = False) -> Array:
    """Return the coordinates of a grid between some coordinates of edges, and denser beside them.

    It is not denser beside the first one if that is an `axis`.
    """
    ends = np.asarray(edges, dtype=float)
    widths, parts = np.diff(ends), []
    for k, (start, width) in enumerate(zip(ends[:-1], widths, strict=True)):
        parts.append(start + width * _lines(width, spacing, (k > 0 or not axis, True))[:-1])
    return np.concatenate([*parts, ends[-1:]])


def cells_between(lines: list[Array]) -> Array:
    """Return the cells of a grid with the given coordinates along x, y and z."""
    return _cells(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1))


def cylinder(radius: float, half_length: float, spacing: float) -> Array:
    """Return the cells of a cylinder along z; their volume is that of the true cylinder.

    The parameters and what is returned are those of `box`; two corners of the cells at the axis
    coincide with two others.
    """
    return cells_around(cylinder_lines([0.0, radius], [-half_length, half_length], spacing))


def cylinder_lines(radii: ArrayLike, heights: ArrayLike, spacing: float) -> list[Array]:
    """Return radii, angles and heights of a grid for cylinders with these edges.

    The radii are those of regular polygons with the areas of circles.
    """
    around = max(12, int(np.ceil(2 * np.pi * np.max(radii) / spacing)))
    angles = np.array(2 * np.pi / around * np.arange(around + 1), dtype=float)
    return [spaced(radii, spacing, axis=True), angles, spaced(heights, spacing)]


def cells_around(lines: list[Array]) -> Array:
    """Return the cells of a grid with the given radii, angles and heights."""
    r, phi, z = np.meshgrid(*lines, indexing="ij")
    true = 1 / np.sqrt(np.sin(lines[1][1]) / lines[1][1])
    return _cells(np.stack([true * r * np.cos(phi), true * r * np.sin(phi), z], axis=-1))


def ellipsoid(semi_axes: ArrayLike, spacing: float) -> Array:
    """Return the cells of an ellipsoid; their volume is that of the true ellipsoid.

    They are layers under the faces of a cube that is blown up, at even angles. The parameters
    and what is returned are those of `box`; four corners of the innermost cells coincide.
    """
    axes = np.asarray(semi_axes, dtype=float)
    count = max(FEWEST, int(np.ceil(np.pi / 2 * axes.max() / spacing)))
    line = np.tan(np.pi / 2 * (np.arange(count + 1) / count - 0.5))
    face = np.stack(np.meshgrid([1.0], line, line, indexing="ij"), axis=-1)[0]
    face /= np.linalg.norm(face, axis=-1, keepdims=True)
    layers = count // 2 + 1
    wedge = np.arange(layers + 1)[:, None, None, None] / layers * face
    turned = [np.roll(side * wedge, axis, axis=-1) for axis in range(3) for side in (-1, 1)]
    corners = np.concatenate([_cells(part) for part in turned])
    return axes * corners * (4 * np.pi / 3 / outward(corners)[2].sum()) ** (1 / 3)


def capsule(radius: float, half_length: float, spacing: float) -> Array:
    """Return the cells of a capsule along z; their volume is that of the true capsule.

    The parameters and what is returned are those of `box`; the cells at the axis and at the poles
    have corners that coincide.
    """
    around = max(12, int(np.ceil(2 * np.pi * radius / spacing)))
    angles = 2 * np.pi / around * np.arange(around + 1)
    radial = np.linspace(0, 1, int(np.ceil(radius / spacing)) + 1)
    arc = np.linspace(0, np.pi / 2, max(FEWEST, int(np.ceil(np.pi / 2 * radius / spacing))) + 1)
    side = np.linspace(-1, 1, int(np.ceil(2 * half_length / spacing)) + 1)[1:-1]
    axial = np.concatenate(
        [
            -half_length - radius * np.cos(arc),
            half_length * side,
            half_length + radius * np.sin(arc),
        ]
    )
    outer = radius * np.concatenate([np.sin(arc), np.ones_like(side), np.cos(arc)])
    r, phi = np.meshgrid(radial, angles, indexing="ij")
    flat = outer * (r * [np.cos(phi), np.sin(phi)])[..., None]
    corners = _cells(np.stack([*flat, np.broadcast_to(axial, flat[0].shape)], axis=-1))
    volume = np.pi * radius**2 * (2 * half_length + 4 / 3 * radius)
    return corners * (volume / outward(corners)[2].sum()) ** (1 / 3)


def _cells(grid: Array) -> Array:
    """Return the corners of the cells of a grid of points (I, J, K, 3)."""
    windows = np.lib.stride_tricks.sliding_window_view(grid, (2, 2, 2), axis=(0, 1, 2))
    return np.moveaxis(windows, 3, -1).reshape(-1, 2, 2, 2, 3)


def faces(cells: Array) -> Array:
    """Return the corners of the six faces of each cell (N, 6, 4, 3), in order around each face."""
    found = [np.take(cells, side, axis=1 + axis) for axis in range(3) for side in (0, 1)]
    return np.stack([face[:, [0, 0, 1, 1], [0, 1, 1, 0]] for face in found], axis=1)


def numbered_faces(cells: Array) -> tuple[Integers, Integers]:
    """Number the faces, and find the outer ones.

    Returns
    -------
    numbers : ndarray, shape (N, 6)
        Two cells share a number if they share the face; -1 for a face without area.
    outer : ndarray, shape (P,)
        Numbers of the faces of one cell only, in ascending order.
    """
    rounded = np.round(faces(cells) / (1e-9 * np.abs(cells).max())).astype(np.int64)
    corner = np.unique(rounded.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 4)
    corner.sort(axis=1)
    flat = (np.diff(corner, axis=1) > 0).sum(axis=1) < 2
    numbers = np.full(len(corner), -1)
    _, numbers[~flat], counts = np.unique(
        corner[~flat], axis=0, return_inverse=True, return_counts=True
    )
    return numbers.reshape(-1, 6), np.flatnonzero(counts == 1)


def panels(cells: Array) -> tuple[Array, Array]:
    """Return the corners of the outer faces (P, 4, 3), and their outward area vectors (P, 3).

    They are in the order of their numbers.
    """
    numbers, outer = numbered_faces(cells)
    place = np.zeros(numbers.max() + 2, dtype=np.int64)
    place[numbers.ravel()] = np.arange(numbers.size)
    chosen = place[outer]
    return faces(cells).reshape(-1, 4, 3)[chosen], outward(cells)[0].reshape(-1, 3)[chosen]


def area_vectors(quadrilaterals: Array) -> Array:
    """Return the area vectors (..., 3), in m^2, of quadrilaterals (..., 4, 3)."""
    x = quadrilaterals
    return np.cross(x[..., 2, :] - x[..., 0, :], x[..., 3, :] - x[..., 1, :]) / 2


def triangles(quadrilaterals: Array) -> tuple[Array, Array]:
    """Return the two triangles (..., 2, 3, 3) of quadrilaterals, and their areas (..., 2)."""
    parts = quadrilaterals[..., [[0, 1, 2], [0, 2, 3]], :]
    one, two = np.moveaxis(parts[..., 1:, :] - parts[..., :1, :], -2, 0)
    return parts, np.linalg.norm(np.cross(one, two), axis=-1) / 2


def outward(cells: Array) -> tuple[Array, Array, Array]:
    """Return outward area vectors and centroids of the faces (N, 6, 3), and the volumes (N,)."""
    quadrilaterals = faces(cells)
    parts, areas = triangles(quadrilaterals)
    whole = areas.sum(axis=-1, keepdims=True)
    share = np.where(whole > 0, areas / np.where(whole > 0, whole, 1.0), 0.5)
    middles = np.einsum("nft,nfti->nfi", share, parts.mean(axis=-2))
    vectors, center = area_vectors(quadrilaterals), cells.mean(axis=(1, 2, 3))[:, None]
    vectors *= np.sign(np.einsum("nfi,nfi->nf", vectors, middles - center))[..., None]
    return vectors, middles, np.einsum("nfi,nfi->n", vectors, middles - center) / 3
