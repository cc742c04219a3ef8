"""What `advise` found, as text."""

import math
from dataclasses import dataclass, field
from pathlib import Path

from magmotor.advice.errors import Order
from magmotor.advice.points import MARGIN, Point
from magmotor.advice.stability import Limit
from magmotor.advice.statistics import REPLICAS, Statistic, certain


@dataclass
class Advice:
    """Errors and costs of MuJoCo's integrators for one motion of a model, and a recommendation.

    Attributes
    ----------
    quantity : str
        What the errors refer to.
    error : float
        The error asked for, relative to the range of the quantity.
    duration : float
        Duration of the paths in s.
    integrator : str or None
        What is recommended, or None if nothing reaches the error; `reason` says why.
    timestep : float
        In s; NaN without a recommendation.
    promised : float
        The largest error that the recommendation should have; infinite without one.
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
        Number of constraints at rest, such as contacts. The limits by theory assume that they
        neither begin nor end.
    reference : str
        How the reference was computed.
    doubt : float
        Relative error that the reference may have at the horizon.
    horizon : float
        Time in s up to which errors along the path are measured.
    growth : float or None
        Factor by which a perturbation grew, if that was measured.
    statistics : tuple of Statistic
        Errors of means over time, if the motion is chaotic.
    reason : str
        Why there is no recommendation.
    notes : tuple of str
        What else a user should know.
    """

    quantity: str
    error: float
    duration: float
    integrator: str | None = None
    timestep: float = math.nan
    promised: float = math.inf
    settings: dict[str, float] = field(default_factory=dict)
    own: Point | None = None
    points: tuple[Point, ...] = ()
    front: tuple[Point, ...] = ()
    orders: dict[str, Order] = field(default_factory=dict)
    limits: dict[str, Limit] = field(default_factory=dict)
    constraints: int = 0
    reference: str = ""
    doubt: float = math.inf
    horizon: float = 0.0
    growth: float | None = None
    statistics: tuple[Statistic, ...] = ()
    reason: str = ""
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return a table of the integrators, and the recommendation."""
        lines = [self._title(), "", *_table(self._rows()), ""] if self.points else [self._title()]
        if self.statistics:
            rows = _table(self._statistics())
            lines += [self._chaos(), "", *rows, "", self._for_statistics(), ""]
        if self.limits and self.constraints:
            lines.append("the limits by theory assume that no constraint begins or ends to act")
        return "\n".join([*lines, *self.notes, self._conclusion()])

    def _chaos(self) -> str:
        begin = f"statistics over {self.duration:.3g} s"
        if self.growth is not None:
            begin = (
                f"the motion is chaotic: a perturbation grows {self.growth:.1g} times in"
                f" {self.duration:.3g} s, so that paths have an error up to {self.horizon:.3g} s"
                " only; beyond, statistics"
            )
        return (
            f"{begin} of {REPLICAS} runs from perturbed starts (with other noise, if any) differ"
            " from those at a quarter of the timestep by (± standard error)"
        )

    def _for_statistics(self) -> str:
        """Return a sentence about what is cheapest for statistics."""
        bounds = certain(self.statistics)
        for (integrator, timestep), bound in bounds.items():
            if bound <= self.error:
                return (
                    f"for statistics: {integrator} at a timestep of {timestep:.4g} s is the"
                    f" cheapest of these; they differ by at most {percent(bound)}, with two"
                    " standard errors"
                )
        least = percent(min(bounds.values(), default=math.inf))
        return (
            f"no statistics are certain to differ by at most {percent(self.error)}: with two"
            f" standard errors, it is at least {least}; a longer duration makes them more certain"
        )

    def _statistics(self) -> list[list[str]]:
        names = [*dict.fromkeys(row.name for row in self.statistics)]
        rows = [["integrator", "timestep", "cost", *names]]
        for key in dict.fromkeys((row.integrator, row.timestep) for row in self.statistics):
            own = {r.name: r for r in self.statistics if (r.integrator, r.timestep) == key}
            cells = [_with_doubt(own[n]) for n in names]
            cost = own[names[0]].seconds
            rows.append([key[0], f"{key[1]:.4g} s", f"{cost:.2g}" if cost > 0 else "", *cells])
        return rows

    def draw(self, path: str | Path) -> None:
        """Draw error against cost, and write the picture to a file."""
        from magmotor.advice.picture import draw

        draw(self, Path(path))

    def _title(self) -> str:
        title = f"error of {self.quantity} over {self.horizon or self.duration:.4g} s"
        if self.reference:
            title += f", against {self.reference}, which is trusted to {percent(self.doubt)}"
        return title

    def _rows(self) -> list[list[str]]:
        head = ["integrator", "timestep", "error", "cost", "order", "stable up to", "limited by"]
        rows = [head]
        for integrator in dict.fromkeys(point.integrator for point in self.points):
            mine = [point for point in self.points if point.integrator == integrator]
            within = [p for p in mine if MARGIN * (p.error + self.doubt) <= self.error]
            shown = min(within or mine, key=lambda p: p.seconds if within else p.error)
            order, limit = self.orders.get(integrator), self.limits.get(integrator)
            limited = limit.joints[0] if limit and limit.joints else None
            rows.append([
                integrator, f"{shown.timestep:.4g} s", percent(shown.error), f"{shown.seconds:.2g}",
                f"{order.value:.1f} ± {order.doubt:.1f}" if order else "",
                _limit(limit) if limit else "",
                f"{limited[0]} ({limited[1]:.0%})" if limited else "",
            ])  # fmt: skip
        return rows

    def _conclusion(self) -> str:
        own = self.own
        has = ""
        if own is not None:
            what = (
                f"diverges after {own.diverged:.3g} s"
                if own.diverged is not None
                else (f"has an error of {percent(own.error)}")
            )
            has = f"the model's own {own.integrator} at {own.timestep:g} s {what}"
        if self.integrator is None:
            return f"no recommendation: {self.reason}" + (f"; {has}" if has else "")
        if not self.points:
            return (
                f"advice: {self.integrator} at a timestep of {self.timestep:.4g} s: statistics"
                f" differ by at most {percent(self.promised)}"
            )
        chosen = next(
            point for point in self.points
            if (point.integrator, point.timestep) == (self.integrator, self.timestep)
        )  # fmt: skip
        sentence = (
            f"advice: {self.integrator} at a timestep of {self.timestep:.4g} s: error up to"
            f" {percent(self.promised)}, {chosen.seconds:.2g} s per simulated second"
        )
        if self.settings:
            settings = (f'{name}="{value:g}"' for name, value in self.settings.items())
            sentence += f", with {', '.join(settings)}"
        if own is not None and own is not chosen:
            ratio = own.seconds / chosen.seconds
            faster = f"{ratio:.2g} times faster" if ratio >= 1 else f"{1 / ratio:.2g} times slower"
            sentence += f"; {has}, and the advice is {faster}"
        elif own is chosen:
            sentence += ", as the model has it"
        return sentence


def _with_doubt(statistic: Statistic) -> str:
    if math.isinf(statistic.error):
        return "diverged"
    doubt = 100 * statistic.doubt
    rounded = f"{doubt:.0f}" if doubt >= 9.5 else f"{doubt:.1g}"
    return f"{100 * statistic.error:.2g} ± {rounded} %"


def percent(error: float) -> str:
    """Format a relative error in percent."""
    if not math.isfinite(error):
        return "diverged"
    return f"{100 * error:.2g} %"


def _limit(limit: Limit) -> str:
    theory = f"{limit.theory:.3g}" if math.isfinite(limit.theory) else "-"
    found = f"{limit.found:.3g}" if math.isfinite(limit.found) else "-"
    return f"{theory} s (found: {found})"


def _table(rows: list[list[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
