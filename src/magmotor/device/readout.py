"""Readouts of live views: numbers that describe a scene's current state."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from magmotor.common.arrays import Array


class Readout(NamedTuple):
    """A number that a live view shows, and draws as a curve."""

    unit: str
    value: Callable[[Mapping[str, Array]], Any]
    """Computes the number from the current values of the device's `columns`, by name."""
    period: float = 0.0
    """Period of an angle, which is unwrapped from frame to frame; 0 for other quantities."""
