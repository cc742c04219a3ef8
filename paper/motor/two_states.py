"""Statistics of two states of motion, in wells and in flights, beside those of a rotor."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.flights import CORE, directed_spans
from magmotor.devices.motor.plot_panels import MotorRun
from paper.motor.azimuths import ENSEMBLES, RECORD_INTERVAL, simulated
from paper.motor.flight_definitions import DEFINITIONS, SECTOR, remaining
from paper.motor.rotor import WINDOW, RateAndMemory, rate_and_memory, rotor
from paper.motor.runs import DURATION

STEP = 5.0
"""Time in s between the records that are used of a run."""

ROTORS = 120

FEW = {"uniform": 48, "nonuniform": 16}
"""Runs that determine the rate and the memory of the rotors."""


class States(NamedTuple):
    """What tells flights from the time between them, in several runs together."""

    contrast: float
    """Motion around the ring over `WINDOW` in flights, relative to that between them. Flights are
    selected as parts without reversal, so that it exceeds 1 for any motion."""
    cores_between: float
    """Part of the time between flights in the cores of wells, which are half of the circle."""
    cores_in_flight: float
    """The same in flights."""

    @property
    def held(self) -> float:
        """How much longer the ball is near wells between flights than in them; 0 without wells."""
        return self.cores_between - self.cores_in_flight


def states(rows: Sequence[NDArray[np.float64]], step: float) -> States:
    """Measure the states of motion in azimuths (rad), recorded every `step` seconds."""
    stride = round(WINDOW / step)
    drifts, flying, cores, all_flying = [], [], [], []
    for row in rows:
        in_flight = np.zeros(len(row), dtype=bool)
        for begin, _, end in directed_spans(row, CORE * SECTOR, 2 * np.pi):
            in_flight[begin : end + 1] = True
        drift = np.abs(np.diff(row[::stride]))
        drifts.append(drift)
        flying.append(in_flight[::stride][: len(drift)])
        sectors = row / SECTOR
        cores.append(np.abs(sectors - np.rint(sectors)) <= CORE)
        all_flying.append(in_flight)
    drift, begins_flying, core, fly = map(np.concatenate, (drifts, flying, cores, all_flying))
    return States(
        float(drift[begins_flying].mean() / drift[~begins_flying].mean()),
        float(core[~fly].mean()),
        float(core[fly].mean()),
    )


class Rotors(NamedTuple):
    """Rotors with the rate and memory of the ball, but without wells."""

    measured: RateAndMemory
    flying: int
    """number of the `ROTORS` that fly within `DURATION`"""
    mean: States
    spread: States
    """standard deviations over groups of as many rotors as there are runs"""
    squared_variation: tuple[float, float]
    """of what is left of their flights, with its error"""


def states_of(runs: Sequence[MotorRun]) -> States:
    """Measure the states of motion of some runs."""
    rows = [
        2 * np.pi * run.revolutions[:: round(STEP / float(run.data.time[1] - run.data.time[0]))]
        for run in runs
    ]
    return states(rows, STEP)


@cache
def rotors_beside(kind: str, together: int, quick: bool) -> Rotors:
    """Draw rotors with the rate and memory of the ball, and measure their states.

    Parameters
    ----------
    kind : str
        A key of `FEW`.
    together : int
        Number of runs that they are compared with.
    quick : bool
    """
    few = ENSEMBLES[kind].quick if quick else FEW[kind]
    measured = rate_and_memory(simulated(kind, few).rows, RECORD_INTERVAL)
    rows = [*rotor(*measured, np.arange(0, DURATION, RECORD_INTERVAL), ROTORS, seed=1)]
    groups = [rows[first : first + together] for first in range(0, ROTORS, together)]
    found = np.array([states(group, RECORD_INTERVAL) for group in groups])
    left = remaining(rows, DEFINITIONS["once"])
    mean, spread = States(*found.mean(axis=0)), States(*found.std(axis=0, ddof=1))
    return Rotors(measured, len(np.unique(left.run)), mean, spread, left.squared_variation)
