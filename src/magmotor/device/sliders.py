"""Sliders: quantities of a scene that move while one watches it."""

import math
from typing import NamedTuple

SMALLEST = 1e-24
"""What friction and temperature are instead of zero, so that the model keeps both."""


class Slider(NamedTuple):
    """A quantity that moves, in the scene's units."""

    start: float
    least: float
    largest: float


def positive(start: float, usual: float) -> Slider:
    """Up to four times where it starts, or the usual value if that is more."""
    return Slider(max(start, SMALLEST), SMALLEST, 4 * max(start, usual))


def noise_at(friction: float, kT: float) -> float:
    """Noise alpha that follows friction and temperature: alpha^2 = 2 c kT."""
    return math.sqrt(2 * friction * kT)
