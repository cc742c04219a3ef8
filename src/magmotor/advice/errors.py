"""Errors of paths against a reference that proves itself by halving its timestep."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array

ORDERS = (1, 2, 4)
"""Orders at which paths are extrapolated to timestep 0."""

OTHERS = 4.0
"""Weight of the doubt of another integrator; its halved timesteps say little about chaos."""


class Reference(NamedTuple):
    """A quantity along the most accurate path, and how far that can be trusted."""

    name: str
    values: Array
    """Shape (records, n)."""
    doubt: Array
    """Largest distance up to each record, shape (records,), from a less accurate path."""


def reference(paths: Mapping[str, Sequence[tuple[float, Array]]]) -> Reference:
    """Return the most trustworthy path of a quantity.

    Each integrator offers its finest path, and extrapolations of its finest two paths to timestep
    0. The doubt of an offer is its largest distance from the same at twice the timestep, and at
    least its distance from the best offer of another integrator beyond four times the doubt of
    that one.

    Parameters
    ----------
    paths : mapping
        For each integrator, at least two paths: timestep, which halves from one to the next, and
        the quantity, shape (records, n).
    """
    best = sorted(
        (min(_offers(name, own), key=_last_doubt) for name, own in paths.items()), key=_last_doubt
    )
    first = best[0]
    if len(best) == 1:
        return first
    apart = _running(first.values - best[1].values) - OTHERS * best[1].doubt
    return first._replace(doubt=np.maximum(first.doubt, apart))


def path_error(values: Array, truth: Array) -> float:
    """Return the largest distance of a path (records, n) from the truth at the same times."""
    return float(np.linalg.norm(values - truth, axis=1).max())


def _offers(integrator: str, paths: Sequence[tuple[float, Array]]) -> list[Reference]:
    timestep, fine = paths[-1]
    offers = [Reference(f"{integrator} at {timestep:.3g} s", fine, _running(fine - paths[-2][1]))]
    if len(paths) > 2:
        coarse, middle = paths[-3][1], paths[-2][1]
        for order in ORDERS:
            weight = 1 / (2**order - 1)
            before, after = middle + weight * (middle - coarse), fine + weight * (fine - middle)
            name = f"{integrator} extrapolated from {timestep:.3g} s at order {order}"
            offers.append(Reference(name, after, _running(after - before)))
    return offers


def _last_doubt(offer: Reference) -> float:
    return offer.doubt[-1]


def _running(difference: Array) -> Array:
    return np.maximum.accumulate(np.linalg.norm(difference, axis=1))


class Order(NamedTuple):
    """The order at which errors decrease with the timestep, and its standard error."""

    value: float
    doubt: float


def observed_order(points: Sequence[tuple[float, float]], floor: float) -> Order | None:
    """Return the order of (timestep, error) by a straight line through their logarithms.

    Only errors from three times the floor to 0.2 count; there must be three of them.
    """
    used = np.log([point for point in points if 3 * floor < point[1] < 0.2])
    if len(used) < 3:
        return None
    (slope, _), covariance = np.polyfit(*used.T, 1, cov="unscaled")
    residual = used[:, 1] - np.polyval(np.polyfit(*used.T, 1), used[:, 0])
    variance = (residual**2).sum() / (len(used) - 2) * covariance[0, 0]
    return Order(float(slope), float(np.sqrt(variance)))
