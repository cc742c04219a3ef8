"""Measured error and cost of every method, and how they scale to other scenes."""

import json
import math
import warnings
from collections.abc import Container, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from importlib import resources
from typing import Any

import numpy as np

from magmotor.advice.points import Point, expected
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.step_limits import step_limit


@cache
def load() -> dict[str, Any]:
    """Return the charts' measurements: `machine`, `versions`, `durations`, `points`."""
    return json.loads(resources.files("magmotor.run").joinpath("front.json").read_text("utf-8"))


def basis() -> str:
    """Return where the charts were measured, and by which version of MuJoCo if that is known."""
    data = load()
    where, by = f"on {data['machine']}", data.get("versions", {}).get("mujoco")
    return f"charts measured {where} by MuJoCo {by}" if by else where


def curves(scene: str, surface: str, methods: Container[str]) -> dict[str, dict[str, list[Point]]]:
    """Return the points of a charted scene by quantity and method, by increasing timestep.

    Their errors are those to expect at a timestep and at all shorter ones.
    """
    found: dict[str, dict[str, list]] = {}
    for point in load()["points"]:
        if (point["scene"], point["surface"]) == (scene, surface) and point["method"] in methods:
            of_quantity = found.setdefault(point["quantity"], {})
            of_quantity.setdefault(point["method"], []).append(point)
    return {
        quantity: {method: _curve(method, points) for method, points in of_quantity.items()}
        for quantity, of_quantity in found.items()
    }


def _curve(method: str, points: list[dict[str, Any]]) -> list[Point]:
    points = sorted(points, key=lambda point: point["timestep"])
    errors, floors = (np.array([point[name] for point in points]) for name in ("error", "floor"))
    return [
        Point(method, point["timestep"], point["seconds"], error)
        for point, error in zip(points, expected(errors, floors).tolist(), strict=True)
    ]


def charted_scene(scene: Scene) -> Scene:
    """Return the charted scene of the same class.

    Raises
    ------
    ValueError
        The charts have no scene of this class.
    """
    charted = scene.device.charted
    if charted is None:
        kind = type(scene).__name__
        sentence = f"the charts have no {kind}: pass a method and a timestep to simulate"
        raise ArgumentError("scene", scene, sentence)
    return charted


def fit(scene: Scene, curve: Sequence[Point]) -> list[Point]:
    """Scale the charted timesteps of a method to another scene.

    The timesteps are scaled so that every motion is resolved at least as well as in the charts,
    limited to the longest stable one, and rounded down to three digits. The cost of a step is kept.
    """
    scale, fitted = _scale(scene), []
    longest = _longest_step(scene, curve[-1].method, scale * curve[-1].timestep)
    for point in curve:
        step = min(scale * point.timestep, longest)
        digits = 10.0 ** (2 - math.floor(math.log10(step)))
        rounded = math.floor(step * digits * (1 + 1e-12)) / digits
        seconds = point.seconds * point.timestep / rounded
        fitted.append(replace(point, timestep=rounded, seconds=seconds))
        if step == longest:
            break
    return fitted


def _scale(scene: Scene) -> float:
    """Return the ratio of the scene's timesteps to those of the charted scene.

    It is the smallest ratio of the charted rates to the scene's own: swing and friction; for the
    disk also the thermally sampled swing in the well and the longest flights. Without motion it is
    1.
    """
    charted = _rates(charted_scene(scene))
    rates = _rates(scene)
    return min([a / b for a, b in zip(charted, rates, strict=True) if b > 0], default=1.0)


def _longest_step(scene: Scene, method: str, charted: float) -> float:
    """Return the longest step, up to the charted one, that is stable and that `simulate` accepts.

    Stability refers to the scene at rest. The result is accurate to 0.4 %.
    """
    low = charted
    while not _is_accepted(scene, method, low):
        low /= 2
    if low == charted:
        return charted
    high = 2 * low
    for _ in range(8):
        middle = (low + high) / 2
        low, high = (middle, high) if _is_accepted(scene, method, middle) else (low, middle)
    return low


def _is_accepted(scene: Scene, method: str, timestep: float) -> bool:
    if timestep >= step_limit(scene, method, enough=timestep):
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            scene.device.check_run(scene, method, timestep, None)
        except (ValueError, UserWarning):
            return False
    return True


@lru_cache
def _rates(scene: Scene) -> tuple[float, ...]:
    return scene.device.rates(scene)
