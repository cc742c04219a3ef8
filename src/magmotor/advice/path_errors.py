"""Errors of paths against a reference that proves itself by halving its timestep."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array

ORDERS = (1, 2, 4)
"""Orders at which paths are extrapolated to timestep 0."""

LEAST = 1e-300
"""Stands for no doubt at all."""

OTHERS = 4.0
"""Weight of the doubt of another integrator; its halved timesteps say little about chaos."""


class Samples(NamedTuple):
    """A quantity at the start of a path, and after every so many ticks of a common clock."""

    ticks: int
    values: Array
    """Shape (records, n)."""

    def apart(self, other: "Samples", until: float = math.inf) -> Array:
        """Return the differences (records, n) of two paths at common times, until a tick."""
        common = math.lcm(self.ticks, other.ticks)
        one, two = self.values[:: common // self.ticks], other.values[:: common // other.ticks]
        count = int(min(len(one), len(two), until // common + 1))
        return one[:count] - two[:count]

    def thinned(self, ticks: int) -> Array:
        """Return the values after every so many ticks, a multiple of its own."""
        return self.values[:: ticks // self.ticks]


class Reference(NamedTuple):
    """The most accurate path of a quantity, and how far that can be trusted."""

    name: str
    path: Samples
    doubt: Array
    """Largest distances up to each record, shape (records, k), from a less accurate path."""


def reference(
    paths: Mapping[str, Sequence[tuple[float, Samples]]], distances: Callable[[Array], Array]
) -> Reference:
    """Return the most trustworthy path of a quantity.

    Each integrator offers its finest path, and extrapolations of its finest two paths to timestep
    0. The doubt of an offer is its largest distance from the same at twice the timestep, at least
    half of that one's distance from the same at four times the timestep, and at least its distance
    from the best offer of another integrator beyond four times the doubt of
    that one.

    Parameters
    ----------
    paths : mapping
        For each integrator, at least two paths, and their timesteps, which halve from one to the
        next.
    distances : callable
        Returns the sizes (records, k) of differences (records, n), as a whole and of elements.
    """
    best = sorted(
        (min(_offers(name, own, distances), key=_usual_doubt) for name, own in paths.items()),
        key=_usual_doubt,
    )
    first = best[0]
    for other in best[1:2]:
        common = math.lcm(first.path.ticks, other.path.ticks)
        apart = distances(first.path.apart(other.path))
        beyond = apart - OTHERS * other.doubt[:: common // other.path.ticks][: len(apart)]
        so_far = np.repeat(np.maximum.accumulate(beyond), common // first.path.ticks, axis=0)
        missing = max(0, len(first.doubt) - len(so_far))
        so_far = np.pad(so_far, ((0, missing), (0, 0)), "edge")
        first = first._replace(doubt=np.maximum(first.doubt, so_far[: len(first.doubt)]))
    return first


def _offers(
    integrator: str,
    paths: Sequence[tuple[float, Samples]],
    distances: Callable[[Array], Array],
) -> list[Reference]:
    timestep, chain = paths[-1][0], [path for _, path in paths[-4:]]
    offers = {f"{integrator} at {timestep:.3g} s": chain[-3:]}
    if len(chain) > 3:
        for order in ORDERS:
            name = f"{integrator} extrapolated from {timestep:.3g} s at order {order}"
            offers[name] = [_extrapolated(coarse, fine, order) for coarse, fine in pairwise(chain)]
    return [Reference(name, own[-1], _doubt(own, distances)) for name, own in offers.items()]


def _extrapolated(coarse: Samples, fine: Samples, order: int) -> Samples:
    """Return the path at timestep 0 to which two paths lead, at their common times."""
    ticks, change = math.lcm(coarse.ticks, fine.ticks), fine.apart(coarse)
    return Samples(ticks, fine.thinned(ticks)[: len(change)] + change / (2**order - 1))


def _doubt(chain: Sequence[Samples], distances: Callable[[Array], Array]) -> Array:
    """Return the largest changes so far by the last of several halvings, at the last one's records.

    Two paths may agree by accident. The change before that one counts half, as at order 1; where it
    is not known, the last one counts twice. Every common record counts: an error may be large
    during a few steps only, as in a contact.
    """
    path = chain[-1]
    times = path.ticks * np.arange(len(path.values))
    changes = []
    for coarse, fine in pairwise(chain):
        largest = np.maximum.accumulate(distances(fine.apart(coarse)))
        next_common = -(-times // math.lcm(coarse.ticks, fine.ticks))
        changes.append(largest[np.minimum(next_common, len(largest) - 1)])
    last = changes[-1]
    return np.maximum(last, changes[-2] / 2) if len(changes) > 1 else 2 * last


def _usual_doubt(offer: Reference) -> float:
    """Return the mean logarithm of the doubt over time and elements, in any units.

    Chaos makes all last ones alike.
    """
    return float(np.log(np.maximum(offer.doubt, LEAST)).mean())


class Order(NamedTuple):
    """The order at which errors decrease with the timestep, and its standard error."""

    value: float
    doubt: float


def observed_order(points: Sequence[tuple[float, float]], floor: float) -> Order | None:
    """Return the order of (timestep, error) by a straight line through their logarithms.

    Only errors from three times the floor to 0.1 count; there must be three of them, and the
    standard error at most 0.5. Contacts often leave no order.
    """
    used = np.log([point for point in points if 3 * floor < point[1] < 0.1])
    if len(used) < 3:
        return None
    steps, errors = used[:, 0], used[:, 1]
    (slope, offset), covariance = np.polyfit(steps, errors, 1, cov="unscaled")
    residual = errors - slope * steps - offset
    variance = (residual**2).sum() / (len(used) - 2) * covariance[0, 0]
    doubt = float(np.sqrt(variance))
    return Order(float(slope), doubt) if doubt <= 0.5 else None
