"""Sliders of the live viewer: quantities of a scene that change while it runs."""

import math
from typing import NamedTuple

SMALLEST = 1e-24
"""Replaces zero friction and temperature, so that the model keeps both."""


class Slider(NamedTuple):
    """Initial value and range of a quantity, and its unit; "1" if it is dimensionless."""

    start: float
    least: float
    largest: float
    unit: str

    def label(self, name: str) -> str:
        """Return the name with the unit, as it is shown."""
        name = name.replace("_", " ")
        return name if self.unit == "1" else f"{name} ({self.unit})"


def positive(start: float, usual: float, unit: str) -> Slider:
    """Return a slider that reaches four times its initial value, or the usual value if larger."""
    return Slider(max(start, SMALLEST), SMALLEST, 4 * max(start, usual), unit)


def noise_at(friction: float, kT: float) -> float:
    """Return the noise alpha of a friction and a temperature: alpha^2 = 2 c kT."""
    return math.sqrt(2 * friction * kT)
