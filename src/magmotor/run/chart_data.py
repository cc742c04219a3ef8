"""Measured error and cost of every method, and how they scale to other scenes."""

import json
import warnings
from collections.abc import Container
from functools import cache, lru_cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.step_limits import step_limit


class Curve(NamedTuple):
    """Error and cost of one method for one quantity, in order of increasing timestep."""

    steps: Array
    errors: Array
    """Relative error to expect at a timestep and at all shorter ones."""
    seconds: Array
    """Wall time per simulated second."""


@cache
def load() -> dict[str, Any]:
    """Return the charts' measurements: `machine`, `versions`, `durations`, `points`."""
    return json.loads(resources.files("magmotor.run").joinpath("front.json").read_text("utf-8"))


def basis() -> str:
    """Return where the charts were measured, and by which version of MuJoCo if that is known."""
    data = load()
    where, by = f"on {data['machine']}", data.get("versions", {}).get("mujoco")
    return f"charts measured {where} by MuJoCo {by}" if by else where


def curves(scene: str, surface: str, methods: Container[str]) -> dict[str, dict[str, Curve]]:
    """Return the curves of a charted scene by quantity and method."""
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
    """Return the errors to expect, in order of increasing timestep.

    An error below its floor counts as the floor. A longer step is taken to be no more accurate than
    a shorter one, as far as the error of the shorter one exceeds its floor.
    """
    return np.maximum(np.maximum(errors, floors), np.maximum.accumulate(errors - floors))


def _curve(points: list[dict[str, Any]]) -> Curve:
    points = sorted(points, key=lambda point: point["timestep"])
    names = ("timestep", "error", "floor", "seconds")
    steps, errors, floors, seconds = (np.array([p[name] for p in points]) for name in names)
    return Curve(steps, expected(errors, floors), seconds)


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


def fit(scene: Scene, method: str, charted: Curve) -> Curve:
    """Scale a charted curve to the timesteps of another scene.

    The timesteps are scaled so that every motion is resolved at least as well as in the charts,
    limited to the longest stable one, and rounded down to three digits. The cost of a step is kept.
    """
    steps = _scale(scene) * charted.steps
    longest = _longest_step(scene, method, steps[-1])
    taken = slice(int(np.searchsorted(steps, longest)) + 1)
    steps = np.minimum(steps[taken], longest)
    digits = 10.0 ** (2 - np.floor(np.log10(steps)))
    steps = np.floor(steps * digits * (1 + 1e-12)) / digits
    charted = Curve(*(column[taken] for column in charted))
    return charted._replace(steps=steps, seconds=charted.seconds * charted.steps / steps)


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
