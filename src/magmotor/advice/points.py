"""Errors and costs of methods: which are best, and costs that are measured in turns."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from operator import attrgetter
from typing import TypeVar

import numpy as np

from magmotor.advice.paths import Runs
from magmotor.common.arrays import Array

MARGIN = 1.2
"""Promised over measured error, for what is between the records."""

TURNS, SAMPLE, PLACES = 5, 0.01, 4
"""Number of times that each cost is measured, the wall time in s of each, and the number of places
along the path from which it starts."""

SAME = 1 + 1e-6
"""Errors closer than this ratio are equal: methods that agree differ by rounding."""

FAIR = 0.05
"""Largest error of a path along which costs are measured."""


@dataclass
class Point:
    """One method at one timestep."""

    method: str
    """An integrator of MuJoCo, a splitting of `Langevin`, or a method of `simulate`."""
    timestep: float
    """In s; for the disk, dimensionless."""
    seconds: float
    """Wall time per simulated second; for the disk, per unit of time."""
    error: float
    """Largest error that counts; infinite if it diverged."""
    diverged: float | None = None
    """Time in s at which the run was no longer finite."""
    norm: float = math.inf
    """Largest error of the quantity as a whole, over its range."""
    worst: float = math.inf
    """Largest error of an element over its own range; `norm` if there are no elements."""
    element: str = ""
    """This element."""


Measured = TypeVar("Measured", bound=Point)


def reaching(
    points: Iterable[Measured],
    error: float,
    bound: Callable[[Measured], float] = attrgetter("error"),
) -> list[Measured]:
    """Return the points whose bound of the error is admissible, the cheapest first."""
    return sorted((p for p in points if bound(p) <= error), key=attrgetter("seconds"))


def promise(point: Point, doubt: float) -> float:
    """Return what the error of a point does not exceed, if its reference is in doubt."""
    return MARGIN * (point.error + doubt)


def expected(errors: Array, floors: Array | float = 0.0) -> Array:
    """Return the errors to expect, in order of increasing timestep.

    An error below its floor counts as the floor. A longer step is taken to be no more accurate than
    a shorter one, as far as the error of the shorter one exceeds its floor.
    """
    return np.maximum(np.maximum(errors, floors), np.maximum.accumulate(errors - floors))


def front(points: Iterable[Measured], bound: Callable[[Measured], float]) -> list[Measured]:
    """Return the points that no other one beats in both error and cost, by increasing cost.

    What counts as the error of a point is its bound.
    """
    best: list[Measured] = []
    for point in sorted(points, key=lambda point: (point.seconds, bound(point))):
        if not best or SAME * bound(point) < bound(best[-1]):
            best.append(point)
    return [point for point in best if np.isfinite(point.error)]


def time_in_turns(runs: Runs, points: Iterable[Point], duration: float, until: float) -> bool:
    """Measure the costs of points at several places along the path.

    The points take turns, so that disturbances affect all; at each place, the minimum counts.

    Returns
    -------
    bool
        Whether there was time for a turn; otherwise the costs stay as they were.
    """
    points = [*points]
    if not points:
        return True
    fair = [p for p in points if p.error <= FAIR] or [min(points, key=lambda p: p.error)]
    guide = min(fair, key=lambda point: point.seconds)
    starts = runs.places(guide.method, guide.timestep, duration, PLACES)
    least = np.full((len(points), len(starts)), np.inf)
    for turn in range(TURNS):
        for point, row in zip(points, least, strict=True):
            seconds = min(duration, SAMPLE / point.seconds) / len(starts)
            steps = max(1, round(seconds / point.timestep))
            for k, start in enumerate(starts):
                taken = runs.timed(point.method, point.timestep, steps, start)
                row[k] = min(row[k], taken / point.timestep)
                if time.perf_counter() > until:
                    return turn > 0
        for point, row in zip(points, least, strict=True):
            point.seconds = float(row.mean())
    return True
