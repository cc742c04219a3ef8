"""What the front door asks of an engine."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.noise import BrownianPath

CHUNK = 20_000
"""Steps after which an engine hands over what it has, about: some 0.1 s."""

PIECE = 2**20
"""Steps, of all replicas, after which compiled code is left so that Ctrl-C is heard, about."""

FEWEST = 64
"""Steps that compiled code takes at the least: its states then stay in the cache."""


class Job(NamedTuple):
    """A run: `records` states after the initial one, each `record_interval` steps apart.

    An engine's function `run(job)` yields them in chunks, each with an array that holds all the
    engine needs to go on from its end; `start(job)` is that array at the beginning. The first step
    is number `first_step` of the Brownian path, whose timestep is the run's. A run that goes on has
    `done` records already, and the array that came with the last of them as its `state`: what
    follows is then the same to the bit.
    """

    scene: Any
    scheme: str
    timestep: float
    records: int
    record_interval: int
    initial: Any
    path: BrownianPath
    first_step: int
    done: int = 0
    state: NDArray[np.float64] | None = None

    def chunks(self, replicas: int) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Of each chunk the first step, and the times of its records."""
        # Each of a coarse step's random numbers is a sum.
        effort = replicas * self.record_interval * (1 + self.path.factor // 64)
        size = max(1, CHUNK // effort)
        for first in range(self.done, self.records, size):
            last = min(first + size, self.records)
            yield first * self.record_interval, self.times(first, last)

    def pieces(self, step: int, records: int, replicas: int) -> Iterator[tuple[int, int]]:
        """Of each call of compiled code for a chunk its first step, and the steps to a record.

        A long way to a single record is cut; the record is then that of the last call.
        """
        piece = self.record_interval
        if records == 1:
            piece = max(FEWEST, PIECE // (replicas * (1 + self.path.factor // 64)))
        for done in range(0, self.record_interval, piece):
            first = self.first_step + step + done
            yield first, min(piece, self.record_interval - done)

    def times(self, first: int, last: int) -> NDArray[np.float64]:
        """The times of the records after number `first` up to number `last`."""
        steps = self.record_interval * np.arange(first + 1, last + 1, dtype=float)
        return self.timestep * steps


METHODS = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")

PLANAR = (*METHODS, "mujoco/baoab")
"""Of scenes without constraints but a viscous contact; the splitting BAOAB needs that."""
