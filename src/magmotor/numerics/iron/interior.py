"""Potential inside a piece whose surface passes a given flux: the Neumann-to-Dirichlet map.

Unknown are the potentials of the faces. A cell with outward area vectors S and volume V has the
mean gradient S'u/V, which is exact for linear potentials; what else is in u counts as in finite
volumes. On rectangular grids, the method is that of finite volumes, and the energy of a flux is
never below the true one (Thomson's principle); on tetrahedra, it would be Crouzeix and Raviart's.

References
----------
F. Brezzi, K. Lipnikov, M. Shashkov, SIAM J. Numer. Anal. 43 (2005) 1872.
"""

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from magmotor.common.arrays import Array
from magmotor.numerics.iron.meshes import cells_between, numbered_faces, outward

CHUNK = 4
"""Number of fluxes at a time: few, since the threads of BLAS would wait for each other."""


def stiffness(vectors: Array, middles: Array, volumes: Array) -> Array:
    """Return the cells' stiffness matrices (N, 6, 6), in m: fluxes of potentials of the faces."""
    areas = np.linalg.norm(vectors, axis=-1)
    real = np.where(areas > 0, areas, 1.0)
    share = areas / areas.sum(axis=1, keepdims=True)
    to = middles - np.einsum("nf,nfi->ni", share, middles)[:, None]
    depth = np.einsum("nfi,nfi->nf", vectors, to) / real
    cost = np.where(areas > 0, areas / np.where(areas > 0, depth, 1.0), 0.0)
    linear = np.concatenate([np.ones_like(areas)[..., None], to], axis=-1)
    linear /= np.sqrt(np.einsum("nf,nfi->ni", cost, linear**2))[:, None]
    weighted = cost[..., None] * linear
    gram = np.einsum("nfi,nfj->nij", weighted, linear)
    rest = -weighted @ np.linalg.solve(gram, weighted.swapaxes(1, 2))
    rest[:, range(6), range(6)] += cost
    return rest + vectors @ vectors.swapaxes(1, 2) / volumes[:, None, None]


def neumann_to_dirichlet(cells: Array) -> Array:
    """Compute the matrix from fluxes through outer faces to the mean potentials on them.

    Parameters
    ----------
    cells : ndarray, shape (N, 2, 2, 2, 3)
        Corners of the cells, in m.

    Returns
    -------
    ndarray, shape (P, P)
        In 1/m, for fluxes whose sum is zero; the potential is zero on the last outer face.
    """
    numbers, outer = numbered_faces(cells)
    local = stiffness(*outward(cells))
    rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
    kept = (rows >= 0) & (columns >= 0)
    size = numbers.max() + 1
    whole = csc_array(coo_array((local[kept], (rows[kept], columns[kept])), shape=(size, size)))
    free = np.delete(np.arange(size), outer[-1])
    place = np.searchsorted(free, outer[:-1])
    symmetric = {"SymmetricMode": True}
    factors = splu(csc_array(whole[free][:, free]), "MMD_AT_PLUS_A", 0.0, options=symmetric)
    found = np.zeros((len(outer), len(outer)))
    for start in range(0, len(place), CHUNK):
        some = place[start : start + CHUNK]
        loads = np.zeros((len(free), len(some)))
        loads[some, np.arange(len(some))] = 1.0
        found[:-1, start : start + len(some)] = factors.solve(loads)[place]
    return (found + found.T) / 2


def neumann_to_dirichlet_of_box(lines: list[Array]) -> Array:
    """Compute the same matrix for a box, up to a constant potential, by separation of variables.

    Parameters
    ----------
    lines : list of ndarray
        Coordinates of the grid along x, y and z, in m; see `meshes.spaced`.

    Returns
    -------
    ndarray, shape (P, P)
        In 1/m, in the order of `meshes.panels`.
    """
    values, vectors = zip(*map(_modes, lines), strict=True)
    rate = values[0][:, None, None] + values[1][:, None] + values[2]
    rate[0, 0, 0] = np.inf
    widths = np.meshgrid(*map(np.diff, lines), indexing="ij")
    numbers, outer = numbered_faces(cells_between(lines))
    cell, side = np.divmod(np.argsort(numbers.ravel(), stable=True), 6)
    first = np.searchsorted(np.sort(numbers.ravel()), outer)
    cell, axis = cell[first], side[first] // 2
    index = np.unravel_index(cell, rate.shape)
    modes = [vector[place] for vector, place in zip(vectors, index, strict=True)]
    modes = np.einsum("pi,pj,pk->pijk", *modes) / np.sqrt(rate)
    modes = modes.reshape(len(outer), -1)
    width = np.stack([w.ravel()[cell] for w in widths])
    depth = np.take_along_axis(width, axis[None], axis=0)[0]
    return modes @ modes.T + np.diag(depth**2 / (2 * width.prod(axis=0)))


def _modes(lines: Array) -> tuple[Array, Array]:
    """Return the eigenvalues, the first 0, and modes (cells, modes) of finite volumes on a line."""
    widths = np.diff(lines)
    difference = np.diff(np.eye(len(widths)), axis=0)
    matrix = difference.T @ (2 / (widths[:-1] + widths[1:])[:, None] * difference)
    return eigh(matrix, np.diag(widths))
