"""Points of the charts: the error of a method at a step, and its cost."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from benchmarks.accuracy.scenes import SCENES
from benchmarks.harness.records import Record
from magmotor.advice import points as advice
from magmotor.device.step_limits import step_limit

USELESS = 1.0
"""Relative error from which a result is useless, like a failed step."""


@dataclass(kw_only=True)
class Point(advice.Point):
    """A point of a chart; the error of a failed run is infinite."""

    scene: str
    quantity: str
    floor: float
    """Twice the standard error of sampling: a smaller error is indistinguishable from zero."""

    @property
    def bound(self) -> float:
        """Upper bound of the error: the error or its floor."""
        return max(self.error, self.floor)

    @property
    def stable(self) -> bool:
        """Whether the step is stable at rest by theory; longer ones may succeed by chance."""
        return self.timestep < step_limit(SCENES[self.scene].scene, self.method)


def points_of(records: Mapping[str, Record]) -> list[Point]:
    """Return all points of the records, sorted by step."""
    costs = step_costs(records)
    points = []
    for run in records.values():
        if "quantities" not in run:
            continue
        scene, method, timestep = run["scene"], run["method"], run["timestep"]
        seconds = run["seconds"] if "seconds" in run else costs[scene, method] / timestep
        errors = run.get("errors", dict.fromkeys(run["quantities"], (math.inf, 0.0)))
        points += [
            Point(method, timestep, seconds, error, scene=scene, quantity=quantity, floor=floor)
            for quantity, (error, floor) in errors.items()
        ]
    return sorted(points, key=lambda point: point.timestep)


def step_costs(records: Mapping[str, Record]) -> dict[tuple[str, str], float]:
    """Return the seconds per step, by scene and method."""
    found = (record for record in records.values() if "seconds_a_step" in record)
    return {
        (record["scene"], method): seconds
        for record in found
        for method, seconds in record["seconds_a_step"].items()
    }


def chosen(points: Iterable[Point], scene: str, quantity: str) -> list[Point]:
    """Return the points of one quantity of one scene."""
    return [p for p in points if (p.scene, p.quantity) == (scene, quantity)]


def by_method(points: Iterable[Point]) -> dict[str, list[Point]]:
    """Return the points of each method."""
    found: dict[str, list[Point]] = {}
    for point in points:
        found.setdefault(point.method, []).append(point)
    return found


def front(points: Iterable[Point]) -> list[Point]:
    """Return the stable points that no other surpasses in cost and accuracy, cheapest first."""
    useful = (point for point in points if point.stable and point.bound < USELESS)
    return advice.front(useful, attrgetter("bound"))


def cheapest(points: Iterable[Point], error: float) -> Point | None:
    """Return the cheapest stable point that is expected to reach an error."""
    reaching = []
    for curve in by_method(point for point in points if point.stable).values():
        curve = sorted(curve, key=lambda p: (p.timestep, p.seconds))
        errors, floors = np.array([(p.error, p.floor) for p in curve]).T
        within = advice.expected(errors, floors) <= error
        reaching += [point for point, reaches in zip(curve, within, strict=True) if reaches]
    return min(reaching, key=lambda point: point.seconds, default=None)
