"""A survey of a model: reference, errors, costs, statistics and stability, within a budget."""

import itertools
import math
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np
from tqdm import tqdm

from magmotor.advice.advice import Advice
from magmotor.advice.detail import measure_detail
from magmotor.advice.errors import Reference, Samples, observed_order
from magmotor.advice.measure import COARSE, JUDGES, TRUSTED, Measurement
from magmotor.advice.paths import INTEGRATORS, OutOfTime, Runs
from magmotor.advice.points import MARGIN, Point, front, time_in_turns
from magmotor.advice.report import percent
from magmotor.advice.stability import find_rest, stability_limit
from magmotor.advice.statistics import compared
from magmotor.advice.thermal import Thermal
from magmotor.common.checks import reject

PERTURBATION = 1e-7
"""Change of the initial velocities, over the fastest one, of which the growth is measured."""

CHAOTIC = 1e3
"""Growth of a perturbation, from a twentieth of the duration on, that counts as chaos."""

FINE, FACTORS = 0.25, (1.0, 0.5, 2.0, COARSE)
"""Timesteps of the ensembles over the model's: that of the reference, and those judged."""

REFERENCE, ERRORS, STATISTICS, COSTS, SETTINGS = 0.4, 0.6, 0.8, 0.85, 0.9
"""Parts of the budget at which each phase ends."""


MEASURED = 0.7
"""Part of the budget for all of these, if features are measured, too."""


class Survey:
    """Fills an `Advice`, phase by phase.

    Parameters
    ----------
    runs : Runs
    measurement : Measurement
    advice : Advice
    budget : float
        Wall time in s.
    detail : bool
        Whether to measure what each feature costs, in the last part of the budget.
    bar : tqdm
        Shows the time used, and what is running.
    """

    def __init__(
        self, runs: Runs, measurement: Measurement, advice: Advice, *,
        budget: float, detail: bool, bar: tqdm,
    ):  # fmt: skip
        self._runs, self._measurement, self._advice = runs, measurement, advice
        self._began, self._bar, self._detail = time.perf_counter(), bar, detail
        self._budget = MEASURED * budget if detail else budget
        self._rejected: list[Point] = []
        measurement.on_run = self._show
        advice.duration = measurement.duration

    def run(self) -> None:
        """Measure everything; after an interruption, the advice has what is known so far.

        Raises
        ------
        ValueError
            The quantity does not change.
        """
        advice = self._advice
        self._until(REFERENCE)
        truth = self._measurement.reference(advice.error)
        if truth is None:
            advice.reason = self._no_reference()
            return
        until, scale = self._judge(truth)
        self._until(ERRORS)
        good = max(advice.error / MARGIN, advice.doubt)
        with suppress(OutOfTime):
            self._measurement.judge(truth.path, good, until, scale)
        advice.points = self._measurement.points
        if self._runs.noisy or (advice.growth is not None and advice.growth > CHAOTIC):
            self._until(STATISTICS)
            self._compare_ensembles()
        self._until(COSTS)
        finite = [point for point in advice.points if math.isfinite(point.error)]
        time_in_turns(self._runs, finite, advice.duration, self._measurement.until)
        self._until(SETTINGS)
        self._choose(truth.path, until, scale)
        self._find_limits()
        if self._detail:
            self._show("detail")
            advice.details = measure_detail(
                self._runs, self._measurement.quantity, advice.integrator or self._runs.integrator,
                advice.timestep if advice.integrator else self._runs.timestep,
                advice.horizon, advice.error, scale, self._began + self._budget / MEASURED,
            )  # fmt: skip

    def run_at(self, kT: float) -> None:
        """Compare the splittings of `Langevin` at a temperature in J.

        Raises
        ------
        ValueError
            `Langevin` does not support the model, or the model has noise of its own.
        """
        if self._runs.noisy:
            raise reject("kT", kT, "must be omitted, since the model has noise of its own")
        thermal = Thermal(self._runs, self._measurement.quantity, kT, self._measurement.duration)
        self._advice.duration = thermal.duration
        thermal.compare(self._advice, self._began + self._budget, self._show)

    def conclude(self) -> None:
        """Draw conclusions from what is known."""
        advice = self._advice
        advice.points = self._measurement.points
        advice.front = tuple(front(advice.points, advice.doubt))
        for integrator in INTEGRATORS:
            errors = [
                (point.timestep, point.error) for point in advice.points
                if point.integrator == integrator and math.isfinite(point.error)
            ]  # fmt: skip
            order = observed_order(errors, advice.doubt)
            if order is not None:
                advice.orders[integrator] = order
        own = self._runs.integrator, self._runs.timestep
        advice.own = next((p for p in advice.points if (p.integrator, p.timestep) == own), None)
        if advice.integrator is None and not advice.reason:
            good = self._good()
            if good:
                self._recommend(good[0], self._promise(good[0]))
            else:
                advice.reason = self._no_point()
        limit = advice.limits.get(advice.integrator or "")
        if limit is not None and advice.timestep > limit.found:
            at_rest = f"this timestep exceeds the stability limit at rest, {limit.found:.3g} s"
            advice.notes += (f"{at_rest}: it suits this motion only",)

    def _promise(self, point: Point, unsolved: float = 0.0) -> float:
        return MARGIN * (point.error + unsolved + self._advice.doubt)

    def _good(self) -> list[Point]:
        """Return the points that reach the error and that the solver allows, cheapest first."""
        good = [
            p for p in self._advice.points
            if self._promise(p) <= self._advice.error and p not in self._rejected
        ]  # fmt: skip
        return sorted(good, key=lambda point: point.seconds)

    def _recommend(
        self, point: Point, promised: float, settings: dict[str, float] | None = None
    ) -> None:
        advice = self._advice
        advice.integrator, advice.timestep = point.integrator, point.timestep
        advice.promised, advice.settings = promised, settings or {}

    def _choose(self, truth: Samples, until: int, scale: float) -> None:
        """Recommend the cheapest point for which the constraint solver converges enough.

        The promise includes what a solver that converges would change.
        """
        advice, m = self._advice, self._measurement
        *ladder, tightest = self._runs.tighter()
        good = self._good()
        try:
            for best in good:
                converged = m.settled(best, tightest)
                for settings in ladder if converged else ():
                    own = m.settled(best, settings)
                    if own is None or converged is None:
                        continue
                    error = max(best.error, float(own.apart(truth, until).max()) / scale)
                    unsolved = float(own.apart(converged, until).max()) / scale
                    promised = self._promise(replace(best, error=error), unsolved)
                    if promised <= advice.error:
                        self._recommend(best, promised, settings)
                        return
                self._rejected.append(best)
        except OutOfTime:
            advice.notes += ("the budget was too small to check the solver's settings",)
            return
        if good:
            advice.reason = "the constraint solver does not converge to this error"

    def _until(self, part: float) -> None:
        """Let runs continue until a part of the budget is used up."""
        self._measurement.until = self._began + part * self._budget

    def _show(self, what: str) -> None:
        self._bar.set_description_str(what)
        self._bar.update(round(time.perf_counter() - self._began) - self._bar.n)

    def _judge(self, truth: Reference) -> tuple[int, float]:
        """Return the tick up to which errors count, and their scale.

        Chaos limits the former to where the reference can be trusted.
        """
        m, advice = self._measurement, self._advice
        values, doubt = truth.path.values, truth.doubt
        scale = m.quantity.range(values)
        if not np.isfinite(values).all():
            raise reject("quantity", advice.quantity, "is not finite along the path")
        if not scale > 0.0:
            sentence = "does not change along the path; give a state that moves, or another one"
            raise reject("quantity", advice.quantity, sentence)
        enough, last = TRUSTED * advice.error, len(values) - 1
        if doubt[-1] > enough * scale:
            self._until(ERRORS)
            with suppress(OutOfTime):
                advice.growth = m.growth(PERTURBATION)
            if (advice.growth or 0.0) > CHAOTIC:
                last = max(1, int(np.flatnonzero(doubt <= enough * scale)[-1]))
                scale = m.quantity.range(values[: last + 1])
        until = last * truth.path.ticks
        advice.reference, advice.horizon = truth.name, until * m.tick
        advice.doubt = float(doubt[last]) / scale
        return until, scale

    def _compare_ensembles(self) -> None:
        """Compare ensembles with one at a quarter of the model's timestep."""
        m, truth = self._measurement, None
        try:
            for integrator in JUDGES:
                truth = truth or m.ensemble(integrator, FINE)
            for factor, integrator in itertools.product(FACTORS, INTEGRATORS):
                own = m.ensemble(integrator, factor)
                if truth is not None:
                    timestep = factor * self._runs.timestep
                    self._advice.statistics += compared(integrator, timestep, own, truth)
        except OutOfTime:
            self._advice.notes += ("the budget was too small for more ensembles",)

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

    def _no_point(self) -> str:
        if not self._advice.reference:
            return "interrupted before a reference was found"
        doubt, error = self._advice.doubt, self._advice.error
        if doubt > error:
            return f"the reference itself is uncertain by {percent(doubt)}"
        if doubt > TRUSTED * error:
            return f"nothing comes closer to the reference, which is uncertain by {percent(doubt)}"
        least = min((point.error for point in self._advice.points), default=math.inf)
        return (
            f"the smallest error found within the budget is {percent(least)}, by a reference that"
            f" is uncertain by at most {percent(doubt)}"
        )
