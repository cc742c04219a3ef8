"""What distinguishes a ball among wells from a rotor: where it stays, and how long it flies."""

from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.motor.flights import CORE, directed_spans
from magmotor.devices.motor.scene import Motor
from paper.motor.spreading import Measured, over_replicas


class Wandering(NamedTuple):
    """What distinguishes a ball among wells from a rotor."""

    residence: Measured
    """Share of the time in the cores of wells, which are half of the circle."""
    variation: Measured
    """Squared coefficient of variation of flights after their first revolution."""

    @classmethod
    def of(cls, azimuth: Array, interval: float) -> "Wandering":
        """Measure it from azimuths in rad, shape (R, N)."""
        sectors = azimuth * Motor().outer_dipoles / (2 * np.pi)
        in_core = np.abs(sectors - np.rint(sectors)) <= CORE
        lasts = [interval * whole_flights(row) for row in azimuth]
        without_one = [
            _variation(lasts[:number] + lasts[number + 1 :]) for number in range(len(lasts))
        ]
        error = np.sqrt(len(lasts) - 1) * np.std(without_one)
        return cls(over_replicas(in_core.mean(axis=1)), Measured(_variation(lasts), error))


def whole_flights(azimuth: Array) -> Array:
    """Return how many records the flights of one replica last after their first revolution.

    Flights are those of `magmotor.observables.flights`. Those that the run cuts off are left out.
    """
    spans = directed_spans(azimuth, CORE * 2 * np.pi / Motor().outer_dipoles, 2 * np.pi)
    last = len(azimuth) - 1
    return np.array([end - once for begin, once, end in spans if begin > 0 and end < last], float)


def _variation(lasts: list[Array]) -> float:
    together = np.concatenate(lasts)
    return float(together.var() / together.mean() ** 2) if len(together) else np.nan
