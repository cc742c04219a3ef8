"""Errors and costs of all integrators of MuJoCo at several timesteps, from one start."""

import itertools
import math
import time
from collections.abc import Callable

import numpy as np

from magmotor.advice.measured_quantities import KINETIC, Quantity, motion, over, relative
from magmotor.advice.path_errors import Reference, Samples, reference
from magmotor.advice.paths import INTEGRATORS, OutOfTime, Path, Runs
from magmotor.advice.points import Point, expected
from magmotor.advice.statistics_errors import REPLICAS, Ensemble
from magmotor.common.arrays import Array

RECORDS = 2048
"""Smallest number of ticks of a path, which are the shortest time between records."""

MOST, LONG = 2_000_000, 10_000
"""Largest numbers of numbers recorded of a path, and of records, approximately."""

FEWEST = 12
"""Smallest number of steps of a path."""

FINEST = 2.0**-20
"""Shortest timestep over the model's."""

USELESS = 0.5
"""Larger errors end the search for longer timesteps."""

DEARER = 30.0
"""Ratio of costs beyond which an integrator is not worth another halving of its timestep."""

PROVEN, TRUSTED = 0.02, 0.25
"""Doubt of the reference over the error asked for: what is aimed at, and what is enough."""

JUDGES = {"RK4": 0.3, "implicitfast": 0.25, "Euler": 0.0}
"""Integrators that yield the reference, and their shares of the budget; Euler only helps out."""


SPARSE, COARSE = 8, 4.0
"""Least time between the records of ensembles, in ticks and in timesteps of the model."""

PERTURBED = 1e-3
"""Change of the initial velocities of replicas, over the fastest one."""


class Measurement:
    """Paths of a quantity by all integrators, recorded at common times.

    Timesteps are the model's times 2^k or 1.5 2^k. A path is recorded at each of its steps, or at
    each tick of a clock if that is longer.

    Parameters
    ----------
    runs : Runs
    quantity : Quantity
    duration : float
        In s.
    every_element : bool
        Whether the error of each element over its own range counts, too.

    Attributes
    ----------
    until : float
        Value of `time.perf_counter` after which no run is started or continued.
    tick : float
        In s.
    ticks : int
        Number of ticks of a path.
    moved : float
        Least change of the model's state along a path; see `motion`.
    """

    def __init__(
        self, runs: Runs, quantity: Quantity, duration: float, *, every_element: bool = True
    ):
        self.runs, self.quantity, self._every_element = runs, quantity, every_element
        self.until = self.moved = math.inf
        self._workspace = runs.workspace()
        size = self.along(runs.recorded_start()[np.newaxis]).shape[1]
        wanted, longest = min(RECORDS, max(FEWEST, MOST // size)), min(LONG, MOST // size)
        steps = duration / runs.timestep
        # Short runs have two ticks a timestep at least, so that 1.5 timesteps are possible.
        least = min(1, math.ceil(math.log2(max(FEWEST, longest) / steps)))
        self._divided = 2.0 ** max(least, math.ceil(math.log2(wanted / steps)))
        self.tick = runs.timestep / self._divided
        self.ticks = round(duration / self.tick)
        self._longest = duration / runs.timestep / FEWEST
        self.paths: dict[tuple[str, float], Path] = {}
        self._points: dict[str, dict[float, Point]] = {}
        self._samples: dict[tuple[str, float], Samples] = {}
        self._finest: tuple[int, Array]
        self.on_run: Callable[[str], object] = lambda _: None

    @property
    def duration(self) -> float:
        """Duration of the paths in s."""
        return self.ticks * self.tick

    def samples(self, integrator: str, factor: float) -> Samples | None:
        """Return the quantity along a path at a multiple of the model's timestep.

        It is None if the run diverged.

        Raises
        ------
        OutOfTime
        """
        key = integrator, factor
        if key not in self.paths:
            self.on_run(f"{integrator} at {factor * self.runs.timestep:.3g} s")
            path, states, ticks = self._run(integrator, factor)
            if path.diverged is None:
                if factor <= min((finest for _, finest in self._samples), default=math.inf):
                    self._finest = ticks, states
                    self.quantity = self.within(self.ticks)
                self.moved = min(self.moved, motion(self.runs.model, states))
                self._samples[key] = Samples(ticks, self.along(states))
            self.paths[key] = path
        return self._samples.get(key)

    def within(self, until: int) -> Quantity:
        """Return the quantity with the scale that it has along the finest path up to a tick."""
        ticks, states = self._finest
        states = states[: until // ticks + 1]
        return self.quantity.scaled_by(self.runs.model, self._workspace, states)

    def settled(self, point: Point, settings: dict[str, float]) -> Samples | None:
        """Return the path of a point with other settings of the solver; None if it diverged.

        Raises
        ------
        OutOfTime
        """
        factor = point.timestep / self.runs.timestep
        if not settings:
            return self.samples(point.method, factor)
        self.on_run(f"solver of {point.method}")
        with self.runs.solver(settings):
            path, states, ticks = self._run(point.method, factor)
        return Samples(ticks, self.along(states)) if path.diverged is None else None

    def ensemble(self, integrator: str, factor: float) -> Ensemble | None:
        """Return paths from perturbed starts at a multiple of the model's timestep.

        It is None if one of the runs diverged.

        Raises
        ------
        OutOfTime
        """
        paths, kinetic, seconds = [], [], math.inf
        timestep = factor * self.runs.timestep
        least = max(SPARSE, round(COARSE * self._divided))
        for seed in range(REPLICAS):
            self.on_run(f"{integrator} at {timestep:.3g} s, replica {seed}")
            start = self.runs.perturbed(PERTURBED, seed)
            path, states, _ = self._run(integrator, factor, start, least=least)
            if path.diverged is not None:
                return None
            seconds = min(seconds, path.seconds / timestep)
            paths.append(self.along(states)[:, : self.quantity.size])
            kinetic.append(KINETIC.along(self.runs.model, self._workspace, states)[:, 0])
        return Ensemble(paths, kinetic, seconds)

    def growth(self, perturbation: float) -> float:
        """Return by how much a small perturbation grows after a twentieth of the duration."""
        finite = [key for key, path in self.paths.items() if path.diverged is None]
        key = min(finite, key=lambda key: key[1])
        start = self.runs.perturbed(perturbation, seed=0)
        _, states, ticks = self._run(*key, start)
        apart = Samples(ticks, self.along(states)).apart(self._samples[key])
        largest = np.maximum.accumulate(self.quantity.distances(apart)[:, 0])
        early = largest[max(1, len(largest) // 20)]
        return float(largest[-1] / early) if early > 0.0 else math.inf

    def _run(
        self, integrator: str, factor: float, start: Array | None = None, least: int = 1
    ) -> tuple[Path, Array, int]:
        """Return a path, its recorded states, and the ticks between these, at least so many."""
        step = factor * self._divided
        ticks = max(least, round(step)) if step >= least else least
        timestep = factor * self.runs.timestep
        every = max(1, round(ticks / step))
        ticks = round(every * step)
        return *self.runs.path(
            integrator, timestep, every, self.ticks // ticks, start=start, until=self.until
        ), ticks

    def along(self, states: Array) -> Array:
        """Return the quantity (records, n) along recorded states."""
        return self.quantity.along(self.runs.model, self._workspace, states, self.until)

    def counted(self, ranges: Array) -> Array:
        """Return the ranges (k,) to which errors are relative that count."""
        return ranges if self._every_element else ranges[:1]

    def error(self, apart: Array, ranges: Array) -> float:
        """Return the largest relative error that counts, of differences (records, n)."""
        return relative(self.quantity.distances(apart), self.counted(ranges))

    def reference(self, error: float) -> Reference | None:
        """Return a reference, for a relative error that counts; None without."""
        found: dict[str, list[tuple[float, Samples]]] = {}
        budget, proof = self.until - time.perf_counter(), PROVEN
        for integrator, share in JUDGES.items():
            if integrator == "Euler" and found:
                break
            end = time.perf_counter() + (share or 0.3) * budget
            chain = self._halved(integrator, proof * error, end)
            if len(chain) > 1:
                found[integrator] = chain
                proof = TRUSTED
        return reference(found, self.quantity.distances) if found else None

    def _halved(self, integrator: str, doubt: float, end: float) -> list[tuple[float, Samples]]:
        """Return paths at half timesteps until the doubt about the quantity is this small."""
        chain: list[tuple[float, Samples]] = []
        factor = 1.0
        while factor >= FINEST:
            try:
                samples = self.samples(integrator, factor)
            except OutOfTime:
                break
            path = self.paths[integrator, factor]
            if samples is None:
                chain.clear()
            else:
                chain.append((path.timestep, samples))
            if len(chain) > 2:
                last = reference({integrator: chain}, self.quantity.distances).doubt[-1:]
                ranges = self.quantity.ranges(chain[-1][1].values)
                if relative(last, self.counted(ranges)) <= doubt:
                    break
            predicted = 2 * self.duration * path.seconds / path.timestep
            if time.perf_counter() + predicted > end and len(chain) != 1:
                break
            factor /= 2
        return chain

    def judge(self, truth: Samples, error: float, until: int, ranges: Array) -> None:
        """Measure every integrator at useful timesteps, first the longer ones; fill `points`.

        Parameters
        ----------
        truth : Samples
        error : float
            Relative error at which the search for shorter timesteps ends.
        until : int
            Only the path up to this tick counts.
        ranges : ndarray, shape (1 + elements,)
            Errors are relative to these.

        Raises
        ------
        OutOfTime
        """

        def measured(integrator: str, factor: float) -> Point:
            samples = self.samples(integrator, factor)
            path = self.paths[integrator, factor]
            seconds = path.seconds / path.timestep
            point = Point(integrator, path.timestep, seconds, math.inf, path.diverged)
            if samples is not None:
                self._fill(point, samples.apart(truth, until), ranges)
            self._points.setdefault(integrator, {})[factor] = point
            return point

        for integrator in INTEGRATORS:
            factor = 1.0
            while measured(integrator, factor).error < USELESS and 2 * factor <= self._longest:
                factor *= 2
        # RK4 first: what it costs bounds what is worth trying.
        for integrator, found in sorted(self._points.items(), key=lambda item: item[0] != "RK4"):
            factor = 1.0
            while found[factor].error > error and factor > FINEST:
                seconds = 2 * found[factor].seconds
                end = time.perf_counter() + self.duration * seconds
                good = (p.seconds for p in self.points if p.error <= error)
                if end > self.until or seconds > DEARER * min(good, default=math.inf):
                    break
                factor /= 2
                measured(integrator, factor)
            good = max((f for f, point in found.items() if point.error <= error), default=0.0)
            # A Brownian path is coarsened or halved, not both.
            possible = self._divided * good >= 2 and not (self.runs.noisy and good < 2)
            if possible and good < max(found):
                measured(integrator, 1.5 * good)

    def _fill(self, point: Point, apart: Array, ranges: Array) -> None:
        """Fill in the errors of a point by its differences (records, n) from the truth."""
        errors = over(self.quantity.distances(apart).max(axis=0), ranges)
        if not np.isfinite(errors).all():
            return
        point.error = float(errors[: len(self.counted(ranges))].max())
        point.norm = point.worst = float(errors[0])
        if self.quantity.elements:
            worst = int(errors[1:].argmax())
            point.worst, point.element = float(errors[1 + worst]), self.quantity.elements[worst]

    @property
    def points(self) -> tuple[Point, ...]:
        """What `judge` has measured so far.

        A longer timestep counts as no more accurate than a shorter one.
        """
        curves = [[p for _, p in sorted(found.items())] for found in self._points.values()]
        for curve, name in itertools.product(curves, ("error", "norm", "worst")):
            errors = expected(np.array([getattr(point, name) for point in curve]))
            for point, error in zip(curve, errors.tolist(), strict=True):
                setattr(point, name, error)
        return tuple(itertools.chain(*curves))
