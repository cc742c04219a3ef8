"""The fluxes through all narrow gaps, which make the energy of iron stationary; see `gaps.py`."""

import math

from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.gap_paths import (
    DRIVE,
    EXCESS,
    FLUX,
    MOST,
    ONE,
    OTHER,
    PERMEANCE,
    ROW,
    SLOPE,
    add_flux,
    coupling_of,
    drop_along,
    path_of,
)
from magmotor.mjcf.forces.iron_pieces import (
    CHARGE,
    EXTENT,
    MUTUAL,
    NET,
    POTENTIAL,
    SATURATION,
    nodes_of,
    number_of,
    response_rows,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

LARGEST_STEP = 0.2
"""Largest change of a flux at a time, over that which saturates a piece: what is far above that
would saturate it without end."""


@subroutine
def update_fluxes(state):
    """Let the fluxes approach those for the present potentials; return the largest change.

    This is a step of Newton's method, for some gaps at a time. The charges follow.
    """
    change = 0.0
    for first in range(0, len(state.gaps), MOST):
        count = min(MOST, len(state.gaps) - first)
        for k in range(first, first + count):
            _set_excess(state, k)
        for k in range(first, first + count):
            for j in range(count):
                state.gaps[k, ROW + j] = _load(state, k, first + j)
        _solve(state.gaps, first, count)
        for k in range(first, first + count):
            change = max(change, abs(state.gaps[k, EXCESS]))
            most = LARGEST_STEP * _most(state, state.gaps[k])
            _add_flux(state, k, max(-most, min(state.gaps[k, EXCESS], most)))
    return change


@subroutine
def _most(state, gap):
    """Return the flux that saturates the mean cross section of a piece at a gap."""
    most = math.inf
    for side in range(1 if gap[OTHER] < 0.0 else 2):
        piece = state.pieces[int(gap[side])]
        if piece[SATURATION] > 0.0:
            section = number_of(piece, responses.VOLUME) / (2.0 * piece[EXTENT])
            most = min(most, VACUUM_PERMEABILITY * piece[SATURATION] * section)
    return most


@subroutine
def _set_excess(state, k):
    """Write by how much the difference of potentials is above what the flux needs."""
    gap = state.gaps[k]
    gap[EXCESS] = gap[DRIVE] - gap[FLUX] / gap[PERMEANCE]
    for side in range(1 if gap[OTHER] < 0.0 else 2):
        piece = state.pieces[int(gap[side])]
        own, equilibrium = nodes_of(state.nodes, piece), response_rows(piece)[4]
        drop, gap[SLOPE + side] = drop_along(piece, own, path_of(gap, piece, side))
        total = piece[NET] / number_of(piece, responses.CAPACITY) - drop
        for n in range(own.shape[1]):
            total += equilibrium[n] * own[POTENTIAL, n]
        gap[EXCESS] += total if side == ONE else -total


@subroutine
def _load(state, k, j):
    """Return by how much the difference of potentials at a gap falls with the flux through one."""
    one, other, total = state.gaps[k], state.gaps[j], 0.0
    if k == j:
        total = 1.0 / one[PERMEANCE]
    for side in range(1 if one[OTHER] < 0.0 else 2):
        for end in range(1 if other[OTHER] < 0.0 else 2):
            piece, number = state.pieces[int(one[side])], int(other[end])
            load = piece[MUTUAL + number]
            if one[side] == number:
                load += coupling_of(
                    piece, path_of(one, piece, side), one[SLOPE + side],
                    path_of(other, piece, end), other[SLOPE + end],
                )  # fmt: skip
            total += load if side == end else -load
    return total


@subroutine
def _solve(gaps, first, count):
    """Solve for the changes of the fluxes, by elimination: the matrix is positive."""
    for k in range(count):
        for i in range(k + 1, count):
            factor = gaps[first + i, ROW + k] / gaps[first + k, ROW + k]
            for j in range(k, count):
                gaps[first + i, ROW + j] -= factor * gaps[first + k, ROW + j]
            gaps[first + i, EXCESS] -= factor * gaps[first + k, EXCESS]
    for i in range(count):
        k = count - 1 - i
        for j in range(k + 1, count):
            gaps[first + k, EXCESS] -= gaps[first + k, ROW + j] * gaps[first + j, EXCESS]
        gaps[first + k, EXCESS] /= gaps[first + k, ROW + k]


@subroutine
def _add_flux(state, k, change):
    """Add to the flux through a gap, which leaves net charges on both sides."""
    gap = state.gaps[k]
    gap[FLUX] += change
    for side in range(1 if gap[OTHER] < 0.0 else 2):
        piece, sign = state.pieces[int(gap[side])], 1.0 if side == ONE else -1.0
        own, equilibrium = nodes_of(state.nodes, piece), response_rows(piece)[4]
        add_flux(piece, own, path_of(gap, piece, side), sign * change)
        piece[NET] -= sign * change
        for n in range(own.shape[1]):
            own[CHARGE, n] -= sign * change * equilibrium[n]
