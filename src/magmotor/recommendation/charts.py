"""The points of the charts: how far off each method was at each step, and what it cost."""

import json
from collections.abc import Container
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Curve(NamedTuple):
    """What the charts show of one method and quantity, by ascending steps."""

    steps: Array
    errors: Array
    """To be expected at a step and at all shorter ones, relative."""
    seconds: Array
    """Wall time of a simulated second."""


@cache
def load() -> dict[str, Any]:
    """What `make charts` has measured: `machine`, `versions` and `points`."""
    return json.loads(resources.files("magmotor").joinpath("front.json").read_text("utf-8"))


def curves(scene: str, surface: str, methods: Container[str]) -> dict[str, dict[str, Curve]]:
    """The curves of a charted scene, by quantity and method."""
    found: dict[str, dict[str, list]] = {}
    for point in load()["points"]:
        if (point["scene"], point["surface"]) == (scene, surface) and point["method"] in methods:
            of_quantity = found.setdefault(point["quantity"], {})
            of_quantity.setdefault(point["method"], []).append(point)
    return {
        quantity: {method: _curve(points) for method, points in of_quantity.items()}
        for quantity, of_quantity in found.items()
    }


def expected(errors: Array, floors: Array) -> Array:
    """Errors to be expected, by ascending steps.

    An error under its floor counts as the floor; a longer step errs no less than a shorter, as far
    as that is above its floor.
    """
    return np.maximum(np.maximum(errors, floors), np.maximum.accumulate(errors - floors))


def _curve(points: list[dict[str, Any]]) -> Curve:
    points = sorted(points, key=lambda point: point["timestep"])
    names = ("timestep", "error", "floor", "seconds")
    steps, errors, floors, seconds = (np.array([p[name] for p in points]) for name in names)
    return Curve(steps, expected(errors, floors), seconds)
