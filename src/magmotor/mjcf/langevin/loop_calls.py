"""How the compiled loop is called: in pieces, between which Ctrl-C acts, and on threads."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.noise import LARGEST_STEP

FIRST_STEPS = 64
"""Number of steps taken before their duration is known."""

SECONDS_BETWEEN_CHECKS = 0.1
"""Approximate time between two checks for Ctrl-C."""

BY_TIME = -(2**63)
"""Stands for a step number to be derived from the time of `mjData`, exact up to 5e7 steps."""

LOST = mujoco.mjMAXVAL
"""Speed, 1e10, above which a state counts as lost, as MuJoCo warns of it."""


def check_time(data: mujoco.MjData, timestep: float) -> None:
    """Raise an `ArgumentError` if the time of `data` has no step number."""
    if not abs(data.time / timestep) < LARGEST_STEP:
        sentence = "must be finite and between -2^53 and 2^53 timesteps"
        raise ArgumentError("data.time", data.time, sentence)


class Steps(NamedTuple):
    """Which steps the compiled loop is to take, and where it records them."""

    first: int
    """Number of the first step on the Brownian path; `BY_TIME` to derive it from the time."""
    nstep: int
    every: int = 1
    """Number of steps between two records."""
    replica: int = 0
    exchanged: Array | float = 0.0
    """Sums of heat and work before these steps; see `Taken`."""
    records: Array = np.empty((0, 0))
    """Has no rows, or receives `qpos`, `qvel` and what else there is, every `every` steps."""


class Taken(NamedTuple):
    """What became of some steps."""

    following: int
    """Number of the next step on the Brownian path; `BY_TIME` if the state was lost."""
    exchanged: Array
    """Sums of the heat from each bath, and of the work of all forces, in J."""


def pieces(
    count: int, every: int = 1, stop: threading.Event | None = None
) -> Iterator[tuple[int, int]]:
    """Divide steps among calls of about 0.1 s, the first of which may have none.

    Yields
    ------
    tuple of int
        How many steps are done, and how many are next. The latter are a multiple of `every`, or at
        most those up to the next record.
    """
    done, size = 0, FIRST_STEPS
    while True:
        start = time.monotonic()
        size = min(size, count - done)
        left = min(size, every - done % every)
        size = left if left < every else size - size % every
        yield done, size
        done += size
        if done >= count or (stop is not None and stop.is_set()):
            return
        elapsed = max(time.monotonic() - start, 1e-6)
        size = 1 + int(size * SECONDS_BETWEEN_CHECKS / elapsed)


def on_threads(follow: Callable[[int, threading.Event], None], count: int, threads: int) -> None:
    """Call `follow` for all numbers below `count`, and make it stop at an error or Ctrl-C."""
    stop = threading.Event()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for future in as_completed([pool.submit(follow, i, stop) for i in range(count)]):
                future.result()
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
