"""Runs of ensembles of disk and particle: threads, progress, checkpoints, interrupts."""

import dataclasses
import json
import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_choice
from magmotor.common.environment import thread_count
from magmotor.common.exceptions import ArgumentError
from magmotor.common.interrupts import deferred
from magmotor.device.checkpoint import Checkpoint, Expected
from magmotor.device.job import EnsembleOptions
from magmotor.device.states import checksum
from magmotor.device.stops import SimulationInterrupted, stopped
from magmotor.devices.disk.ensemble.accumulators import (
    POWERS,
    Statistics,
    accumulate,
    bounds,
    empty,
    moments,
    quantities,
)
from magmotor.devices.disk.ensemble.result import Plan, plan, result
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.devices.disk.theory.stationary import hottest
from magmotor.devices.disk.variational import (
    LANES,
    TURN,
    kernel,
    pack,
    step_coefficients,
    unpack,
)
from magmotor.noise import check_seed
from magmotor.numerics.compilation_notice import Progress
from magmotor.numerics.constants import COUNT

BLOCK = 64
"""Number of samples that the kernel passes to the statistics at a time, in the L2 cache."""

SECONDS_BETWEEN_CHECKS = 0.5
"""Approximate time between updates of the progress bar, and checks for an interrupt."""


def ensemble(
    scene: Disk | LangevinParticle, options: EnsembleOptions, simulate: Callable[..., xr.Dataset]
) -> xr.Dataset:
    """Run an ensemble of disk or particle."""
    method, timestep, replicas = options.method, options.timestep, options.replicas
    check_choice("method", method, scene.device.methods(scene))
    seed = check_seed(options.seed)
    if options.trajectories > replicas:
        sentence = f"must be at most {replicas}, the number of replicas"
        raise ArgumentError("trajectories", options.trajectories, sentence)
    if not scene.noise:
        raise ArgumentError(
            "noise", scene.noise, "must be positive, or all replicas would be the same"
        )
    when = plan(timestep, options.duration, options.steps_between_samples, options.burn_in)
    device: Any = scene.device
    device.check_run(scene, method, timestep, replicas)
    first = device.initial_state(scene, options.initial, replicas)
    task = {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(dataclasses.asdict(scene)),
        "method": method,
        "timestep": timestep,
        "duration": options.duration,
        "replicas": replicas,
        "seed": seed,
        "sample_interval": when.interval,
        "burn_in": options.burn_in,
        "trajectories": options.trajectories,
        "version": version("magmotor"),
        "initial": None if options.initial is None else checksum(first),
    }
    engine, scheme = method.split("/")
    if engine == "variational":
        advance, coefficients = kernel(scene, scheme), step_coefficients(scene, scheme, timestep)
        run = EnsembleRun(scene, task, when, first, options.checkpoint, advance, coefficients)
        return run.to_the_end(options.threads or thread_count())
    if options.threads is not None:
        sentence = "must be left out, since MuJoCo uses all processors"
        raise ArgumentError("threads", options.threads, sentence)
    samples = simulate(
        scene, method=method, timestep=timestep, seed=seed, replicas=replicas,
        duration=when.samples * when.interval * timestep, record_interval=when.interval,
        initial=options.initial, checkpoint=options.checkpoint,
    )  # fmt: skip
    run = EnsembleRun(scene, task, when, first, None, _replay(samples), lanes=COUNT)
    return run.to_the_end(thread_count())


def _replay(samples: xr.Dataset) -> Callable[..., None]:
    """Return a function with the parameters of the kernel that returns samples of `simulate`."""
    names = ("x", "theta", "v", "omega")
    columns = [samples[name].transpose("time", "replica").values for name in names]
    lanes = np.zeros((len(samples.time), 4, -(-samples.sizes["replica"] // COUNT) * COUNT))
    lanes[..., : samples.sizes["replica"]] = np.stack(columns, axis=1)
    lanes[:, 0] /= TURN

    def advance(states, recorded, first, interval, _seed, replica, *_):
        after = first // interval + 1
        columns = slice(replica, replica + states.shape[1])
        recorded[:] = lanes[after : after + len(recorded), :, columns]
        states[:] = recorded[-1]

    return advance


class EnsembleRun:
    """An ensemble in progress: `sample` samples are finished, and `arrays` hold the results."""

    def __init__(
        self,
        scene,
        task: dict[str, Any],
        when: Plan,
        first: DiskStates,
        path: str | Path | None,
        advance: Any,
        coefficients: Any = None,
        lanes: int = LANES,
    ):
        self.scene, self.task, self.when, self.first = scene, task, when, first
        self.advance, self.coefficients, self.lanes = advance, coefficients, lanes
        self.deviations, self.sigma = _deviations(scene)
        packed = pack(first)
        replicas, padded = task["replicas"], packed.shape[1]
        self.replicas, self.groups = replicas, -(-padded // lanes)
        self.start = self._states(packed)
        self.guard = scene.device.guard(scene, self.start)
        fresh: dict[str, NDArray] = {
            "states": packed,
            "moments": np.zeros((len(when.records), len(quantities(scene)), len(POWERS))),
            "paths": np.zeros((len(when.records), task["trajectories"])),
            **empty(padded, when.levels, lanes)._asdict(),
        }

        def expected(sample: int) -> dict[str, Expected]:
            within = bounds(max(0, sample - when.burn_in))
            return {k: Expected(v, *within.get(k, ())) for k, v in fresh.items()}

        self.checkpoint = Checkpoint(path, task, when.samples, expected)
        self.sample, self.arrays = self.checkpoint.load() or (0, fresh)
        self.statistics = Statistics(*[self.arrays[name] for name in Statistics._fields])

    def to_the_end(self, threads: int) -> xr.Dataset:
        """Advance to the last record, and return the dataset; see `mm.ensemble` for exceptions."""
        unit = self.when.interval * self.task["timestep"]
        bar = "{l_bar}{bar}| t = {n:.0f} of {total:.0f} [{elapsed}<{remaining}]"
        progress = Progress(
            total=self.when.samples * unit, initial=self.sample * unit, desc="ensemble",
            bar_format=bar, delay=2, disable=None,
        )  # fmt: skip
        self._compile()
        with deferred() as interrupted, ThreadPoolExecutor(threads) as pool, progress:
            self._record()
            span = 1
            while self.sample < self.when.samples and not interrupted.is_set():
                began = time.monotonic()
                stop = self._next_stop(span)
                taken = stop - self.sample
                self._advance_to(stop, pool, threads)
                self._record()
                progress.update(self.sample * unit - progress.n)
                elapsed = max(time.monotonic() - began, 1e-6)
                span = max(1, int(taken * SECONDS_BETWEEN_CHECKS / elapsed))
                if self.checkpoint.due:
                    self.checkpoint.save(self.sample, self.arrays)
            self.checkpoint.save(self.sample, self.arrays)
        if interrupted.is_set():
            raise SimulationInterrupted(self._result(), self.checkpoint.path)
        return self._result()

    def _compile(self) -> None:
        """Compile what the threads will call, while Ctrl-C ends it."""
        states, block = np.empty((4, self.lanes)), np.empty((1, 4, self.lanes))
        if self.coefficients is not None:
            self.advance.compile_for(states, block, 0, 1, 0, 0, 1, 0, self.coefficients)
        accumulate.compile_for(self.statistics, block, 0, 0, 0, 0, self.deviations, self.sigma)

    def _next_stop(self, span: int) -> int:
        """Return the next record, but at most `span` samples from here."""
        records = self.when.records
        following = int(records[np.searchsorted(records, self.sample, "right")])
        return min(following, self.sample + span)

    def _advance_to(self, stop: int, pool: ThreadPoolExecutor, threads: int) -> None:
        """Advance all groups of replicas to `stop`, on the threads of the pool."""
        waiting = iter(range(self.groups))
        lock = threading.Lock()

        def work() -> None:
            room = np.empty(BLOCK * 4 * self.lanes)
            while True:
                with lock:
                    group = next(waiting, None)
                if group is None:
                    return
                self._advance_group(group, stop, room)

        for job in [pool.submit(work) for _ in range(min(threads, self.groups))]:
            job.result()
        self.sample = stop

    def _advance_group(self, group: int, stop: int, room: NDArray) -> None:
        begin = group * self.lanes
        # Contiguous, as in `simulate`: another layout would require another compilation.
        states = self.arrays["states"][:, begin : begin + self.lanes].copy()
        lanes = min(self.lanes, self.replicas - begin)
        interval, burn_in, seed = self.when.interval, self.when.burn_in, self.task["seed"]
        sample = self.sample
        if sample == 0 and burn_in == 0:
            self._accumulate(states[np.newaxis], group, lanes, 0)
        while sample < stop:
            count = min(BLOCK, stop - sample)
            block = room[: count * states.size].reshape(count, *states.shape)
            self.advance(
                states, block, sample * interval, interval, seed, begin, 1, 0, self.coefficients
            )
            if sample + count >= burn_in:
                skipped = max(0, burn_in - sample - 1)
                self._accumulate(block[skipped:], group, lanes, sample + 1 + skipped - burn_in)
            sample += count
        self.arrays["states"][:, begin : begin + self.lanes] = states

    def _accumulate(self, block: NDArray, group: int, lanes: int, first: int) -> None:
        start = group * self.lanes
        accumulate(self.statistics, block, group, start, lanes, first, self.deviations, self.sigma)

    def _record(self) -> None:
        """Check the states, and compute their moments if this sample is a record."""
        states = self._states(self.arrays["states"])
        _, failure = self.guard.first_wrong(states)
        row = int(np.searchsorted(self.when.records, self.sample))
        if failure is not None:
            reached = self.sample * self.when.interval * self.task["timestep"]
            raise stopped(failure, reached, self._result().isel(time=slice(row)))
        if self.when.records[row] == self.sample:
            self.arrays["moments"][row] = moments(self.scene, states, self.start)
            kept = self.arrays["paths"].shape[1]
            self.arrays["paths"][row] = self.arrays["states"][0, :kept]

    def _states(self, lanes: NDArray) -> DiskStates:
        one = lanes[np.newaxis, :, : self.replicas]
        return unpack(np.zeros(1), one.copy(), self.scene.has_rotation)

    def _result(self) -> xr.Dataset:
        given = None if self.task["initial"] is None else self.first
        return result(
            self.scene, self.task, self.when, given, self.sample, self.arrays, self.deviations
        )


def _deviations(scene: Disk | LangevinParticle) -> tuple[tuple[float, float, float], float]:
    """Return standard deviations of v, omega and d where it is hottest, and sigma; else 1."""
    v, *omega = np.sqrt(hottest(scene) / np.array(scene.masses))
    if isinstance(scene, Disk):
        return (v, *omega, math.sqrt((1 + scene.sigma) * hottest(scene))), scene.sigma
    return (v, 1.0, 1.0), 1.0
