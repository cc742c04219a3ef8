"""The paper's seven motors, run until their end or until the inner ring is lost."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.device.stops import PhysicalEvent
from magmotor.devices.motor.guard import TIPPED
from magmotor.devices.motor.panels import MotorRun
from magmotor.devices.motor.scene import PAPER, Motor
from magmotor.run.simulate import simulate

RECORDS = 100
"""The least for which there are averages."""

NUMERICS = {"method": "variational/baoab", "timestep": 0.1, "record_interval": 10}
DURATION = 1e5
"""In s: long enough for flights; the paper does not tell its duration."""


def simulate_run(name: str, scene: Motor, **arguments: Any) -> MotorRun:
    """Simulate a motor; if its ring is lost after `RECORDS`, the run has an attribute `stopped`.

    Arguments and errors are those of `simulate`.
    """
    try:
        data = simulate(scene, **arguments)
    except PhysicalEvent as stop:
        if stop.event != TIPPED or stop.dataset.sizes["time"] < RECORDS:
            raise
        data = stop.dataset.assign_attrs(stopped=f"at t = {stop.time:g} s: {stop.reason}")
    return MotorRun(name, data)


@cache
def paper_runs() -> list[MotorRun]:
    """All seven, each by the realization that `PAPER` names."""
    return [
        simulate_run(name, Motor.paper(name), duration=DURATION, seed=seed, **NUMERICS)
        for name, (_, _, seed) in PAPER.items()
    ]


def of_temperature(runs: Sequence[MotorRun], kind: str) -> list[MotorRun]:
    """Those of one kind of temperature."""
    return [run for run in runs if run.scene.temperature == kind]


def in_flight(run: MotorRun) -> NDArray[np.bool_]:
    """Whether the ball is in flight, at each recorded time."""
    time = run.data.time.values[:, np.newaxis]
    begin, end = run.flights.begin.values, run.flights.end.values
    return np.any((begin <= time) & (time <= end), axis=1)
