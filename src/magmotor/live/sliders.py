"""The sliders that a scene has, and the scene that they say."""

import math
from collections.abc import Mapping
from functools import singledispatch
from typing import Any, NamedTuple

from magmotor.devices.disk.scene import Disk
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.scene import Top

SMALLEST = 1e-24
"""What friction and temperature are instead of zero, so that the model keeps both."""


class Slider(NamedTuple):
    """A quantity that moves, in the scene's units."""

    start: float
    least: float
    largest: float


@singledispatch
def sliders_of(scene: Any) -> dict[str, Slider]:
    """The sliders of a scene by name; a ring on a script has none."""
    return {}


@singledispatch
def scene_at(scene: Any, values: Mapping[str, float]) -> Any:
    """The scene with its sliders at these values, one for each.

    Noise follows friction and temperature: alpha^2 = 2 c kT.

    Raises
    ------
    ValueError
        Names the field, its value and the bound.
    """
    return scene


@sliders_of.register
def _(scene: Top) -> dict[str, Slider]:
    friction = {"friction": _positive(scene.friction, Top().friction)}
    if scene.ring_script:
        return friction
    ring = {
        "tilt": Slider(scene.tilt, 0.0, max(0.4, scene.tilt)),
        "height": Slider(scene.ring_height, 0.5 * scene.ring_height, 2 * scene.ring_height),
    }
    return ring | friction


@scene_at.register
def _(scene: Top, values: Mapping[str, float]) -> Top:
    fields = {"ring_height" if name == "height" else name: x for name, x in values.items()}
    return scene.replace(**fields)


@sliders_of.register
def _(scene: Disk) -> dict[str, Slider]:
    return {
        "friction": _positive(scene.friction, Disk().friction),
        "temperature": _positive(1 / scene.beta, 1 / Disk().beta),
    }


@scene_at.register
def _(scene: Disk, values: Mapping[str, float]) -> Disk:
    friction = values["friction"]
    return scene.replace(friction=friction, noise=_noise(friction, values["temperature"]))


@sliders_of.register
def _(scene: Motor) -> dict[str, Slider]:
    usual = Motor(temperature=scene.temperature)
    names = ["friction_ball", "friction_ring"]
    if scene.temperature != "uniform":
        names = ["friction_ball", "alpha_ring"]
    found = {name: _positive(getattr(scene, name), getattr(usual, name)) for name in names}
    if scene.temperature == "uniform":
        found["temperature"] = _positive(1 / scene.beta, 1 / usual.beta)
    return found


@scene_at.register
def _(scene: Motor, values: Mapping[str, float]) -> Motor:
    fields = dict(values)
    if scene.temperature == "uniform":
        kT = fields.pop("temperature")
        for body in ("ball", "ring"):
            fields[f"alpha_{body}"] = _noise(fields[f"friction_{body}"], kT)
    return scene.replace(**fields)


def _positive(start: float, usual: float) -> Slider:
    """Up to four times where it starts, or the usual value if that is more."""
    return Slider(max(start, SMALLEST), SMALLEST, 4 * max(start, usual))


def _noise(friction: float, kT: float) -> float:
    return math.sqrt(2 * friction * kT)
