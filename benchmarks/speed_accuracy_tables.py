"""Tables of the cheapest methods, of what each owns of the front, and of what a step costs."""

from collections.abc import Callable, Mapping, Sequence
from math import inf

from case import Record
from markdown_table import number, table
from speed_accuracy_points import (
    SAME,
    USELESS,
    Point,
    by_method,
    cheapest,
    chosen,
    points_of,
    step_costs,
)
from speed_accuracy_subjects import SUBJECTS

LEVELS = {"10 %": 0.1, "1 %": 0.01, "0.1 %": 1e-3, "1e-4": 1e-4, "1e-6": 1e-6}
QUANTITIES = {
    ("top", "momentum_map"): "top, case 4: J over 60 s",
    ("top", "position"): "top, case 4: position at 20 s",
    ("free top", "position"): "top, case 2: position at 20 s",
    ("free top", "energy"): "top, case 2: energy over 500 s",
    ("top on a plane", "momentum_map"): "top on a plane: J over 60 s",
    ("motor", "path"): "motor: position at 20 s on a path",
    ("motor", "temperature"): "motor: temperatures",
    ("disk", "path"): "disk: x at t = 10 on a path",
    ("disk", "temperature"): "disk: temperature",
    ("disk", "diffusion"): "disk: diffusion of d",
}
DEFAULT, DEFAULT_STEP, PAPER = "mujoco/euler", 0.002, "variational/euler"
GAIN_LEVEL = "1 %"

Curves = Mapping[str, Sequence[Point]]
"""Points by what the rows are called."""


def tabulate(records: Mapping[str, Record]) -> dict[str, str]:
    """All tables, by name."""
    points, costs = points_of(records), step_costs(records)
    curves = {title: chosen(points, *of) for of, title in QUANTITIES.items()}
    in_mujoco = {
        title: [point for point in curve if point.method.startswith("mujoco")]
        for title, curve in curves.items()
    }
    return {
        "cheapest": _cheapest(curves),
        "cheapest_mujoco": _cheapest(in_mujoco),
        "gains": _gains(curves, in_mujoco, costs),
        "front_shares": _front_shares(curves),
        "methods": _step_costs(costs),
    }


def _cheapest(curves: Curves) -> str:
    """By quantity and error: method, step in s, and microseconds of a simulated second."""
    rows = [
        [title, *(_told(cheapest(curve, error)) for error in LEVELS.values())]
        for title, curve in curves.items()
    ]
    return table(["largest error", *LEVELS], rows)


def _told(point: Point | None) -> str:
    if point is None:
        return "-"
    return f"`{point.method}` {point.timestep:.2g}: {number(1e6 * point.seconds)} µs"


def _gains(curves: Curves, in_mujoco: Curves, costs: Mapping[tuple[str, str], float]) -> str:
    """How many times cheaper than what one pays now."""
    rows = []
    for (subject, _), title in QUANTITIES.items():
        curve, error = curves[title], LEVELS[GAIN_LEVEL]
        if "top" in subject:
            name, usual = "MuJoCo's Euler at 2 ms", costs[subject, DEFAULT] / DEFAULT_STEP
        else:
            paper = cheapest([point for point in curve if point.method == PAPER], error)
            name, usual = "the paper's scheme", paper.seconds if paper else inf
        best = (cheapest(curve, error), cheapest(in_mujoco[title], error))
        cells = [number(usual / p.seconds) if p and usual < inf else "-" for p in best]
        rows.append([title, name, number(1e6 * usual) if usual < inf else "-", *cells])
    columns = [f"error {GAIN_LEVEL}", "now", "µs", "gain of the best", "of MuJoCo's best"]
    return table(columns, rows)


def _front_shares(curves: Curves) -> str:
    """Least cost of each method over that of the others at no larger error."""
    found = {title: by_method(curve) for title, curve in curves.items()}
    return _by_method(found, _share)


def _share(curves: Mapping[str, Sequence[Point]], method: str) -> str:
    others = [point for name, curve in curves.items() if name != method for point in curve]
    ratios = [
        point.seconds
        / min((p.seconds for p in others if p.bound <= SAME * point.bound), default=inf)
        for point in curves[method]
        if point.bound < USELESS
    ]
    return "alone" if 0 in ratios else number(min(ratios, default=None))


def _step_costs(costs: Mapping[tuple[str, str], float]) -> str:
    """Microseconds a step."""
    found = {name: {m: cost for (of, m), cost in costs.items() if of == name} for name in SUBJECTS}
    titles = {f"{name}, µs a step": methods for name, methods in found.items()}
    return _by_method(titles, lambda methods, method: f"{1e6 * methods[method]:.2g}")


def _by_method(columns: Mapping[str, Mapping[str, object]], cell: Callable[..., str]) -> str:
    """A row a method, a column a mapping from methods."""
    methods = dict.fromkeys(method for column in columns.values() for method in column)
    rows = [
        [f"`{method}`", *(cell(c, method) if method in c else "" for c in columns.values())]
        for method in methods
    ]
    return table(["", *columns], rows)
