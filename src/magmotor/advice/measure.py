"""Errors and costs of all integrators of MuJoCo at several timesteps, from one start."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from magmotor.advice.errors import Reference, path_error, reference
from magmotor.advice.paths import INTEGRATORS, OutOfTime, Path, Runs
from magmotor.advice.quantities import KINETIC, Quantity
from magmotor.advice.statistics import REPLICAS, Ensemble
from magmotor.common.arrays import Array

RECORDS = 96
"""Smallest number of intervals between records; the largest is almost twice as many."""

COARSEST = 8
"""Longest timestep in intervals."""

FEWEST = 12
"""Smallest number of steps of a path."""

FINEST = 2.0**-20
"""Shortest timestep over the model's."""

USELESS = 0.5
"""Larger errors end the search for longer timesteps."""

PROVEN, TRUSTED = 0.02, 0.25
"""Doubt of the reference over the error asked for: what is aimed at, and what is enough."""

JUDGES = {"RK4": 0.3, "implicitfast": 0.25, "Euler": 0.0}
"""Integrators that yield the reference, and their shares of the budget; Euler only helps out."""


PERTURBED = 1e-3
"""Change of the initial velocities of replicas, over the fastest one."""


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


class Measurement:
    """Paths of a quantity by all integrators, recorded at the same times.

    Timesteps are the model's times 2^k or 1.5 2^k. Records are at multiples of an interval, or of
    the timestep if that is longer.

    Parameters
    ----------
    runs : Runs
    quantity : Quantity
    duration : float
        In s; it is rounded to a multiple of eight intervals.

    Attributes
    ----------
    until : float
        Value of `time.perf_counter` after which no run is started or continued.
    """

    def __init__(self, runs: Runs, quantity: Quantity, duration: float):
        self.runs, self.quantity, self.until = runs, quantity, math.inf
        self.own = runs.timestep
        steps = duration / self.own
        self._each = 3 * 2 ** max(0, math.floor(math.log2(steps / (3 * RECORDS))))
        self.intervals = COARSEST * max(1, round(steps / self._each / COARSEST))
        self.interval = self._each * self.own
        self._longest = min(COARSEST * self._each, self.intervals * self._each / FEWEST)
        self.paths: dict[tuple[str, float], Path] = {}
        self._values: dict[tuple[str, float], Array] = {}
        self._workspace = mujoco.MjData(runs.model)
        self.on_run: Callable[[str], object] = lambda _: None

    @property
    def duration(self) -> float:
        """Duration of the paths in s."""
        return self.intervals * self.interval

    def values(self, integrator: str, factor: float) -> Array | None:
        """Return the quantity along a path at a multiple of the model's timestep.

        It is None if the run diverged.

        Raises
        ------
        OutOfTime
        """
        key = integrator, factor
        if key not in self.paths:
            self.on_run(f"{integrator} at {factor * self.own:.3g} s")
            path = self._run(integrator, factor)
            if path.diverged is None:
                if not self._values:
                    self.quantity = self.quantity.scaled_by(
                        self.runs.model, self._workspace, path.states
                    )
                self._values[key] = self.along(path.states)
            self.paths[key] = path
        return self._values.get(key)

    def ensemble(self, integrator: str, factor: float) -> Ensemble | None:
        """Return paths from perturbed starts at a multiple of the model's timestep.

        It is None if one of the runs diverged.

        Raises
        ------
        OutOfTime
        """
        paths, kinetic = [], []
        for seed in range(REPLICAS):
            self.on_run(f"{integrator} at {factor * self.own:.3g} s, replica {seed}")
            path = self._run(integrator, factor, self.runs.perturbed(PERTURBED, seed))
            if path.diverged is not None:
                return None
            paths.append(self.along(path.states))
            kinetic.append(KINETIC.along(self.runs.model, self._workspace, path.states)[:, 0])
        return Ensemble(paths, kinetic)

    def _run(self, integrator: str, factor: float, start: Array | None = None) -> Path:
        every = max(1, round(self._each / factor))
        timestep = factor * self.own
        records = round(self.duration / (every * timestep))
        return self.runs.path(
            integrator, timestep, every, records, start=start, until=self.until
        )

    def along(self, states: Array) -> Array:
        """Return the quantity (records, n) along recorded states."""
        return self.quantity.along(self.runs.model, self._workspace, states)

    def reference(self, error: float) -> Reference | None:
        """Return a reference, for an error relative to the range of the quantity; None without."""
        found: dict[str, list[tuple[float, Array]]] = {}
        budget, proof = self.until - time.perf_counter(), PROVEN
        for integrator, share in JUDGES.items():
            if integrator == "Euler" and found:
                break
            end = time.perf_counter() + (share or 0.3) * budget
            chain = self._halved(integrator, proof * error, end)
            if len(chain) > 1:
                found[integrator] = chain
                proof = TRUSTED
        return reference(found) if found else None

    def _halved(self, integrator: str, doubt: float, end: float) -> list[tuple[float, Array]]:
        """Return paths at half timesteps until the doubt about the quantity is this small."""
        chain: list[tuple[float, Array]] = []
        factor = 1.0
        while factor >= FINEST:
            try:
                values = self.values(integrator, factor)
            except OutOfTime:
                break
            path = self.paths[integrator, factor]
            if values is None:
                chain.clear()
            else:
                chain.append((path.timestep, values))
            if len(chain) > 2:
                last = reference({integrator: chain}).doubt[-1]
                if last <= doubt * self.quantity.range(values):
                    break
            predicted = 2 * self.duration * path.seconds / path.timestep
            if time.perf_counter() + predicted > end and len(chain) != 1:
                break
            factor /= 2
        return chain

    def points(
        self, truth: Reference, error: float, intervals: int, scale: float
    ) -> Iterator[Point]:
        """Yield the points of every integrator at useful timesteps.

        Parameters
        ----------
        truth : Reference
        error : float
            Relative error at which the search for shorter timesteps ends.
        intervals : int
            Only the path up to this many intervals counts.
        scale : float
            Errors are relative to this.
        """
        floor = truth.doubt[intervals] / scale
        for integrator in INTEGRATORS:
            found: dict[float, Point] = {}
            try:
                for factor in self._useful(found, max(error, floor)):
                    found[factor] = self._point(integrator, factor, truth.values, intervals, scale)
            except OutOfTime:
                pass
            yield from found.values()

    def _useful(self, found: dict[float, Point], error: float) -> Iterator[float]:
        """Yield timesteps to measure, given what was found at those before."""
        yield (factor := 1.0)
        while found[factor].error < USELESS and 2 * factor <= self._longest:
            factor *= 2
            if not self._shares_records(factor):
                factor *= 0.75
            yield factor
        factor = 1.0
        while min(point.error for point in found.values()) > error and factor > FINEST:
            factor /= 2
            predicted = self.duration * found[2 * factor].seconds * 2
            if time.perf_counter() + predicted > self.until:
                return
            yield factor
        good = [factor for factor, point in found.items() if point.error <= error]
        if good and self._shares_records(1.5 * max(good)) and 1.5 * max(good) not in found:
            yield 1.5 * max(good)

    def _shares_records(self, factor: float) -> bool:
        ratio = max(self._each / factor, factor / self._each)
        return ratio == round(ratio)

    def _point(
        self, integrator: str, factor: float, truth: Array, intervals: int, scale: float
    ) -> Point:
        values = self.values(integrator, factor)
        path = self.paths[integrator, factor]
        error, seconds = math.inf, path.seconds / path.timestep
        if values is not None:
            each = max(1, round(factor / self._each))
            thinned = truth[: intervals + 1 : each]
            error = path_error(values[: len(thinned)], thinned) / scale
        return Point(integrator, path.timestep, seconds, error, path.diverged)


def front(points: Iterable[Point], floor: float) -> list[Point]:
    """Return the points that no other one beats in both error and cost, by increasing cost.

    Errors below the floor count as the floor.
    """
    best: list[Point] = []
    for point in sorted(points, key=lambda point: (point.seconds, max(point.error, floor))):
        if not best or max(point.error, floor) < max(best[-1].error, floor):
            best.append(point)
    return [point for point in best if np.isfinite(point.error)]


TURNS, SAMPLE = 5, 0.01
"""Number of times that each cost is measured, and the wall time in s of each."""


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
