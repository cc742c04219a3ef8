"""Which point is recommended: the cheapest that keeps its promise, also as to the solver."""

import math
from collections.abc import Collection
from dataclasses import replace

from magmotor.advice.advice import Advice
from magmotor.advice.measure import TRUSTED, Measurement
from magmotor.advice.path_errors import Samples
from magmotor.advice.paths import INTEGRATORS, OutOfTime
from magmotor.advice.points import Point, promise, reaching
from magmotor.advice.recommendation import percent
from magmotor.common.arrays import Array


class Choice:
    """Fills the recommendation of an `Advice`.

    Parameters
    ----------
    advice : Advice
    measurement : Measurement
    among : collection of str
        Integrators that may be recommended.
    tune : bool
        Whether settings of the solver may be recommended, too.
    """

    def __init__(
        self, advice: Advice, measurement: Measurement, *,
        among: Collection[str] = (*INTEGRATORS,), tune: bool = True,
    ):  # fmt: skip
        self._advice, self._measurement = advice, measurement
        self._among, self._tune = among, tune
        self._rejected: list[Point] = []
        self._checked = False

    def check(self, truth: Samples, until: int, ranges: Array) -> None:
        """Recommend the cheapest point for which the constraint solver converges enough.

        The promise includes what a solver that converges would change.

        Parameters
        ----------
        truth : Samples
        until : int
            Only the path up to this tick counts.
        ranges : ndarray, shape (1 + elements,)
            Errors are relative to these.
        """
        good = self._good()
        try:
            found = any(self._converges(point, truth, until, ranges) for point in good)
        except OutOfTime:
            self._advice.notes += ("the budget was too small to check the solver's settings",)
        else:
            if good and not found:
                sentence = "the constraint solver does not converge to this error"
                self._advice.reason = sentence
        self._checked = True

    def _converges(self, point: Point, truth: Samples, until: int, ranges: Array) -> bool:
        """Recommend a point if the constraint solver converges enough, with some settings."""
        m = self._measurement
        *ladder, tightest = m.runs.tighter()
        converged = m.settled(point, tightest)
        for settings in ladder[: None if self._tune else 1] if converged else ():
            own = m.settled(point, settings)
            if own is None or converged is None:
                continue
            error = max(point.error, m.error(own.apart(truth, until), ranges))
            unsolved = m.error(own.apart(converged, until), ranges)
            promised = self._promise(replace(point, error=error), unsolved)
            if promised <= self._advice.error:
                self._recommend(point, promised, settings)
                return True
        self._rejected.append(point)
        return False

    def conclude(self) -> None:
        """Recommend something by what is known, or say why not."""
        advice = self._advice
        if advice.method or advice.reason:
            return
        good = self._good()
        if not good:
            advice.reason = self._no_point()
            return
        self._recommend(good[0], self._promise(good[0]))
        if not self._checked:
            advice.notes += ("whether the constraint solver converges was not checked",)

    def _promise(self, point: Point, unsolved: float = 0.0) -> float:
        return promise(point, unsolved + self._advice.doubt)

    def _good(self) -> list[Point]:
        """Return the points that reach the error and that the solver allows, cheapest first."""
        allowed = (
            p for p in self._advice.points if p.method in self._among and p not in self._rejected
        )
        return reaching(allowed, self._advice.error, self._promise)

    def _recommend(
        self, point: Point, promised: float, settings: dict[str, float] | None = None
    ) -> None:
        advice = self._advice
        advice.method, advice.timestep = point.method, point.timestep
        advice.promised, advice.seconds = promised, point.seconds
        advice.settings = settings or {}
        if point.element:
            advice.basis += f"; worst over its own range: {point.element}"

    def _no_point(self) -> str:
        if not self._advice.reference:
            return "interrupted before a reference was found"
        doubt, error = self._advice.doubt, self._advice.error
        if doubt > error:
            return f"the reference itself is uncertain by {percent(doubt)}"
        if doubt > TRUSTED * error:
            return f"nothing comes closer to the reference, which is uncertain by {percent(doubt)}"
        errors = (p.error for p in self._advice.points if p.method in self._among)
        least = min(errors, default=math.inf)
        return (
            f"the smallest error found within the budget is {percent(least)}, by a reference that"
            f" is uncertain by at most {percent(doubt)}"
        )
