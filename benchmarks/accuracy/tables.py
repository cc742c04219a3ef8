"""Tables: cheapest methods, shares of the front, orders and costs, and scenes off the charts."""

from collections.abc import Callable, Mapping, Sequence
from math import inf

import numpy as np

from benchmarks.accuracy.dry_friction import METHOD as DRY_METHOD
from benchmarks.accuracy.dry_friction import NUMBERS as DRY_NUMBERS
from benchmarks.accuracy.points import (
    USELESS,
    Point,
    by_method,
    cheapest,
    chosen,
    points_of,
    step_costs,
)
from benchmarks.accuracy.scenes import SCENES
from benchmarks.harness.records import Record
from benchmarks.harness.tables import number, table
from magmotor.advice.points import SAME
from magmotor.numerics.splittings import RIGID, kicks_that_evaluate

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

ORDER_OF = "top", "position"
"""Scene and quantity for measuring orders: no noise, and no symmetry that would raise them."""
ROUNDING, SHORTEST = 1e-9, 3
"""Errors above `ROUNDING` at the `SHORTEST` steps determine the order."""

IN_MUJOCO = {"rk4": 4}
"""Force evaluations per step of MuJoCo's methods that need several."""

Curves = Mapping[str, Sequence[Point]]
"""Points by the names of the rows."""


def tabulate(records: Mapping[str, Record]) -> dict[str, str]:
    """Return all tables, by name."""
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
        "methods": _methods(chosen(points, *ORDER_OF), costs),
        "other_scenes": _other_scenes(records),
        "dry_friction": _dry_friction(records),
    }


def _cheapest(curves: Curves) -> str:
    """Return method, step (s) and microseconds per simulated second, by quantity and error."""
    rows = [
        [title, *(_cell(cheapest(curve, error)) for error in LEVELS.values())]
        for title, curve in curves.items()
    ]
    return table(["largest error", *LEVELS], rows)


def _cell(point: Point | None) -> str:
    if point is None:
        return "-"
    return f"`{point.method}` {point.timestep:.2g}: {number(1e6 * point.seconds)} µs"


def _gains(curves: Curves, in_mujoco: Curves, costs: Mapping[tuple[str, str], float]) -> str:
    """Return the gains over the usual method."""
    rows = []
    for (scene, _), title in QUANTITIES.items():
        curve, error = curves[title], LEVELS[GAIN_LEVEL]
        if "top" in scene:
            name, usual = "MuJoCo's Euler at 2 ms", costs[scene, DEFAULT] / DEFAULT_STEP
        else:
            paper = cheapest([point for point in curve if point.method == PAPER], error)
            name, usual = "the paper's scheme", paper.seconds if paper else inf
        best = (cheapest(curve, error), cheapest(in_mujoco[title], error))
        cells = [number(usual / p.seconds) if p and usual < inf else "-" for p in best]
        rows.append([title, name, number(1e6 * usual) if usual < inf else "-", *cells])
    columns = [f"error {GAIN_LEVEL}", "now", "µs", "gain of the best", "of MuJoCo's best"]
    return table(columns, rows)


def _front_shares(curves: Curves) -> str:
    """Return the lowest cost of each method over that of the others at no larger error."""
    found = {title: by_method(curve) for title, curve in curves.items()}
    return _by_method(found, _share)


def _share(curves: Mapping[str, Sequence[Point]], method: str) -> str:
    good = {name: [p for p in curve if p.stable] for name, curve in curves.items()}
    others = [point for name, curve in good.items() if name != method for point in curve]
    ratios = [
        point.seconds
        / min((p.seconds for p in others if p.bound <= SAME * point.bound), default=inf)
        for point in good[method]
        if point.bound < USELESS
    ]
    return "alone" if 0 in ratios else number(min(ratios, default=None))


def _methods(order_curve: Sequence[Point], costs: Mapping[tuple[str, str], float]) -> str:
    """Return measured order, force evaluations per step, and microseconds per step."""
    orders = {method: _order(curve) for method, curve in by_method(order_curve).items()}
    columns = {
        "order": {method: f"{order:.2f}" for method, order in orders.items() if order},
        "evaluations": {method: f"{_evaluations(method)}" for _, method in costs},
    }
    for name in SCENES:
        found = {method: cost for (of, method), cost in costs.items() if of == name}
        columns[f"{name}, µs"] = {m: f"{1e6 * cost:.2g}" for m, cost in found.items()}
    return _by_method(columns, lambda column, method: column[method])


def _order(curve: Sequence[Point]) -> float | None:
    """Return the order, by regression over the shortest steps."""
    good = [p for p in curve if p.error > ROUNDING and p.stable][:SHORTEST]
    steps, errors = ([getattr(p, name) for p in good] for name in ("timestep", "error"))
    if len(set(steps)) < 2:  # an adaptive method has only one
        return None
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def _evaluations(method: str) -> int:
    engine, scheme = method.split("/")
    if engine == "mujoco":
        return IN_MUJOCO.get(scheme, 1)
    return sum(kicks_that_evaluate(RIGID[scheme].parts))


def _other_scenes(records: Mapping[str, Record]) -> str:
    """Return the charted and the measured error of each scene that the charts do not contain."""
    rows = [
        [
            record["other_scene"],
            f"`{record['method']}` {record['timestep']:.3g}",
            *(number(record[name]) for name in ("charted_error", "error")),
        ]
        for record in records.values()
        if "other_scene" in record
    ]
    return table(["error of J over 60 s", "recommended", "charted", "measured"], rows)


def _dry_friction(records: Mapping[str, Record]) -> str:
    """Return the errors under dry friction."""
    rows = [
        [f"{record['coulomb']:g}, {record['viscous']:g} kg/s", *map(number, record["dry_errors"])]
        for record in records.values()
        if "dry_errors" in record
    ]
    columns = [f"`{DRY_METHOD}` {1 / n:g} s" for n in DRY_NUMBERS]
    return table(["error of J over 60 s with Coulomb and viscous friction", *columns], rows)


def _by_method(columns: Mapping[str, Mapping[str, object]], cell: Callable[..., str]) -> str:
    """Return a table with a row for each method; each column is a mapping from methods."""
    methods = dict.fromkeys(method for column in columns.values() for method in column)
    rows = [
        [f"`{method}`", *(cell(c, method) if method in c else "" for c in columns.values())]
        for method in methods
    ]
    return table(["", *columns], rows)
