"""What `advise` found, as text."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from magmotor.advice.detail import Detail
from magmotor.advice.measure import USELESS
from magmotor.advice.points import MARGIN, Point
from magmotor.advice.stability import Limit
from magmotor.advice.statistics_errors import REPLICAS, Statistic, certain
from magmotor.mjcf.idle import listed

if TYPE_CHECKING:
    from magmotor.advice.advice import Advice


def report(advice: "Advice") -> str:
    """Return tables of what was measured, and the recommendation."""
    lines = [_title(advice)]
    if advice.points:
        lines += ["", *aligned(_rows(advice)), ""]
    if advice.statistics:
        rows = aligned(_statistics(advice))
        lines += [_chaos(advice), "", *rows, "", _for_statistics(advice), ""]
    if advice.details:
        lines += [*table(advice.details), ""]
    return "\n".join([*lines, *advice.notes, _conclusion(advice)])


def _chaos(advice: "Advice") -> str:
    begin = f"statistics over {advice.duration:.3g} s"
    if advice.growth is not None:
        begin = (
            f"the motion is chaotic: a perturbation grows by a factor of {advice.growth:.1g} in"
            f" {advice.duration:.3g} s, so that paths have an error up to {advice.horizon:.3g} s"
            " only; beyond, statistics"
        )
    return (
        f"{begin} of {REPLICAS} runs, with perturbed starts or different noise, differ from"
        " those at a quarter of the model's timestep by (± standard error)"
    )


def _for_statistics(advice: "Advice") -> str:
    """Return a sentence about what is cheapest for statistics."""
    best = advice.for_statistics
    if best is not None:
        return (
            f"for statistics: {best.integrator} at a timestep of {best.timestep:.4g} s is the"
            f" cheapest that qualifies; its statistics differ by at most {percent(best.error)},"
            " with two standard errors"
        )
    least = min(certain(advice.statistics).values(), default=math.inf)
    sentence = f"no statistics are certain to differ by at most {percent(advice.error)}"
    if math.isfinite(least):
        sentence += f": with two standard errors, it is at least {percent(least)}"
    return f"{sentence}; a longer duration makes them more certain"


def _statistics(advice: "Advice") -> list[list[str]]:
    names = [*dict.fromkeys(row.name for row in advice.statistics)]
    rows = [["integrator", "timestep", "cost", *names]]
    for key in dict.fromkeys((row.integrator, row.timestep) for row in advice.statistics):
        own = {r.name: r for r in advice.statistics if (r.integrator, r.timestep) == key}
        cells = [_with_doubt(own[n]) for n in names]
        cost = own[names[0]].seconds
        rows.append([key[0], f"{key[1]:.4g} s", f"{cost:.2g}" if cost > 0 else "", *cells])
    return rows


def _title(advice: "Advice") -> str:
    title = f"error of {advice.quantity}"
    if _has_elements(advice):
        title += ", and of the worst element over its own range,"
    title += f" over {advice.horizon or advice.duration:.4g} s"
    if advice.reference:
        title += (
            f", against {advice.reference}, which is uncertain by at most {percent(advice.doubt)}"
        )
    return title


def _rows(advice: "Advice") -> list[list[str]]:
    head = ["integrator", "timestep", "error", *["worst element"] * _has_elements(advice)]
    rows = [[*head, "cost", "order", "fails from", "stable at rest up to", "limited by"]]
    for integrator in dict.fromkeys(point.integrator for point in advice.points):
        mine = [point for point in advice.points if point.integrator == integrator]
        within = [p for p in mine if MARGIN * (p.error + advice.doubt) <= advice.error]
        shown = min(within or mine, key=lambda p: p.seconds if within else p.error)
        order, limit = advice.orders.get(integrator), advice.limits.get(integrator)
        limited = limit.joints[0] if limit and limit.joints else None
        rows.append([
            integrator, f"{shown.timestep:.4g} s", percent(shown.norm),
            *[_worst(shown)] * _has_elements(advice), f"{shown.seconds:.2g}",
            f"{order.value:.1f} ± {order.doubt:.1f}" if order else "", _failure(mine),
            _limit(limit) if limit else "",
            f"{limited[0]} ({limited[1]:.0%})" if limited else "",
        ])  # fmt: skip
    return rows


def _has_elements(advice: "Advice") -> bool:
    return len(advice.ranges) > 1


def _worst(point: Point) -> str:
    """Return the error of the worst element of a point, and its name."""
    return percent(point.worst) + (f" ({point.element})" if point.element else "")


def _conclusion(advice: "Advice") -> str:
    own = advice.own
    has = ""
    if own is not None:
        element = f" ({own.element})" if own.error > own.norm else ""
        what = f"has an error of {percent(own.error)}{element}"
        if not math.isfinite(own.error):
            what = "diverges"
        if own.diverged is not None:
            what = f"diverges after {own.diverged:.3g} s"
        has = f"the model's own {own.integrator} at {own.timestep:g} s {what}"
    if advice.integrator is None:
        return f"no recommendation: {advice.reason}" + (f"; {has}" if has else "")
    if not advice.points:
        return (
            f"advice: {advice.integrator} at a timestep of {advice.timestep:.4g} s: statistics"
            f" differ by at most {percent(advice.promised)}"
        )
    chosen = next(
        point for point in advice.points
        if (point.integrator, point.timestep) == (advice.integrator, advice.timestep)
    )  # fmt: skip
    sentence = (
        f"advice: {advice.integrator} at a timestep of {advice.timestep:.4g} s: error up to"
        f" {percent(advice.promised)} over {advice.horizon:.4g} s, {chosen.seconds:.2g} s per"
        " simulated second"
    )
    if _has_elements(advice) and advice.every_element:
        sentence += ", also of each element over its own range"
    elif _has_elements(advice):
        sentence += f", but over its own range {_worst(chosen)}"
    if advice.settings:
        settings = (f'{name}="{value:g}"' for name, value in advice.settings.items())
        sentence += f", with {', '.join(settings)}"
    if own is not None and own is not chosen:
        ratio = own.seconds / chosen.seconds
        faster = f"{ratio:.2g} times faster" if ratio >= 1 else f"{1 / ratio:.2g} times slower"
        if 0.95 < ratio < 1.05:
            faster = "as fast"
        sentence += f"; {has}, and the advice is {faster}"
    elif own is chosen:
        sentence += ", its current setting"
    return sentence


def table(details: Sequence[Detail]) -> list[str]:
    """Return lines of text: a table of the features, and what can go together."""
    rows = [["without", "change", "saves", "can go"]]
    *_, last = [Detail("", 0.0, 0.0, False), *details]
    for detail in details[: -1 if last.together else None]:
        verdict = "yes" if detail.what in last.together else "alone" if detail.can_go else ""
        saved = "" if math.isnan(detail.saved) else f"{round(100 * detail.saved)} %"
        rows.append([detail.what, percent(detail.change), saved, verdict])
    lines = aligned(rows) if len(rows) > 1 else []
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


def percent(error: float) -> str:
    """Format a relative error in percent."""
    if not math.isfinite(error):
        return "diverged"
    return f"{100 * error:.2g} %"


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


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows of a table as lines."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
