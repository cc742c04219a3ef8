"""Running an ensemble: threads, progress, checkpoints, interruption."""

import dataclasses
import json
import math
import os
import threading
import time
import warnings
import zlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from tqdm import tqdm

from magmotor import theory
from magmotor.devices import disk
from magmotor.engines.variational.lanes import LANES, kernel, law
from magmotor.engines.variational.run import pack, unpack
from magmotor.engines.variational.schemes import SCHEMES
from magmotor.ensemble import checkpoint as checkpoints
from magmotor.ensemble.moments import POWERS, moments, quantities
from magmotor.ensemble.plan import Plan, plan
from magmotor.ensemble.result import result
from magmotor.ensemble.statistics import Statistics, accumulate, empty
from magmotor.noise import check_seed
from magmotor.scenes import Disk, LangevinParticle
from magmotor.scenes.fields import check_choice, check_integer, reject
from magmotor.simulation import SimulationDiverged, SimulationInterrupted
from magmotor.states.disk import DiskStates

BLOCK = 32
"""Samples that the kernel hands to the statistics at a time: they stay in the cache."""

SECONDS_BETWEEN_CHECKPOINTS = 30.0
SECONDS_BETWEEN_LOOKS = 0.5
"""How long the threads work before progress is shown and an interrupt is heard, about."""


def ensemble(
    scene: Disk | LangevinParticle,
    *,
    method: str,
    timestep: float,
    duration: float,
    replicas: int,
    seed: int = 0,
    sample_interval: int | None = None,
    burn_in: float = 0.0,
    initial: Mapping[str, ArrayLike] | None = None,
    trajectories: int = 0,
    threads: int | None = None,
    checkpoint: str | Path | None = None,
) -> xr.Dataset:
    """Run many replicas, keeping statistics only.

    A replica's path is the one that `simulate` gives it, number for number, and nothing in the
    result depends on the number of threads or on interruptions.

    Parameters
    ----------
    scene : Disk or LangevinParticle
    method : str
        `variational/euler` or `variational/baoab`.
    timestep, duration : float
    replicas : int
        Number of independent runs.
    seed : int
        Of the Brownian paths; the replica's number does the rest.
    sample_interval : int, optional
        Steps between the samples that statistics see; by default, the steps in a time of 1.
    burn_in : float
        Time after which correlations, histograms and flights begin.
    initial : mapping, optional
        `x`, `v`, `theta`, `omega`, numbers or arrays (replicas,), instead of the scene's own: of
        `gibbs(scene, replicas)`, the stationary state.
    trajectories : int
        Of so many replicas, x at all recorded times is kept.
    threads : int, optional
        By default, the number of processors.
    checkpoint : str or Path, optional
        File to save all to, every half minute and at the end, and to go on from if it is there.

    Returns
    -------
    xarray.Dataset
        Over `time` (logarithmic and even), by `quantity`: `mean`, `mean_square` and their standard
        errors, of the displacements x and y = x + theta since the start, d = -v + sigma omega, the
        slip v + omega, v, omega and the energy. Over `lag`: `increment_correlation` of
        x(t + 2 lag) - x(t + lag) and x(t + lag) - x(t), `mean_square_increment`, and their errors.
        `density` of x mod 2 pi, v and omega over `bin`; `flights` and `unfinished_flights` by
        `flight_duration`, the number of times between changes of sign of d with a hysteresis of
        0.1 standard deviations, seen at the samples. Final `x`, `v`, `theta`, `omega` by `replica`.

    Raises
    ------
    ValueError
        Bad input, also a checkpoint of another task: names it, its value and the bound.
    SimulationDiverged
        A replica is no longer finite or has energy that it cannot have; holds what was recorded.
    SimulationInterrupted
        Ctrl-C; holds what was recorded, after a last checkpoint.

    Warns
    -----
    UserWarning
        The timestep is too long for the flights at this temperature, or a checkpoint could not be
        written: the one before it stays, and the run goes on.
    """
    check_choice("method", method, tuple(f"variational/{name}" for name in SCHEMES))
    check_seed(seed)
    check_integer("replicas", replicas, at_least=1)
    check_integer("trajectories", trajectories, at_least=0)
    if trajectories > replicas:
        raise reject("trajectories", trajectories, f"at most {replicas}, the replicas")
    if threads is not None:
        check_integer("threads", threads, at_least=1)
    if not scene.noise:
        raise reject("noise", scene.noise, "positive: all replicas would be the same")
    steps = max(1, round(1 / timestep)) if sample_interval is None else sample_interval
    when = plan(timestep, duration, steps, burn_in)
    disk.check_run(scene, method, timestep, replicas)
    first = disk.initial_state(scene, initial, replicas)
    task = {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(dataclasses.asdict(scene)),
        "method": method,
        "timestep": timestep,
        "duration": duration,
        "replicas": replicas,
        "seed": seed,
        "sample_interval": steps,
        "burn_in": burn_in,
        "trajectories": trajectories,
        "initial": zlib.crc32(pack(first).tobytes()),
    }
    run = _Run(scene, task, when, pack(first), None if checkpoint is None else Path(checkpoint))
    return run.to_the_end(threads or os.cpu_count() or 1)


class _Run:
    """The state of an ensemble under way; everything that changes is in `arrays`."""

    def __init__(self, scene, task: dict[str, Any], when: Plan, lanes: NDArray, path: Path | None):
        self.scene, self.task, self.when, self.path = scene, task, when, path
        scheme = task["method"].split("/")[1]
        self.advance, self.rule = kernel(scene, scheme), law(scene, scheme, task["timestep"])
        self.deviations, self.sigma = _deviations(scene)
        replicas, padded = task["replicas"], lanes.shape[1]
        self.replicas, self.groups = replicas, -(-padded // LANES)
        self.start = self._states(lanes)
        self.guard = disk.guard(scene, self.start)
        saved = checkpoints.load(path, task) if path else None
        self.arrays: dict[str, NDArray] = saved or {
            "sample": np.zeros((), np.int64),
            "states": lanes,
            "moments": np.zeros((len(when.records), len(quantities(scene)), len(POWERS))),
            "paths": np.zeros((len(when.records), task["trajectories"])),
            **empty(padded, when.levels)._asdict(),
        }
        self.statistics = Statistics(*[self.arrays[name] for name in Statistics._fields])
        self.saved_at = time.monotonic()

    @property
    def sample(self) -> int:
        return int(self.arrays["sample"])

    def to_the_end(self, threads: int) -> xr.Dataset:
        """Advance from record to record; see `ensemble` for how it may end."""
        unit = self.when.interval * self.task["timestep"]
        bar = "{l_bar}{bar}| t = {n:.0f} of {total:.0f} [{elapsed}<{remaining}]"
        progress = tqdm(
            total=self.when.samples * unit, initial=self.sample * unit, desc="ensemble",
            bar_format=bar, delay=2, disable=None,
        )  # fmt: skip
        pool = ThreadPoolExecutor(threads)
        try:
            self._record()
            span = 1
            while self.sample < self.when.samples:
                began = time.monotonic()
                stop = self._next_stop(span)
                taken = stop - self.sample
                self._advance_to(stop, pool, threads)
                self._record()
                progress.update(self.sample * unit - progress.n)
                elapsed = max(time.monotonic() - began, 1e-6)
                span = max(1, int(taken * SECONDS_BETWEEN_LOOKS / elapsed))
                if time.monotonic() - self.saved_at > SECONDS_BETWEEN_CHECKPOINTS:
                    self._save()
            self._save()
        except KeyboardInterrupt:
            self._record()
            self._save()
            raise SimulationInterrupted(self._result()) from None
        finally:
            pool.shutdown()
            progress.close()
        return self._result()

    def _next_stop(self, span: int) -> int:
        """The next record, or as far as `span` samples."""
        records = self.when.records
        following = int(records[np.searchsorted(records, self.sample, "right")])
        return min(following, self.sample + span)

    def _advance_to(self, stop: int, pool: ThreadPoolExecutor, threads: int) -> None:
        """Have the threads take one group after another from here to `stop`.

        An interrupt is heard when all are done, so that the replicas stay together.
        """
        waiting = iter(range(self.groups))
        lock = threading.Lock()

        def work() -> None:
            room = np.empty((BLOCK, 4, LANES))
            while True:
                with lock:
                    group = next(waiting, None)
                if group is None:
                    return
                self._advance_group(group, stop, room)

        jobs = [pool.submit(work) for _ in range(min(threads, self.groups))]
        interrupted = False
        for job in jobs:
            while True:
                try:
                    job.result()
                    break
                except KeyboardInterrupt:
                    interrupted = True
        self.arrays["sample"] = np.array(stop)
        if interrupted:
            raise KeyboardInterrupt

    def _advance_group(self, group: int, stop: int, room: NDArray) -> None:
        begin = group * LANES
        states = self.arrays["states"][:, begin : begin + LANES]
        lanes = min(LANES, self.replicas - begin)
        interval, burn_in, seed = self.when.interval, self.when.burn_in, self.task["seed"]
        sample = self.sample
        if sample == 0 and burn_in == 0:
            self._accumulate(states[np.newaxis], group, lanes, 0)
        while sample < stop:
            count = min(BLOCK, stop - sample)
            block = room[:count, :, : states.shape[1]]
            self.advance(states, block, sample * interval, interval, seed, begin, 1, 0, self.rule)
            if sample + count >= burn_in:
                skipped = max(0, burn_in - sample - 1)
                self._accumulate(block[skipped:], group, lanes, sample + 1 + skipped - burn_in)
            sample += count

    def _accumulate(self, block: NDArray, group: int, lanes: int, first: int) -> None:
        accumulate(self.statistics, block, group, lanes, first, self.deviations, self.sigma)

    def _record(self) -> None:
        """Check the states, and take their moments if this sample is recorded."""
        states = self._states(self.arrays["states"])
        _, reason = self.guard.first_wrong(states)
        if reason:
            reached = self.sample * self.when.interval * self.task["timestep"]
            raise SimulationDiverged(reason, reached, self._result())
        row = int(np.searchsorted(self.when.records, self.sample))
        if self.when.records[row] == self.sample:
            self.arrays["moments"][row] = moments(self.scene, states, self.start)
            kept = self.arrays["paths"].shape[1]
            self.arrays["paths"][row] = self.arrays["states"][0, :kept]

    def _states(self, lanes: NDArray) -> DiskStates:
        one = lanes[np.newaxis, :, : self.replicas]
        return unpack(np.zeros(1), one.copy(), isinstance(self.scene, Disk))

    def _save(self) -> None:
        if self.path is None:
            return
        self.saved_at = time.monotonic()
        try:
            checkpoints.save(self.path, self.task, self.arrays)
        except OSError as error:
            warnings.warn(
                f"no checkpoint {self.path}: {error.strerror or error}; the one before it stays",
                stacklevel=4,
            )

    def _result(self) -> xr.Dataset:
        return result(self.scene, self.task, self.when, self.arrays, self.deviations)


def _deviations(scene: Disk | LangevinParticle) -> tuple[tuple[float, float, float], float]:
    """Standard deviations of v, omega and d, and sigma; those that are not there are 1."""
    if isinstance(scene, LangevinParticle):
        return (math.sqrt(theory.temperature(scene)), 1.0, 1.0), 1.0
    squares = theory.gibbs_mean_squares(scene)
    v, omega, d = (math.sqrt(squares[name]) for name in ("v", "omega", "d"))
    return (v, omega, d), scene.sigma
