"""The dipoles of a ring in its own frame."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.reproducible import applied


def ring_dipoles(count: int, radius: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (N, 3) and outward directions (N, 3) of equally spaced dipoles, first along x."""
    azimuth = 2 * np.pi * np.arange(count) / count
    outward = np.stack(
        [applied(math.cos, azimuth), applied(math.sin, azimuth), np.zeros_like(azimuth)], axis=1
    )
    return radius * outward, outward
