"""Errors and costs of integrators: which are best, and costs that are measured in turns."""

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from magmotor.advice.paths import Runs

MARGIN = 1.2
"""Promised over measured error, for what is between the records."""

TURNS, SAMPLE = 5, 0.01
"""Number of times that each cost is measured, and the wall time in s of each."""


@dataclass
class Point:
    """One integrator at one timestep."""

    integrator: str
    timestep: float
    """In s."""
    seconds: float
    """Wall time per simulated second."""
    error: float
    """Largest error along the path over the range of the quantity; infinite if it diverged."""
    diverged: float | None = None
    """Time in s at which the run was no longer finite."""


def front(points: Iterable[Point], floor: float) -> list[Point]:
    """Return the points that no other one beats in both error and cost, by increasing cost.

    Errors below the floor count as the floor.
    """
    best: list[Point] = []
    for point in sorted(points, key=lambda point: (point.seconds, max(point.error, floor))):
        if not best or max(point.error, floor) < max(best[-1].error, floor):
            best.append(point)
    return [point for point in best if np.isfinite(point.error)]


def time_in_turns(runs: Runs, points: Iterable[Point], duration: float, until: float) -> None:
    """Measure the costs of points in turns, so that disturbances affect all; the least counts."""
    points = [*points]
    for _ in range(TURNS):
        for point in points:
            steps = round(min(duration, SAMPLE / point.seconds) / point.timestep)
            taken = runs.timed(point.integrator, point.timestep, max(1, steps)) / point.timestep
            point.seconds = min(point.seconds, taken)
            if time.perf_counter() > until:
                return
