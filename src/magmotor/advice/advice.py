"""What `advise` found."""

import math
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from magmotor.advice import picture
from magmotor.advice.detail import Detail
from magmotor.advice.path_errors import Order
from magmotor.advice.points import Point, promise, reaching
from magmotor.advice.recommendation import Recommendation, percent
from magmotor.advice.report import details_table, points_table, statistics_table, worst
from magmotor.advice.stability import Limit
from magmotor.advice.statistics_errors import REPLICAS, Statistic, certain
from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Dpi, Picture


@dataclass(kw_only=True)
class Advice(Recommendation):
    """A recommendation for one motion of a model, and all that was measured for it.

    Its methods are integrators of MuJoCo or, at a temperature, splittings of `Langevin`. Besides
    the attributes of `Recommendation`, it has the following ones.

    Attributes
    ----------
    every_element : bool
        Whether the error of each element over its own range counts, or only that of the whole.
    ranges : dict of str to float
        Range of each element, or of the quantity if it has only one; infinite if it is at rest
        beside the others, and not judged.
    duration : float
        Duration of the paths in s; errors along them are measured up to `horizon`.
    settings : dict of str to float
        Settings of the solver that the recommendation needs besides.
    own : Point or None
        The model's own integrator and timestep.
    points, front : tuple of Point
        All measurements, and those that no other one beats in both error and cost.
    orders : dict of str to Order
        Observed orders.
    limits : dict of str to Limit
        Stability limits at rest.
    constraints : int
        Number of constraints at rest, such as contacts. With any, there are no limits by theory.
    reference : str
        How the reference was computed.
    doubt : float
        Relative error that the reference may have at the horizon.
    growth : float or None
        Factor by which a perturbation grew, if that was measured.
    statistics : tuple of Statistic
        Errors of means over time, if the motion is chaotic or noisy, or at a temperature.
    for_statistics : Point or None
        The cheapest method and timestep whose statistics are certain to reach the error.
    details : tuple of Detail
        What each feature of the model costs and changes, if that was asked for.
    reason : str
        Why there is no recommendation.
    notes : tuple of str
        What else a user should know.
    """

    duration: float
    basis: str = "measured on this machine"
    every_element: bool = True
    ranges: dict[str, float] = field(default_factory=dict)
    settings: dict[str, float] = field(default_factory=dict)
    own: Point | None = None
    points: tuple[Point, ...] = ()
    front: tuple[Point, ...] = ()
    orders: dict[str, Order] = field(default_factory=dict)
    limits: dict[str, Limit] = field(default_factory=dict)
    constraints: int = 0
    reference: str = ""
    doubt: float = math.inf
    growth: float | None = None
    statistics: tuple[Statistic, ...] = ()
    for_statistics: Point | None = None
    details: tuple[Detail, ...] = ()
    reason: str = ""
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return tables of what was measured, and the recommendation."""
        lines = [self._title()]
        if self.points:
            shown = [self._best(name) for name in dict.fromkeys(p.method for p in self.points)]
            table = points_table(
                shown, self.points, self.orders, self.limits, has_elements=self._has_elements
            )
            lines += ["", *table, ""]
        if self.statistics:
            lines += [self._chaos(), "", *statistics_table(self.statistics), ""]
            lines += [self._for_statistics(), ""]
        if self.details:
            lines += [*details_table(self.details), ""]
        return "\n".join([*lines, *self.notes, self._conclusion()])

    @checked
    def draw(self, path: Picture, dpi: Dpi = style.DPI) -> None:
        """Draw error against cost, and write the picture to a file.

        Parameters
        ----------
        path : str or Path
            The file to write; its suffix sets the format, such as .png, .pdf or .svg.
        dpi : int
            Dots per inch of the picture.

        Raises
        ------
        ValueError
            Nothing was measured.
        """
        if not self.points:
            raise ArgumentError("points", self.points, "must be measured before they are drawn")
        picture.draw(
            Path(path), dpi, self.points, self.front, self.limits, error=self.error,
            doubt=self.doubt, chosen=self._chosen, own=self.own,
            of="any element" if self._each_counts else self.quantity,
        )  # fmt: skip

    @property
    def _has_elements(self) -> bool:
        return len(self.ranges) > 1

    @property
    def _each_counts(self) -> bool:
        return self.every_element and self._has_elements

    @property
    def _chosen(self) -> Point | None:
        """The point that is recommended."""
        key = self.method, self.timestep
        return next((p for p in self.points if (p.method, p.timestep) == key), None)

    def _best(self, method: str) -> Point:
        """Return the cheapest point of a method that reaches the error, or its most accurate."""
        own = [point for point in self.points if point.method == method]
        within = reaching(own, self.error, partial(promise, doubt=self.doubt))
        return within[0] if within else min(own, key=lambda point: point.error)

    def _title(self) -> str:
        title = f"error of {self.quantity}"
        if self._has_elements:
            title += ", and of the worst element over its own range,"
        title += f" over {self.horizon or self.duration:.4g} s"
        if self.reference:
            doubt = percent(self.doubt)
            title += f", against {self.reference}, which is uncertain by at most {doubt}"
        return title

    def _chaos(self) -> str:
        begin = f"statistics over {self.duration:.3g} s"
        if self.growth is not None:
            begin = (
                f"the motion is chaotic: a perturbation grows by a factor of {self.growth:.1g} in"
                f" {self.duration:.3g} s, so that paths have an error up to {self.horizon:.3g} s"
                " only; beyond, statistics"
            )
        return (
            f"{begin} of {REPLICAS} runs, with perturbed starts or different noise, differ from"
            " those at a quarter of the model's timestep by (± standard error)"
        )

    def _for_statistics(self) -> str:
        """Return a sentence about what is cheapest for statistics."""
        best = self.for_statistics
        if best is not None:
            return (
                f"for statistics: {best.method} at a timestep of {best.timestep:.4g} s is the"
                f" cheapest that qualifies; its statistics differ by at most {percent(best.error)},"
                " with two standard errors"
            )
        least = min((point.error for point in certain(self.statistics)), default=math.inf)
        sentence = f"no statistics are certain to differ by at most {percent(self.error)}"
        if math.isfinite(least):
            sentence += f": with two standard errors, it is at least {percent(least)}"
        return f"{sentence}; a longer duration makes them more certain"

    def _conclusion(self) -> str:
        own, chosen, has = self.own, self._chosen, ""
        if own is not None:
            element = f" ({own.element})" if own.error > own.norm else ""
            what = f"has an error of {percent(own.error)}{element}"
            if not math.isfinite(own.error):
                what = "diverges"
            if own.diverged is not None:
                what = f"diverges after {own.diverged:.3g} s"
            has = f"the model's own {own.method} at {own.timestep:g} s {what}"
        if not self.method:
            return f"no recommendation: {self.reason}" + (f"; {has}" if has else "")
        if chosen is None:
            return (
                f"advice: {self.method} at a timestep of {self.timestep:g} s: statistics"
                f" differ by at most {percent(self.promised)}"
            )
        sentence = f"advice: {self._sentence()}"
        if self._each_counts:
            sentence += ", also of each element over its own range"
        elif self._has_elements:
            sentence += f", but over its own range {worst(chosen)}"
        if self.settings:
            settings = (f'{name}="{value:g}"' for name, value in self.settings.items())
            sentence += f", with {', '.join(settings)}"
        if own is chosen:
            return f"{sentence}, its current setting"
        if own is not None:
            ratio = own.seconds / chosen.seconds
            faster = f"{ratio:.2g} times faster" if ratio >= 1 else f"{1 / ratio:.2g} times slower"
            if 0.95 < ratio < 1.05:
                faster = "as fast"
            sentence += f"; {has}, and the advice is {faster}"
        return sentence
