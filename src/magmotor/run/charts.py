"""What the charts have measured, and how much longer a step another scene bears."""

import json
import warnings
from collections.abc import Container
from functools import cache, lru_cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.device.device import Scene
from magmotor.device.step_limits import step_limit

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
    return json.loads(resources.files("magmotor.run").joinpath("front.json").read_text("utf-8"))


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


def charted_scene(scene: Scene) -> Scene:
    """The scene of the charts that is of the same kind.

    Raises
    ------
    ValueError
        There is none.
    """
    charted = scene.device.charted
    if charted is None:
        sentence = "must be one of a kind that is charted: give simulate a method and a timestep"
        raise reject("scene", scene, sentence)
    return charted


def fit(scene: Scene, method: str, charted: Curve) -> Curve:
    """A charted curve for the steps of another scene.

    They are scaled so that no motion is followed worse, up to the longest that is stable,
    and rounded down to three digits; the cost of a step stays.
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
    """Ratio of the scene's steps to the charted scene's, of the fastest of each kind of motion.

    These are swing and friction; of the disk also the swing in the well as its temperature samples
    it, and the longest flights. Where nothing moves, it is 1.
    """
    charted = _rates(charted_scene(scene))
    rates = _rates(scene)
    return min([a / b for a, b in zip(charted, rates, strict=True) if b > 0], default=1.0)


def _longest_step(scene: Scene, method: str, charted: float) -> float:
    """The longest step that bears the scene at rest and that `simulate` takes without complaint.

    To 0.4 %, up to the charted one.
    """
    low = charted
    while not _is_taken(scene, method, low):
        low /= 2
    if low == charted:
        return charted
    high = 2 * low
    for _ in range(8):
        middle = (low + high) / 2
        low, high = (middle, high) if _is_taken(scene, method, middle) else (low, middle)
    return low


def _is_taken(scene: Scene, method: str, timestep: float) -> bool:
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
