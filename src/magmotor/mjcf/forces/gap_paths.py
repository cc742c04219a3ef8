"""Narrow gaps in one state, and the paths of their flux inside of pieces; see `gaps.py`.

Each point on the surface of the first piece belongs to a node, which takes the share of the flux
that goes through its points. From their mean place x, this goes to the nodes y_n of the second
piece in the shares (|x - y_n|^2 + a^2)^-3/sum_m (|x - y_m|^2 + a^2)^-3. With the reluctances G of a
piece and the fluxes w that enter at its nodes, the potential inside, over the reluctivity, is G w.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.iron_pieces import (
    ANSWERED,
    CHARGE,
    COUNT,
    INNER,
    MODE,
    NET,
    PASSING,
    RADIUS,
    RELUCTIVITY,
    SATURATION,
    STIFFENING,
    SUSCEPTIBILITY,
    nodes_of,
    response_rows,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import prefer_wide_vectors

MOST = 16
"""Number of gaps whose fluxes are found together, at most."""

(
    ONE, OTHER, THROUGH, FLUX, DRIVE, PERMEANCE, PLACE, SLOPE, EXCESS, ROW, PATHS
) = 0, 1, 2, 3, 4, 5, 6, 9, 11, 12, 12 + MOST  # fmt: skip
"""Columns of a gap: the pieces, the second of which is -1 for the plane of iron; the geom of that
piece through which the flux goes, or -1 for all; the flux over the scale of moments; the difference
of potentials that nodes do not see, in T m; P; the mean place of the gap; how the potentials inside
of both pieces rise with their reluctivities; by how much the difference of potentials is too large;
by how much it falls with the fluxes; and where the paths start."""

PER_PIECE = 6
"""Number of gaps for each piece, at most."""

SHARP = 0.5
"""a^2 over the square of the radius of the balls of charge."""

SHARE, X, FELT, ANSWER, U, ROWS = 0, 1, 4, 5, 6, 9
"""Rows of a path: the shares of nodes; in the first piece, x y z of the mean places of their
shares, in m; the potentials of the shares, for a reluctivity of 1, and how the charges or modes of
the piece answer that; and slopes of potentials in the first piece."""


@subroutine
def columns_of_gap(nodes):
    """Return the number of columns of a gap for pieces with this number of nodes at most."""
    return PATHS + 2 * ROWS * nodes


@subroutine
def path_of(gap, piece, side):
    """Return the rows of the path of a gap in its first or second piece."""
    start = PATHS + side * (len(gap) - PATHS) // 2
    return memory.numbers(gap.ctypes.data + 8 * start, ROWS, int(piece[COUNT]))


@subroutine
def set_shares(state, gap):
    """Write the shares of the nodes of the second piece, from those of the first one."""
    if gap[OTHER] < 0.0:
        return
    piece, other = state.pieces[int(gap[ONE])], state.pieces[int(gap[OTHER])]
    one, two = path_of(gap, piece, ONE), path_of(gap, other, OTHER)
    own, two[SHARE] = nodes_of(state.nodes, other), 0.0
    for k in range(one.shape[1]):
        if one[SHARE, k] > 0.0:
            total = _weigh(two[FELT], other, own, one, k)
            for n in range(two.shape[1]):
                two[SHARE, n] += one[SHARE, k] * two[FELT, n] / total


@subroutine
def _weigh(weights, piece, own, path, k):
    """Write the weights of nodes at the mean place of another one; return their sum."""
    prefer_wide_vectors()
    x, y, z, total = path[X, k], path[X + 1, k], path[X + 2, k], 0.0
    width = SHARP * piece[RADIUS] * piece[RADIUS]
    for n in range(len(weights)):
        u, v, w = own[0, n] - x, own[1, n] - y, own[2, n] - z
        inverse = 1.0 / (u * u + v * v + w * w + width)
        weights[n] = inverse * inverse * inverse
        total += weights[n]
    return total


@subroutine
def set_answer(path, piece):
    """Write the potentials of the shares in a path, and how the piece answers them."""
    rows = response_rows(piece)[responses.ROWS :]
    _multiply(path[FELT], rows[int(piece[COUNT]) :], path[SHARE])
    _multiply(path[ANSWER], rows, path[FELT])


@subroutine
def _multiply(found, rows, vector):
    """Write the product of a symmetric matrix, or of modes, with a vector."""
    for j in range(len(found)):
        total, row = 0.0, rows[j]
        for k in range(len(vector)):
            total += row[k] * vector[k]
        found[j] = total


@subroutine
def add_flux(piece, own, path, flux):
    """Let flux enter a piece on a path."""
    for k in range(own.shape[1]):
        piece[PASSING] += flux * path[SHARE, k] * (2.0 * own[INNER, k] + flux * path[FELT, k])
        own[ANSWERED, k] += flux * path[ANSWER, k]
    for k in range(own.shape[1]):
        own[INNER, k] += flux * path[FELT, k]


@subroutine
def drop_along(piece, own, path):
    """Return the potential inside of a piece where a path starts, and its slope by the reluctivity.

    The slope is that for a fixed potential of everything else.
    """
    nu, net, drop, slope = piece[RELUCTIVITY], piece[NET], 0.0, 0.0
    rows = response_rows(piece)
    slopes, equilibrium, more = rows[3], rows[4], nu - 1.0 / piece[SUSCEPTIBILITY]
    for k in range(own.shape[1]):
        charge = own[CHARGE, k] - net * equilibrium[k]
        drop += path[FELT, k] * charge + path[SHARE, k] * own[INNER, k]
        slope += path[SHARE, k] * own[INNER, k]
    for j in range(own.shape[1] if piece[SATURATION] > 0.0 else 0):
        part = 1.0 / (1.0 + more * slopes[j])
        answer = part * (own[MODE, j] + nu * own[ANSWERED, j])
        change = answer * (1.0 - nu * slopes[j] * part) + nu * part * own[ANSWERED, j]
        slope -= path[ANSWER, j] * change
    return nu * drop, slope


@subroutine
def coupling_of(piece, one, slope, other, other_slope):
    """Return by how much the flux on one path raises the potential where another one starts.

    Both potentials rise with the reluctivity by the slopes.
    """
    nu, felt, answered = piece[RELUCTIVITY], 0.0, 0.0
    for k in range(one.shape[1]):
        felt += one[SHARE, k] * other[FELT, k]
    if piece[SATURATION] > 0.0:
        slopes, more = response_rows(piece)[3], nu - 1.0 / piece[SUSCEPTIBILITY]
        for j in range(one.shape[1]):
            answered += one[ANSWER, j] * other[ANSWER, j] / (1.0 + more * slopes[j])
    else:
        for k in range(one.shape[1]):
            answered += one[FELT, k] * other[ANSWER, k]
    return nu * (felt - nu * answered) + piece[STIFFENING] * slope * other_slope


@subroutine
def set_potentials(state, gap):
    """Write the potentials inside of both pieces to the path in the first one, and their slopes.

    These are differences between a node and the place in the second piece where its flux goes, and
    the slopes are by that place.
    """
    piece = state.pieces[int(gap[ONE])]
    one = path_of(gap, piece, ONE)
    _set_inner(one[FELT], piece, nodes_of(state.nodes, piece))
    one[U:] = 0.0
    if gap[OTHER] < 0.0:
        return
    other = state.pieces[int(gap[OTHER])]
    two, nodes = path_of(gap, other, OTHER), nodes_of(state.nodes, other)
    _set_inner(two[FELT], other, nodes)
    for k in range(one.shape[1]):
        if one[SHARE, k] > 0.0:
            _subtract(one, k, two, other, nodes)


@subroutine
def _set_inner(inner, piece, own):
    """Write the potentials inside of a piece."""
    rows, net = response_rows(piece), piece[NET]
    equilibrium, felt = rows[4], rows[responses.ROWS + int(piece[COUNT]) :]
    for k in range(len(inner)):
        total = own[INNER, k]
        for j in range(len(inner)):
            total += felt[k, j] * (own[CHARGE, j] - net * equilibrium[j])
        inner[k] = piece[RELUCTIVITY] * total


@subroutine
def _subtract(one, k, two, piece, own):
    """Subtract the potential in the second piece from that of a node in the first one."""
    total = _weigh(two[ANSWER], piece, own, one, k)
    width, drop = SHARP * piece[RADIUS] * piece[RADIUS], 0.0
    mx = my = mz = px = py = pz = 0.0
    for n in range(two.shape[1]):
        x, y, z = one[X, k] - own[0, n], one[X + 1, k] - own[1, n], one[X + 2, k] - own[2, n]
        share = two[ANSWER, n] / total
        part = -6.0 * share / (x * x + y * y + z * z + width)
        drop += share * two[FELT, n]
        mx, my, mz = mx + part * x, my + part * y, mz + part * z
        part *= two[FELT, n]
        px, py, pz = px + part * x, py + part * y, pz + part * z
    one[FELT, k] -= drop
    one[U, k], one[U + 1, k], one[U + 2, k] = drop * mx - px, drop * my - py, drop * mz - pz
