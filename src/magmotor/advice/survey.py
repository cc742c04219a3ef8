"""A survey of a model: reference, errors, costs, statistics and stability, within a budget."""

import itertools
import math
import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from magmotor.advice.advice import Advice
from magmotor.advice.choice import Choice
from magmotor.advice.detail import measure_detail
from magmotor.advice.measure import COARSE, JUDGES, TRUSTED, Measurement
from magmotor.advice.measured_quantities import REST, over
from magmotor.advice.path_errors import Reference, observed_order
from magmotor.advice.paths import INTEGRATORS, OutOfTime
from magmotor.advice.points import MARGIN, Point, front, time_in_turns
from magmotor.advice.recommendation import percent
from magmotor.advice.stability import find_rest, stability_limit
from magmotor.advice.statistics_errors import errors
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.not_acting import listed

PERTURBATION = 1e-7
"""Change of the initial velocities, over the fastest one, of which the growth is measured."""

CHAOTIC = 1e3
"""Growth of a perturbation, from a twentieth of the duration on, that counts as chaos."""

FACTORS = (1.0, 0.5, 2.0, COARSE)
"""Timesteps of the ensembles over the model's."""

REFERENCE, ERRORS, STATISTICS, COSTS, SETTINGS = 0.4, 0.6, 0.8, 0.85, 0.9
"""Parts of the budget at which each phase ends."""

MEASURED = 0.7
"""Part of the budget for all of these, if features are measured, too."""


class Survey:
    """Fills an `Advice`, phase by phase.

    Parameters
    ----------
    measurement : Measurement
    advice : Advice
    choice : Choice
        Recommends one of the points.
    budget : float
        Wall time in s.
    detail : bool
        Whether to measure what each feature costs, in the last part of the budget.
    show : callable
        Is called with what is running.
    """

    def __init__(
        self, measurement: Measurement, advice: Advice, choice: Choice, *,
        budget: float, detail: bool, show: Callable[[str], object],
    ):  # fmt: skip
        self._runs, self._measurement, self._advice = measurement.runs, measurement, advice
        self._choice, self._show, self._detail = choice, show, detail
        self._began = time.perf_counter()
        self._budget = MEASURED * budget if detail else budget
        measurement.on_run = show
        advice.duration = measurement.duration

    def run(self) -> None:
        """Measure everything; after an interruption, the advice has what is known so far.

        Raises
        ------
        ValueError
            The model is at rest, or the quantity does not change.
        OutOfTime
        """
        advice = self._advice
        self._until(REFERENCE)
        with suppress(OutOfTime):
            self._check_motion()
        truth = self._measurement.reference(advice.error)
        if truth is None:
            advice.reason = self._no_reference()
            return
        until, ranges = self._judge(truth)
        self._until(ERRORS)
        good = max(advice.error / MARGIN, advice.doubt)
        with suppress(OutOfTime):
            self._measurement.judge(truth.path, good, until, ranges)
        advice.points = self._measurement.points
        if self._runs.noisy or (advice.growth is not None and advice.growth > CHAOTIC):
            self._until(STATISTICS)
            self._compare_ensembles()
        self._until(COSTS)
        self._measure_costs()
        self._until(SETTINGS)
        if not advice.reason:
            self._choice.check(truth.path, until, ranges)
        self._find_limits()
        if self._detail:
            self._measure_detail(ranges)

    def conclude(self) -> None:
        """Draw conclusions from what is known."""
        advice = self._advice
        advice.points = self._measurement.points
        advice.front = tuple(front(advice.points, lambda p: max(p.error, advice.doubt)))
        for integrator in INTEGRATORS:
            known = [
                (point.timestep, point.error) for point in advice.points
                if point.method == integrator and math.isfinite(point.error)
            ]  # fmt: skip
            order = observed_order(known, advice.doubt)
            if order is not None:
                advice.orders[integrator] = order
        own = self._runs.integrator, self._runs.timestep
        advice.own = next((p for p in advice.points if (p.method, p.timestep) == own), None)
        self._choice.conclude()
        limit = advice.limits.get(advice.method)
        if limit is not None and advice.timestep > limit.found:
            at_rest = f"this timestep exceeds the stability limit at rest, {limit.found:.3g} s"
            advice.notes += (f"{at_rest}: it suits this motion only",)

    def _until(self, part: float) -> None:
        """Let runs continue until a part of the budget is used up."""
        self._measurement.until = self._began + part * self._budget

    def _check_motion(self) -> None:
        """Check that the model moves, by the first path that does not diverge."""
        m = self._measurement
        for integrator in JUDGES:
            if m.samples(integrator, 1.0) is not None:
                break
        if m.moved < REST:
            sentence = "does not change along the path: the model is at rest, and nothing moves it"
            raise ArgumentError("quantity", self._advice.quantity, sentence)

    def _judge(self, truth: Reference) -> tuple[int, Array]:
        """Return the tick up to which errors count, and what they are relative to.

        Chaos limits the former to where the reference can be trusted.
        """
        m, advice = self._measurement, self._advice
        values = truth.path.values
        if not np.isfinite(values).all():
            raise ArgumentError("quantity", advice.quantity, "is not finite along the path")
        if not m.quantity.changes(values):
            sentence = "does not change along the path; give a state that moves it, or another one"
            raise ArgumentError("quantity", advice.quantity, sentence)
        ranges = m.quantity.ranges(values)
        doubts = self._doubts(truth, ranges)
        enough, last = TRUSTED * advice.error, len(values) - 1
        if doubts[-1] > enough:
            self._until(ERRORS)
            with suppress(OutOfTime):
                advice.growth = m.growth(PERTURBATION)
            if (advice.growth or 0.0) > CHAOTIC:
                last = max(1, int(np.flatnonzero(doubts <= enough)[-1]))
                quantity = m.within(last * truth.path.ticks)
                if quantity.changes(values[: last + 1]):
                    ranges = quantity.ranges(values[: last + 1])
                else:
                    advice.reason = "the quantity does not change before the reference is lost"
        until = last * truth.path.ticks
        advice.reference, advice.horizon = truth.name, until * m.tick
        advice.doubt = float(self._doubts(truth, ranges)[last])
        self._note_what_was_not_seen(truth, ranges, last)
        return until, ranges

    def _doubts(self, truth: Reference, ranges: Array) -> Array:
        """Return the relative doubt of the reference up to each record, shape (records,)."""
        counted = self._measurement.counted(ranges)
        return over(truth.doubt[:, : len(counted)], counted).max(axis=1)

    def _note_what_was_not_seen(self, truth: Reference, ranges: Array, last: int) -> None:
        """Note which elements the path says little about, or the reference is uncertain about."""
        advice, quantity = self._advice, self._measurement.quantity
        names = quantity.elements or (quantity.name,)
        own = ranges[-len(names) :]
        advice.ranges = dict(zip(names, own.tolist(), strict=True))
        still = [name for name, size in advice.ranges.items() if math.isinf(size)]
        if still:
            little = "what moves by less than a thousandth of what moves most"
            advice.notes += (f"{little} is not judged: {listed(still)}",)
        unturned = quantity.unturned(truth.path.values[: last + 1])
        if unturned:
            only = f"within {advice.horizon:.3g} s, {listed(unturned)} moved one way only"
            advice.notes += (f"{only}: over a longer duration, range and error may be larger",)
        doubts = over(truth.doubt[last], ranges)
        if doubts[0] <= TRUSTED * advice.error < advice.doubt:
            worst = names[int(doubts[-len(names) :].argmax())]
            doubt = f"the reference is uncertain by {percent(advice.doubt)} of the range of {worst}"
            advice.notes += (f"{doubt}; every_element=False asks only for the whole",)

    def _compare_ensembles(self) -> None:
        """Compare ensembles with one at a quarter of the model's timestep."""
        advice, timestep = self._advice, self._runs.timestep
        candidates = [(name, f) for f, name in itertools.product(FACTORS, INTEGRATORS)]
        try:
            for row in errors(self._measurement.ensemble, timestep, JUDGES, candidates):
                advice.statistics += (row,)
        except OutOfTime:
            advice.notes += ("the budget was too small for more ensembles",)

    def _measure_costs(self) -> None:
        """Measure the costs of points and of ensembles, all in turns."""
        advice = self._advice
        points = [point for point in advice.points if math.isfinite(point.error)]
        known = {(point.method, point.timestep) for point in points}
        more = {
            key: Point(*key, row.seconds, math.inf) for row in advice.statistics
            if math.isfinite(row.error) and (key := (row.method, row.timestep)) not in known
        }  # fmt: skip
        points += more.values()
        until = self._measurement.until
        if not time_in_turns(self._runs, points, advice.duration, until):
            advice.notes += ("the budget was too small to measure the costs in turns",)
        costs = {(point.method, point.timestep): point.seconds for point in points}
        advice.statistics = tuple(
            row._replace(seconds=costs.get((row.method, row.timestep), row.seconds))
            for row in advice.statistics
        )

    def _measure_detail(self, ranges: Array) -> None:
        """Measure what features cost, and what can go beside the promised error."""
        advice = self._advice
        self._choice.conclude()
        self._show("detail")
        left = max(0.0, advice.error - advice.promised) / MARGIN
        with self._runs.solver(advice.settings):
            advice.details = measure_detail(
                self._runs, self._measurement.quantity, advice.method or self._runs.integrator,
                advice.timestep if advice.method else self._runs.timestep,
                advice.horizon, left, self._measurement.counted(ranges),
                self._began + self._budget / MEASURED,
            )  # fmt: skip

    def _find_limits(self) -> None:
        self._show("state of rest")
        end = self._began + self._budget
        try:
            rest = find_rest(self._runs.without_noise(), end)
            if rest is None:
                self._advice.notes += ("no rest state was found, so there are no stability limits",)
                return
            self._advice.constraints = rest.constraints
            for integrator in INTEGRATORS:
                self._show(f"stability of {integrator}")
                limit = stability_limit(rest, integrator)
                if limit is not None:
                    self._advice.limits[integrator] = limit
        except OutOfTime:
            self._advice.notes += ("the budget was too small for all limits of stability",)

    def _no_reference(self) -> str:
        paths = self._measurement.paths.values()
        ends = [path.diverged for path in paths if path.diverged is not None]
        if len(ends) < len(paths) or not ends:
            return "the budget is too small for a reference"
        steps = [path.timestep for path in paths]
        return (
            f"the model diverges at every timestep tried, from {min(steps):.3g} s to"
            f" {max(steps):.3g} s, after {min(ends):.3g} s to {max(ends):.3g} s"
        )
