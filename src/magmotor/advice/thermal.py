"""Splittings of `Langevin` at several timesteps: errors of statistics, and costs."""

import copy
import math
import os
import time
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from magmotor.advice.advice import Advice
from magmotor.advice.measured_quantities import KINETIC, Quantity
from magmotor.advice.paths import STATE, OutOfTime, Runs, quiet
from magmotor.advice.statistics_errors import FINE, REPLICAS, Ensemble, errors
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.langevin.langevin import Langevin
from magmotor.mjcf.langevin.samples import LangevinDiverged
from magmotor.noise import BrownianPath
from magmotor.numerics.splittings import LANGEVIN

FACTORS = (4.0, 2.0, 1.0, 0.5)
"""Timesteps over the model's that are judged."""

TRUTH = "baoab"
"""The splitting of the reference."""

RECORDS = 1000
"""Largest number of records of a run."""

PILOT, TURNS, SAMPLE, FEWEST = 0.15, 5, 0.01, 8
"""Part of the budget in which costs are measured, number of times that each is, and its longest
wall time in s and smallest number of steps."""


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
    advice : Advice
        To be filled.
    budget : float
        Wall time in s.
    show : callable
        Is called with what is running.

    Raises
    ------
    ValueError
        The model has noise of its own.
    """

    def __init__(
        self, runs: Runs, quantity: Quantity, kT: float, duration: float, advice: Advice, *,
        budget: float, show: Callable[[str], object],
    ):  # fmt: skip
        if runs.noisy:
            raise ArgumentError("kT", kT, "must be omitted, since the model has noise of its own")
        self._runs, self._quantity, self._kT = runs, quantity, kT
        self._advice, self._budget, self._show = advice, budget, show
        self._until = time.perf_counter() + budget
        runs.prepare(runs.integrator, runs.timestep)
        self._workspace = runs.workspace()
        longest = max(FACTORS)
        self._every = max(1, math.ceil(duration / runs.timestep / longest / RECORDS)) * longest
        self._records = max(2, round(duration / (self._every * runs.timestep)))
        self._duration = self._records * self._every * runs.timestep
        advice.duration = self._duration
        self._thermostats: dict[tuple[str, float], Langevin] = {}
        self._costs: dict[tuple[str, float], float] = {}
        self._slower, self._reading = 1.0, 0.0

    def run(self) -> None:
        """Compare as many splittings and timesteps as there is time for.

        Raises
        ------
        ValueError
            `Langevin` does not support the model.
        OutOfTime
            Already the quantity takes longer than there is time.
        """
        candidates = [(name, factor) for factor in FACTORS for name in LANGEVIN]
        with quiet():
            self._show("costs")
            self._measure_costs([(TRUTH, FINE), *candidates])
            if time.perf_counter() + self._needed() > self._until:
                self._give_up()
                return
            try:
                for row in errors(self._ensemble, self._runs.timestep, [TRUTH], candidates):
                    self._advice.statistics += (row,)
            except OutOfTime:
                if self._advice.statistics:
                    self._advice.notes += ("the budget was too small for more ensembles",)
                else:
                    self._give_up()
                return
        if not self._advice.statistics:
            diverges = "diverges even at a quarter of the model's timestep"
            self._advice.reason = f"{TRUTH} {diverges}"

    def _needed(self) -> float:
        """Return the wall time in s that the reference and its proof probably take."""
        return sum(self._predicted(TRUTH, times * FINE) for times in (1, 2, 4))

    def _give_up(self) -> None:
        sentence = f"the budget is too small: the reference takes about {self._needed():.2g} s"
        self._advice.reason = sentence

    def conclude(self) -> None:
        """Recommend the cheapest splitting whose statistics are certain to agree, if any."""
        advice = self._advice
        if best := advice.for_statistics:
            advice.method, advice.timestep = best.method, best.timestep
            advice.promised, advice.seconds = best.error, best.seconds
        elif advice.statistics:
            advice.reason = "no statistics known are certain to reach this error"
        else:
            advice.reason = advice.reason or "no reference was found in this time"

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
        """Return replicas, or None if one of them diverged.

        Raises
        ------
        OutOfTime
            They would probably take longer than there is time.
        """
        if (splitting, factor) not in self._costs:
            return None
        began = time.perf_counter()
        if began + self._predicted(splitting, factor) > self._until:
            raise OutOfTime
        self._show(f"{splitting} at {factor * self._runs.timestep:.3g} s")
        thermostat, data = self._thermostat(splitting, factor)
        every = round(self._every / factor)
        try:
            run = thermostat.sample(
                every * self._records * thermostat.timestep,
                replicas=REPLICAS,
                record_interval=every,
                initial=data,
            )
        except LangevinDiverged:
            return None
        self._slower *= (time.perf_counter() - began) / self._running(splitting, factor)
        begin = self._runs.recorded_start()
        paths, kinetic = [], []
        for qpos, qvel in zip(run["qpos"].to_numpy(), run["qvel"].to_numpy(), strict=True):
            states = np.tile(begin, (len(qpos), 1))
            states[:, 1 : 1 + qpos.shape[1]] = qpos
            states[:, 1 + qpos.shape[1] : 1 + qpos.shape[1] + qvel.shape[1]] = qvel
            paths.append(self._along(self._quantity, states))
            kinetic.append(self._along(KINETIC, states)[:, 0])
        return Ensemble(paths, kinetic, self._costs[splitting, factor])

    def _along(self, quantity: Quantity, states: Array) -> Array:
        values = quantity.along(self._runs.model, self._workspace, states, self._until)
        return values[:, : quantity.size]

    def _running(self, splitting: str, factor: float) -> float:
        """Return the wall time in s that replicas probably run; 0 if they diverge."""
        turns = math.ceil(REPLICAS / min(REPLICAS, os.cpu_count() or 1))
        cost = self._costs.get((splitting, factor), 0.0)
        return self._slower * cost * self._duration * turns

    def _predicted(self, splitting: str, factor: float) -> float:
        return self._running(splitting, factor) + self._reading * self._records * REPLICAS

    def _measure_costs(self, keys: Sequence[tuple[str, float]]) -> None:
        """Measure the wall time per simulated second, in turns; what diverges has none."""
        part = PILOT * self._budget
        sample, failed = min(SAMPLE, part / len(keys) / (TURNS + 1)), set[tuple[str, float]]()
        self._steps(TRUTH, FINE, 1)  # compiles
        began = time.perf_counter()
        self._until = began + self._budget
        states = self._runs.recorded_start()[np.newaxis]
        self._reading = min(self._timed_reading(states) for _ in range(TURNS))
        steps = dict.fromkeys(keys, FEWEST)
        for turn in range(TURNS):
            for key in keys:
                if key in failed or (turn and time.perf_counter() > began + part):
                    continue
                timestep = key[1] * self._runs.timestep
                most = max(FEWEST, int(self._duration / timestep))
                try:
                    while (taken := self._steps(*key, steps[key])) < sample / 2 and steps[
                        key
                    ] < most:
                        steps[key] = min(2 * steps[key], most)
                except FloatingPointError:
                    failed.add(key)
                    self._costs.pop(key, None)
                    continue
                cost = taken / (steps[key] * timestep)
                self._costs[key] = min(cost, self._costs.get(key, math.inf))

    def _timed_reading(self, states: Array) -> float:
        began = time.perf_counter()
        for quantity in (self._quantity, KINETIC):
            self._along(quantity, states)
        return time.perf_counter() - began

    def _steps(self, splitting: str, factor: float, count: int) -> float:
        """Return the wall time in s of so many steps from the start."""
        thermostat, data = self._thermostat(splitting, factor)
        began = time.perf_counter()
        thermostat.step(data, count)
        return time.perf_counter() - began
