"""The books of the motor's energy: what comes and goes in some spans of a run."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.panels import MotorRun


class Books(NamedTuple):
    """Sums over some spans of time, in J."""

    spans: int
    work: float
    """of the noise"""
    injected: float
    """by the noise in the mean"""
    heat: float
    """dissipated by friction"""
    ring: float
    """gained by the inner ring"""
    fastest: float
    """of each span the greatest kinetic energy of the ball"""


def books_of_flights(run: MotorRun) -> Books:
    """Of a run's flights."""
    ends = np.stack([run.flights.begin.values, run.flights.end.values], axis=1)
    return books(run, np.searchsorted(run.data.time.values, ends))


def books_of_all(run: MotorRun) -> Books:
    """Of a whole run."""
    return books(run, np.array([[0, len(run.data.time) - 1]]))


def books(run: MotorRun, spans: NDArray[np.int_]) -> Books:
    """Of spans from a record to another, shape (F, 2)."""
    data, scene, balance = run.data, run.scene, run.balance
    kinetic = 0.5 * (
        scene.ball_mass * (data.velocity**2).sum("space")
        + scene.ball_inertia * (data.angular_velocity**2).sum("space")
    )
    work, injected, heat, ring = (
        float(np.diff(series.values[spans], axis=1).sum())
        for series in (balance.work, balance.injected, balance.heat, data.ring_energy)
    )
    fastest = sum(float(kinetic[begin : end + 1].max()) for begin, end in spans)
    return Books(len(spans), work, injected, heat, ring, fastest)


def added(several: Iterable[Books]) -> Books:
    """Sums of the books of several runs."""
    return Books(*(sum(values) for values in zip(*several, strict=True)))
