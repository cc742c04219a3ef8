"""The descriptions of a run that `simulate` gives to an engine, and `ensemble` to a device."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.noise import BrownianPath

CHUNK = 20_000
"""Approximate number of steps in a chunk of records; it takes about 0.1 s."""

PIECE = 2**20
"""Approximate number of steps, of all replicas, in a call of compiled code: Ctrl-C waits for it."""

FEWEST = 64
"""Least number of steps in a call of compiled code, so that the states stay in the cache."""


class Job(NamedTuple):
    """A run: `records` states after the initial one, each `record_interval` steps apart.

    An engine's function `run(job)` yields the states in chunks, each with the engine's internal
    state at the end of the chunk: an array from which the run can continue. `start(job)` returns
    this array for the beginning. A run that continues from a checkpoint has `done` > 0, and must
    then yield the remaining records bit for bit as an uninterrupted run would.
    """

    scene: Any
    scheme: str
    """Second half of the method's name: `baoab` for `variational/baoab`."""
    timestep: float
    records: int
    record_interval: int
    initial: Any
    """The device's states, as one row; from `Device.initial_state`."""
    path: BrownianPath
    """The noise; its timestep is the run's."""
    first_step: int
    """Number of the run's first step on the Brownian path."""
    done: int = 0
    """Number of records that exist already, from a checkpoint."""
    state: NDArray[np.float64] | None = None
    """The internal state after record number `done`; None at the beginning."""

    def chunks(self, replicas: int) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Yield, for each remaining chunk, its first step and the times of its records.

        Steps count from the beginning of the run.
        """
        # Each random number of a coarse step is a sum.
        effort = replicas * self.record_interval * (1 + self.path.factor // 64)
        size = max(1, CHUNK // effort)
        for first in range(self.done, self.records, size):
            last = min(first + size, self.records)
            yield first * self.record_interval, self.times(first, last)

    def pieces(self, step: int, records: int, replicas: int) -> Iterator[tuple[int, int]]:
        """Yield, for each call of compiled code in a chunk, its first step and steps per record.

        A long interval before a single record is divided; the last call then makes the record. The
        first step is counted on the Brownian path.
        """
        piece = self.record_interval
        if records == 1:
            piece = max(FEWEST, PIECE // (replicas * (1 + self.path.factor // 64)))
        for done in range(0, self.record_interval, piece):
            first = self.first_step + step + done
            yield first, min(piece, self.record_interval - done)

    def times(self, first: int, last: int) -> NDArray[np.float64]:
        """Return the times of records `first + 1` to `last`."""
        steps = self.record_interval * np.arange(first + 1, last + 1, dtype=float)
        return self.timestep * steps


class EnsembleOptions(NamedTuple):
    """The arguments of `mm.ensemble`, which documents and checks them."""

    method: str
    timestep: float
    duration: float
    replicas: int
    seed: int
    sample_interval: int | None
    burn_in: float
    initial: Mapping[str, ArrayLike] | None
    trajectories: int
    threads: int | None
    checkpoint: str | Path | None

    @property
    def steps_between_samples(self) -> int:
        """The sample interval; by default, the number of steps in one unit of time."""
        if self.sample_interval is None:
            return max(1, round(1 / self.timestep))
        return self.sample_interval


METHODS = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")

PLANAR = (*METHODS, "mujoco/baoab")
"""For scenes without any constraint except a viscous contact, which BAOAB requires."""
