"""Splittings of `Langevin` at several timesteps: errors of statistics, and costs."""

import copy
import math
import time
from collections.abc import Callable, Iterator

import mujoco
import numpy as np

from magmotor.advice.advice import Advice
from magmotor.advice.paths import STATE, Runs, quiet
from magmotor.advice.quantities import KINETIC, Quantity
from magmotor.advice.statistics import REPLICAS, Ensemble, certain, compared
from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.langevin import Langevin, LangevinDiverged
from magmotor.noise import BrownianPath
from magmotor.numerics.splittings import LANGEVIN

FINE, FACTORS = 0.25, (4.0, 2.0, 1.0, 0.5)
"""Timesteps over the model's: that of the reference, and those judged."""

TRUTH = "baoab"
"""The splitting of the reference."""

RECORDS = 1000
"""Largest number of records of a run."""

TURNS, SAMPLE = 5, 0.01
"""Number of times that each cost is measured, and the wall time in s of each."""


class Thermal:
    """Compares splittings at a temperature, on the same noise at each timestep.

    Parameters
    ----------
    runs : Runs
        Provide the model and the start.
    quantity : Quantity
    kT : float
        In J.
    duration : float
        In s.
    """

    def __init__(self, runs: Runs, quantity: Quantity, kT: float, duration: float):
        self._runs, self._quantity, self._kT = runs, quantity, kT
        runs.prepare(runs.integrator, runs.timestep)
        self._workspace = runs.workspace()
        longest = max(FACTORS)
        self._every = max(1, math.ceil(duration / runs.timestep / longest / RECORDS)) * longest
        self._records = max(2, round(duration / (self._every * runs.timestep)))
        self.duration = self._records * self._every * runs.timestep
        self._thermostats: dict[tuple[str, float], Langevin] = {}

    def compare(self, advice: Advice, until: float, show: Callable[[str], object]) -> None:
        """Fill the statistics of an `Advice`, and recommend a splitting and a timestep.

        Raises
        ------
        ValueError
            `Langevin` does not support the model.
        """
        with quiet():
            self._compare_all(advice, until, show)
            show("costs")
            costs = self._costs()
        advice.statistics = tuple(
            row._replace(seconds=costs.get((row.integrator, row.timestep), math.nan))
            for row in advice.statistics
        )
        _recommend(advice)

    def _compare_all(self, advice: Advice, until: float, show: Callable[[str], object]) -> None:
        truth, cost = None, 0.0
        for splitting, factor in self._candidates():
            if time.perf_counter() + cost * max(FACTORS) / factor > until:
                advice.notes += ("the budget was too small for more ensembles",)
                break
            show(f"{splitting} at {factor * self._runs.timestep:.3g} s")
            began = time.perf_counter()
            own = self._ensemble(splitting, factor)
            if factor == max(FACTORS):
                cost = max(cost, time.perf_counter() - began)
            if factor == FINE:
                truth = own
            elif truth is not None:
                timestep = factor * self._runs.timestep
                advice.statistics += compared(splitting, timestep, own, truth)

    def _candidates(self) -> Iterator[tuple[str, float]]:
        yield TRUTH, FINE
        for factor in FACTORS:
            for splitting in LANGEVIN:
                yield splitting, factor

    def _thermostat(self, splitting: str, factor: float) -> tuple[Langevin, mujoco.MjData]:
        """Return a thermostat, and data at the start."""
        key = splitting, factor
        if key not in self._thermostats:
            model = copy.copy(self._runs.model)
            model.opt.timestep = factor * self._runs.timestep
            path = BrownianPath(seed=0, timestep=self._runs.timestep)
            halvings = round(math.log2(factor))
            path = path.coarsened(2**halvings) if halvings > 0 else path.refined(-halvings)
            self._thermostats[key] = Langevin(model, self._kT, splitting=splitting, path=path)
        thermostat = self._thermostats[key]
        data = mujoco.MjData(thermostat.model)
        mujoco.mj_setState(thermostat.model, data, self._runs.start, STATE)
        return thermostat, data

    def _ensemble(self, splitting: str, factor: float) -> Ensemble | None:
        """Return replicas, or None if one of them diverged."""
        thermostat, data = self._thermostat(splitting, factor)
        every = round(self._every / factor)
        try:
            run = thermostat.sample(
                every * self._records, replicas=REPLICAS, every=every, initial=data
            )
        except LangevinDiverged:
            return None
        begin = self._runs.recorded_start()
        paths, kinetic = [], []
        for qpos, qvel in zip(run["qpos"].to_numpy(), run["qvel"].to_numpy(), strict=True):
            states = np.tile(begin, (len(qpos), 1))
            states[:, 1 : 1 + qpos.shape[1]] = qpos
            states[:, 1 + qpos.shape[1] : 1 + qpos.shape[1] + qvel.shape[1]] = qvel
            paths.append(self._along(self._quantity, states))
            kinetic.append(self._along(KINETIC, states)[:, 0])
        return Ensemble(paths, kinetic, math.nan)

    def _along(self, quantity: Quantity, states: Array) -> Array:
        return quantity.along(self._runs.model, self._workspace, states)

    def _costs(self) -> dict[tuple[str, float], float]:
        """Return the wall time per simulated second, measured in turns."""
        found: dict[tuple[str, float], float] = {}
        for _ in range(TURNS):
            for splitting, factor in self._thermostats:
                thermostat, data = self._thermostat(splitting, factor)
                timestep = factor * self._runs.timestep
                guess = found.get((splitting, timestep), math.inf) * timestep
                steps = max(8, min(10_000, int(SAMPLE / guess)))
                began = time.perf_counter()
                try:
                    thermostat.step(data, steps)
                except FloatingPointError:
                    continue
                taken = (time.perf_counter() - began) / (steps * timestep)
                key = splitting, timestep
                found[key] = min(taken, found.get(key, math.inf))
        return found


def _recommend(advice: Advice) -> None:
    """Recommend the cheapest splitting whose statistics are certain to agree."""
    bounds = certain(advice.statistics)
    for key, bound in bounds.items():
        if bound <= advice.error:
            advice.integrator, advice.timestep = key
            advice.promised = bound
            return
    advice.reason = "the statistics are too uncertain" if bounds else "the budget is too small"
