"""Points of the charts: how far off a method was at a step, and what it cost."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from benchmarks.accuracy.subjects import SUBJECTS
from benchmarks.harness.records import Record
from magmotor.device.step_limits import step_limit
from magmotor.run.chart_data import expected

USELESS = 1.0
"""Relative error from which on a result says nothing: as good as a failed step."""


SAME = 1 + 1e-6
"""Errors closer than this are the same: MuJoCo and the reference agree but for rounding."""


class Point(NamedTuple):
    """A method at a step; errors are relative, seconds are wall time of a simulated second.

    The floor is twice the standard error of sampling: an error below cannot be told from none.
    That of a failed run is infinite.
    """

    subject: str
    quantity: str
    method: str
    timestep: float
    error: float
    floor: float
    seconds: float

    @property
    def bound(self) -> float:
        """What the error is at most: itself, or its floor."""
        return max(self.error, self.floor)

    @property
    def stable(self) -> bool:
        """Whether theory says that the step bears the scene at rest; luck may bear longer ones."""
        return self.timestep < step_limit(SUBJECTS[self.subject].scene, self.method)


def points_of(records: Mapping[str, Record]) -> list[Point]:
    """All points in the records, by ascending steps."""
    costs = step_costs(records)
    points = []
    for run in records.values():
        if "quantities" not in run:
            continue
        subject, method, timestep = run["subject"], run["method"], run["timestep"]
        seconds = run["seconds"] if "seconds" in run else costs[subject, method] / timestep
        errors = run.get("errors", dict.fromkeys(run["quantities"], (math.inf, 0.0)))
        points += [
            Point(subject, k, method, timestep, e[0], e[1], seconds) for k, e in errors.items()
        ]
    return sorted(points, key=lambda point: point.timestep)


def step_costs(records: Mapping[str, Record]) -> dict[tuple[str, str], float]:
    """Seconds a step, by subject and method."""
    found = (record for record in records.values() if "seconds_a_step" in record)
    return {
        (record["subject"], method): seconds
        for record in found
        for method, seconds in record["seconds_a_step"].items()
    }


def chosen(points: Iterable[Point], subject: str, quantity: str) -> list[Point]:
    """Those of one quantity of one subject."""
    return [p for p in points if (p.subject, p.quantity) == (subject, quantity)]


def by_method(points: Iterable[Point]) -> dict[str, list[Point]]:
    """The points of each method."""
    found: dict[str, list[Point]] = {}
    for point in points:
        found.setdefault(point.method, []).append(point)
    return found


def front(points: Iterable[Point]) -> list[Point]:
    """The stable points than which none is both cheaper and more accurate, from the cheapest on."""
    found, least = [], USELESS
    stable = (point for point in points if point.stable)
    for point in sorted(stable, key=lambda point: (point.seconds, point.bound)):
        if SAME * point.bound < least:
            found.append(point)
            least = point.bound
    return found


def cheapest(points: Iterable[Point], error: float) -> Point | None:
    """The cheapest stable point that is to be expected to reach an error."""
    reaching = []
    for curve in by_method(point for point in points if point.stable).values():
        curve = sorted(curve, key=lambda p: (p.timestep, p.seconds))
        errors, floors = np.array([(p.error, p.floor) for p in curve]).T
        within = expected(errors, floors) <= error
        reaching += [point for point, reaches in zip(curve, within, strict=True) if reaches]
    return min(reaching, key=lambda point: point.seconds, default=None)
