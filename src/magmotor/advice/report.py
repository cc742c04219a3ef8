"""Tables of what `advise` found."""

import math
from collections.abc import Iterable, Mapping, Sequence

from magmotor.advice.detail import Detail
from magmotor.advice.measure import USELESS
from magmotor.advice.path_errors import Order
from magmotor.advice.points import Point
from magmotor.advice.recommendation import percent
from magmotor.advice.stability import Limit
from magmotor.advice.statistics_errors import Statistic
from magmotor.mjcf.not_acting import listed


def points_table(
    shown: Sequence[Point], points: Sequence[Point], orders: Mapping[str, Order],
    limits: Mapping[str, Limit], *, has_elements: bool,
) -> list[str]:  # fmt: skip
    """Return lines of text: one of the points of each integrator, and what else is known of it."""
    head = ["integrator", "timestep", "error", *["worst element"] * has_elements]
    rows = [[*head, "cost", "order", "fails from", "stable at rest up to", "limited by"]]
    for point in shown:
        order, limit = orders.get(point.method), limits.get(point.method)
        limited = limit.joints[0] if limit and limit.joints else None
        rows.append([
            point.method, f"{point.timestep:.4g} s", percent(point.norm),
            *[worst(point)] * has_elements, f"{point.seconds:.2g}",
            f"{order.value:.1f} ± {order.doubt:.1f}" if order else "",
            _failure(other for other in points if other.method == point.method),
            _limit(limit) if limit else "",
            f"{limited[0]} ({limited[1]:.0%})" if limited else "",
        ])  # fmt: skip
    return _aligned(rows)


def worst(point: Point) -> str:
    """Return the error of the worst element of a point, and its name."""
    return percent(point.worst) + (f" ({point.element})" if point.element else "")


def statistics_table(statistics: Sequence[Statistic]) -> list[str]:
    """Return lines of text: the errors of all statistics with each method and timestep."""
    names = [*dict.fromkeys(row.name for row in statistics)]
    rows = [["integrator", "timestep", "cost", *names]]
    for key in dict.fromkeys((row.method, row.timestep) for row in statistics):
        own = {r.name: r for r in statistics if (r.method, r.timestep) == key}
        cells = [_with_doubt(own[n]) for n in names]
        cost = own[names[0]].seconds
        rows.append([key[0], f"{key[1]:.4g} s", f"{cost:.2g}" if cost > 0 else "", *cells])
    return _aligned(rows)


def details_table(details: Sequence[Detail]) -> list[str]:
    """Return lines of text: a table of the features, and what can go together."""
    rows = [["without", "change", "saves", "can go"]]
    *_, last = [Detail("", 0.0, 0.0, False), *details]
    for detail in details[: -1 if last.together else None]:
        verdict = "yes" if detail.what in last.together else "alone" if detail.can_go else ""
        saved = "" if math.isnan(detail.saved) else f"{round(100 * detail.saved)} %"
        rows.append([detail.what, percent(detail.change), saved, verdict])
    lines = _aligned(rows) if len(rows) > 1 else []
    for detail in details:
        if detail.names and detail.can_go:
            lines.append(f"{detail.what}: {listed(detail.names)}")
    if last.together:
        lines.append(
            f"along this path, what can go changes the quantity by {percent(last.change)} and saves"
            f" {round(100 * last.saved)} % of the time: {'; '.join(last.together)}"
        )
    return lines


def _with_doubt(statistic: Statistic) -> str:
    if math.isinf(statistic.error):
        return "diverged"
    doubt = 100 * statistic.doubt
    rounded = f"{doubt:.0f}" if 9.5 <= doubt < 999.5 else f"{doubt:.1g}"
    return f"{100 * statistic.error:.2g} ± {rounded} %"


def fails_from(points: Iterable[Point]) -> Point | None:
    """Return the point of the shortest timestep that fails: its run diverges, or is useless."""
    failed = [point for point in points if point.diverged is not None or point.error >= USELESS]
    return min(failed, key=lambda point: point.timestep, default=None)


def _failure(points: Iterable[Point]) -> str:
    """Return the shortest timestep that fails along the path, and how."""
    first = fails_from(points)
    if first is None:
        return ""
    how = f"error {percent(first.error)}" if math.isfinite(first.error) else "diverges"
    after = "" if first.diverged is None else f" after {first.diverged:.2g} s"
    return f"{first.timestep:.4g} s ({how}{after})"


def _limit(limit: Limit) -> str:
    """Return what runs found, and what theory says where it applies."""
    found, theory = (
        f"{number:.3g} s" if math.isfinite(number) else "any"
        for number in (limit.found, limit.theory)
    )
    return found if math.isnan(limit.theory) else f"{found} (theory: {theory})"


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows of a table as lines."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
