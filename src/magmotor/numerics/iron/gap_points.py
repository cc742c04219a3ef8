"""Points on the surface of a piece, for the integral over a narrow gap; see `forces/gaps.py`."""

import numpy as np

from magmotor.common.arrays import Array
from magmotor.numerics.iron import meshes
from magmotor.numerics.iron.nodes import Nodes

MOST, FINEST = 4000, 4
"""Number of points, roughly, and number of them along an edge of a panel, at most."""

CHUNK = 512
"""Number of points at a time."""


def gap_points(panels: Array, outward: Array, nodes: Nodes) -> Array:
    """Return points on the surface, area vectors there, and nodes to which they belong.

    Parameters
    ----------
    panels : ndarray, shape (P, 4, 3)
        Corners of the panels, in m.
    outward : ndarray, shape (P, 3)
        Their outward area vectors, in m^2.
    nodes : Nodes
        Nodes of the same surface, which know its true shape.

    Returns
    -------
    ndarray, shape (7, N)
        Coordinates in m, outward area vectors in m^2, and the node that counts most at the point.
    """
    count = int(np.clip(np.sqrt(MOST / len(panels)), 1, FINEST))
    u, v = np.meshgrid(*2 * [np.arange(count + 1) / count], indexing="ij")
    shares = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1)
    grid = np.einsum("ijc,pcx->pijx", shares, panels)
    parts = np.stack([grid[:, :-1, :-1], grid[:, 1:, :-1], grid[:, 1:, 1:], grid[:, :-1, 1:]], -2)
    parts = parts.reshape(-1, 4, 3)
    areas = np.linalg.norm(meshes.area_vectors(parts), axis=-1)
    normals = np.repeat(outward, count * count, axis=0)
    normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    middles = parts.mean(axis=-2)
    each = np.concatenate(
        [
            nodes.interpolation(middles[k : k + CHUNK]).argmax(axis=1)
            for k in range(0, len(middles), CHUNK)
        ]
    )
    points, normals = nodes.onto_surface(middles, normals)
    return np.concatenate([points.T, (areas[:, None] * normals).T, each[None]])
