"""The smallest layout of dipoles that represents a magnet as accurately as required.

The layouts are the quadratures of `magmotor.numerics.magnet_shapes`. They are tried in the order
of their numbers of dipoles, and judged by a much finer one: by its field at points around the
magnet, and by the force between two such magnets one above and beside the other.
"""

import itertools
import math
from functools import cached_property, lru_cache

import numpy as np

from magmotor import dipoles
from magmotor.common.arrays import Array, Integers
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.magnets.shapes import Cuboid, Orders, Tube
from magmotor.numerics.magnet_shapes import Cloud

LIMIT = 1000
"""Largest number of dipoles of a layout."""

HOPELESS = 5 * LIMIT
"""Number of Gauss points that makes a search hopeless."""

FAR = 1000.0
"""Gap, in units of the magnet's size, beyond which all gaps are treated alike."""

DISTANCES = {1.0: 16000, 1.5: 2000, 3.0: 1000}
"""Distances from the surface, in units of the gap, and numbers of points there.

The error decreases faster than the field with distance.
"""

WEAK = 0.1
"""Fraction of the strongest field at a distance below which a field is weak there."""

MARGIN = 0.9
"""Largest part of the error that may be found at the points, since it is larger between them."""

SUSPECTS = 8
"""Number of points at which a layout is tried first: where the previous one was worst."""

FINER = 100.0
"""How much more accurate the finer layout is expected to be."""

TRUSTED = 30.0
"""How much smaller than the error the difference of the finer layout from a still finer one is."""


def smallest_layout(
    body: Cuboid | Tube, direction: tuple[float, float, float], error: float, gap: float
) -> Cloud:
    """Return the points of the smallest layout and their fractions of the moment.

    Parameters
    ----------
    body : Cuboid or Tube
        In m, as the gap; the points too.
    direction : tuple of float
        Unit vector of the magnetization.
    error, gap : float
        See `Magnet.dipoles`.

    Raises
    ------
    ValueError
        More than `LIMIT` dipoles are required.
    """
    found = _smallest_layout(body, direction, error, gap)
    if found is not None:
        return found
    touching = f"for magnets that touch, error=0.5 and gap={_contact_gap(body):.2g}"
    raise ArgumentError(
        "error",
        error,
        f"requires more than {LIMIT} dipoles at gap = {gap:g} m: choose a larger error or gap;"
        f" {touching}",
    )


@lru_cache(maxsize=256)
def _smallest_layout(
    body: Cuboid | Tube, direction: tuple[float, float, float], error: float, gap: float
) -> Cloud | None:
    """Return the same, or None if more than `LIMIT` dipoles are required."""
    size = max(body)
    unit = type(body)(*(length / size for length in body))  # dipoles within 1e-9 m would coincide
    near = min(gap / size, FAR)
    if math.prod(unit.orders(near, math.log(10 / error))) < HOPELESS:
        judge = _trusted_judge(unit, direction, error, near)
        for orders, even in _by_count(unit, judge.orders):
            points, parts = unit.cloud(orders, even)
            if judge.accepts((points, parts)):
                return size * points, parts
    return None


def _contact_gap(body: Cuboid | Tube) -> float:
    """Return the gap in m of the layouts whose force at contact is best, for an error of 0.5.

    Measured: the table of "Magnets of real shapes that touch" in docs/contact.md.
    """
    least, middle, largest = sorted(body.extents)
    return (0.3 if middle**2 >= least * largest else 0.4) * least


def _trusted_judge(
    body: Cuboid | Tube, direction: tuple[float, float, float], error: float, gap: float
) -> "_Judge":
    """Refine the judge's own layout until its field hardly changes."""
    i, j, k = body.orders(gap, math.log(FINER / error))
    orders = i + 2, j + 2, k + 2
    while True:
        judge = _Judge(body, direction, error, gap, orders)
        i, j, k = orders
        orders = 1 + i + i // 4, 1 + j + j // 4, 1 + k + k // 4
        if judge.errors(body.cloud(orders), judge.everywhere[::8]).max() < error / TRUSTED:
            return judge


class _Judge:
    """The field and the forces of a much finer layout."""

    def __init__(
        self,
        body: Cuboid | Tube,
        direction: tuple[float, float, float],
        error: float,
        gap: float,
        orders: Orders,
    ) -> None:
        self.moment, self.error, self.orders = np.array(direction), MARGIN * error, orders
        self.fine = fine = body.cloud(orders)
        i, j, k = body.orders(gap, math.log(10 / error))
        self.partner = body.cloud((i + 3, j + 3, k + 3))  # a mean over a body needs fewer points
        around = [body.around(gap * f, count) for f, count in DISTANCES.items()]
        fields = [self._field(points, fine) for points in around]
        strengths = [np.linalg.norm(field, axis=1) for field in fields]
        self.points, self.fields = np.concatenate(around), np.concatenate(fields)
        self.scale = np.concatenate([np.maximum(s, WEAK * s.max()) for s in strengths])
        self.everywhere = np.arange(len(self.points))
        self.suspects = self.everywhere[:SUSPECTS]
        self.offsets = [
            shift * axis
            for axis, extent in zip(np.eye(3), body.extents, strict=True)
            for shift in (extent + gap * f for f in DISTANCES)
        ]

    @cached_property
    def forces(self) -> list[Array]:
        """The forces on a magnet at the offsets from another one like it."""
        return [self._force(self.fine, self.partner, offset) for offset in self.offsets]

    def accepts(self, cloud: Cloud) -> bool:
        """Whether the field and the forces of a layout are accurate."""
        for chosen in (self.suspects, self.everywhere[::8], self.everywhere):
            errors = self.errors(cloud, chosen)
            if errors.max() >= self.error:
                self.suspects = chosen[np.argsort(errors)[-SUSPECTS:]]
                return False
        return all(
            np.linalg.norm(self._force(cloud, cloud, offset) - force)
            < self.error * np.linalg.norm(force)
            for offset, force in zip(self.offsets, self.forces, strict=True)
        )

    def errors(self, cloud: Cloud, chosen: Integers) -> Array:
        """Relative errors of the field at the chosen points."""
        differences = self._field(self.points[chosen], cloud) - self.fields[chosen]
        return np.linalg.norm(differences, axis=1) / self.scale[chosen]

    def _field(self, points: Array, cloud: Cloud) -> Array:
        return dipoles.field(points, cloud[0], np.outer(cloud[1], self.moment))

    def _force(self, cloud: Cloud, other: Cloud, offset: Array) -> Array:
        """The force on a magnet, as the cloud `other`, at an offset from another one like it."""
        source, target = (np.outer(parts, self.moment) for _, parts in (cloud, other))
        return dipoles.wrench(other[0] + offset, target, cloud[0], source)[0].sum(axis=0)


def _by_count(body: Cuboid | Tube, finest: Orders) -> list[tuple[Orders, bool]]:
    """All layouts up to the finest orders, Gauss or even, with the fewest points first."""
    first, second, third = (range(1, most + 1) for most in finest)
    counted = (
        (body.dipoles((i, j, k), even), even, (i, j, k))
        for i, j, k, even in itertools.product(first, second, third, (False, True))
        if i * k <= LIMIT
    )
    return [(orders, even) for count, even, orders in sorted(counted) if count <= LIMIT]
