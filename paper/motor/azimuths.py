"""Ensembles of the motor, of which only the ball's azimuth and the ring's lean are kept."""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.devices.motor.scene import Motor
from magmotor.run.simulate import simulate
from paper.motor.runs import DURATION, simulate_run

METHOD = "variational/middle"

RECORD_INTERVAL = 5.2
"""In s, in which the ball moves by much less than a quarter of a sector."""

BATCH = 64
"""Replicas that are in memory at a time."""


class Ensemble(NamedTuple):
    """A scene with the timestep (s) and the number of runs, at full size and in tests."""

    scene: Motor
    timestep: float
    full: int
    quick: int
    seed: int


ENSEMBLES = {
    "uniform": Ensemble(Motor(), 0.4, 256, 4, 100),
    "factor 1": Ensemble(Motor(ball_ring_factor=1), 0.4, 128, 2, 200),
    "nonuniform": Ensemble(Motor.paper("nonuniform-a"), 0.1, 128, 2, 300),
    "air at 2 mm/s": Ensemble(Motor().in_air(speed=0.002), 0.4, 128, 2, 500),
    "air at 20 mm/s": Ensemble(Motor().in_air(speed=0.02), 0.4, 128, 2, 600),
}
"""All runs last for `DURATION`, those at nonuniform temperature at most, until the ring tips."""


class Azimuths(NamedTuple):
    """The recorded paths of an ensemble; those of single runs may have different lengths."""

    scene: Motor
    method: str
    rows: list[NDArray[np.float64]]
    """azimuth of the ball in rad, unwrapped, recorded every `RECORD_INTERVAL`; each of shape (T,)
    """
    leans: list[NDArray[np.float64]]
    """horizontal components of the inner ring's axis; each of shape (T, 2)"""


def azimuths(name: str, quick: bool) -> Azimuths:
    """Simulate one of `ENSEMBLES`."""
    ensemble = ENSEMBLES[name]
    return simulated(name, ensemble.quick if quick else ensemble.full)


@cache
def simulated(name: str, count: int) -> Azimuths:
    """Simulate this number of runs of one of `ENSEMBLES`."""
    ensemble = ENSEMBLES[name]
    rows: list[NDArray[np.float64]] = []
    leans: list[NDArray[np.float64]] = []
    for run in _runs(name, ensemble, count):
        x, y = np.moveaxis(run.position.values[..., :2], -1, 0)
        # A ball that passes through the center goes half around, in either direction.
        rows += [*np.unwrap(np.arctan2(y, x))]
        leans += [*run.ring_axis.values[..., :2].copy()]
    return Azimuths(ensemble.scene, METHOD, rows, leans)


def _runs(name: str, ensemble: Ensemble, count: int) -> Iterator[xr.Dataset]:
    """Yield datasets with replicas, or one run each where a ring that tips would end them all."""
    scene, timestep, *_, seed = ensemble
    numerics = {
        "method": METHOD,
        "timestep": timestep,
        "duration": DURATION,
        "record_interval": round(RECORD_INTERVAL / timestep),
    }
    if scene.temperature == "nonuniform":
        for number in range(count):
            yield simulate_run(name, scene, seed=seed + number, **numerics).data.expand_dims(
                "replica"
            )
    else:
        for first in range(0, count, BATCH):
            replicas = min(BATCH, count - first)
            yield simulate(scene, replicas=replicas, seed=seed + first, **numerics)
