"""What `Baoab` and `Langevin` share: how their compiled loops are called."""

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Annotated, NamedTuple

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_floats, check_integer, check_type
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Count, floats, integer, several
from magmotor.mjcf.forces.magnetic_state import stack_bytes
from magmotor.noise import LARGEST_STEP

ALL_OF_STATE = 2 ** int(mujoco.mjtState.mjNSTATE) - 1
"""All bits of `mjtState`."""

FIRST_STEPS = 64
"""Number of steps taken before their duration is known."""

SECONDS_BETWEEN_CHECKS = 0.1
"""Approximate time between two checks for Ctrl-C."""

BY_TIME = -(2**63)
"""Stands for a step number to be derived from the time of `mjData`, exact up to 5e7 steps."""

LOST = mujoco.mjMAXVAL
"""Speed, 1e10, above which a state counts as lost, as MuJoCo warns of it."""


class Steps(NamedTuple):
    """Which steps the compiled loop is to take, and where it records them."""

    first: int
    """Number of the first step on the Brownian path; `BY_TIME` to derive it from the time."""
    nstep: int
    every: int = 1
    """Number of steps between two records."""
    replica: int = 0
    exchanged: Array = np.empty(0)
    """Sums of heat and work before these steps; see `Taken`."""
    records: Array = np.empty((0, 0))
    """Has no rows, or receives `qpos`, `qvel` and what else there is, every `every` steps."""


class Taken(NamedTuple):
    """What became of some steps."""

    following: int
    """Number of the next step on the Brownian path; `BY_TIME` if the state was lost."""
    exchanged: Array
    """Sums of the heat from each bath, and of the work of all forces, in J; may be empty."""


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


class Thermostat(ABC):
    """Steps and rollouts of a model by a compiled loop.

    Parameters
    ----------
    model : mujoco.MjModel
    """

    def __init__(self, model: mujoco.MjModel):
        check_type("model", model, mujoco.MjModel)
        self.model = model
        self._recorded = model.nq + model.nv
        self.timestep = model.opt.timestep

    @abstractmethod
    def _compile(self) -> None:
        """Compile the loop, before threads call it."""

    @abstractmethod
    def _run(self, data: mujoco.MjData, steps: Steps) -> Taken:
        """Take steps with the compiled loop."""

    def _steps(self, data: mujoco.MjData, nstep: int, exchanged: Array) -> Array:
        """Take steps, and return the sums of what was exchanged; see `Taken`."""
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        remaining = check_integer("nstep", nstep, at_least=0)
        if remaining >= LARGEST_STEP:
            raise ArgumentError("nstep", nstep, f"must be less than 2^53 = {LARGEST_STEP}")
        following = BY_TIME
        for _, count in pieces(remaining):
            steps = Steps(following, count, exchanged=exchanged)
            following, exchanged = self._run(data, steps)
            if following == BY_TIME or not np.isfinite(exchanged).all():
                raise FloatingPointError(
                    f"the state was lost at t = {data.time:g}: the timestep is too long,"
                    " or dipoles came too close to each other"
                )
        return exchanged

    @checked(finite=False)
    def rollout(
        self,
        data: Annotated[Sequence[mujoco.MjData], several(mujoco.MjData)],
        initial_state: Annotated[Array, floats("replicas", "1 + nq + nv")],
        control: Annotated[Array, floats("replicas", 1, "k")] | None,
        *,
        control_spec: Annotated[int, integer(at_least=0, at_most=ALL_OF_STATE)],
        nstep: Count,
    ) -> Array:
        """Run replicas in parallel, as `mujoco.rollout.rollout` does.

        Parameters
        ----------
        data : sequence of mujoco.MjData
            Data of this model, one for each thread.
        initial_state : ndarray, shape (replicas, 1 + nq + nv)
            `time`, `qpos` and `qvel` of each replica.
        control : ndarray, shape (replicas, 1, k), optional
            Further elements of each replica's state, constant during the run.
        control_spec : int
            The elements in `control`, as bits of `mjtState`.
        nstep : int
            Number of steps.

        Returns
        -------
        ndarray, shape (replicas, nstep, nq + nv)
            `qpos` and `qvel` after each step; NaN once the state is lost.

        Raises
        ------
        ValueError
            The data belong to another model, the shape of an array does not match the model, or
            the result does not fit in memory.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        for used in data:
            self._check_data(used)
        if len({id(used) for used in data}) < len(data):
            raise ArgumentError(
                "data", data, "must not contain one mjData twice: each is for one thread"
            )
        width = 1 + self.model.nq + self.model.nv
        check_floats("initial_state", initial_state, "replicas", width)
        size = mujoco.mj_stateSize(self.model, control_spec)
        if control is not None:
            check_floats("control", control, "replicas", 1, size)
        room = physical_memory() / (8 * max(1, len(initial_state) * self._recorded))
        if nstep > room:
            raise ArgumentError("nstep", nstep, f"must be at most {int(room)} to fit in memory")
        start = np.split(initial_state, [1, 1 + self.model.nq], axis=1)
        paths = np.empty((len(initial_state), nstep, self._recorded))

        def follow(thread: int, stop: threading.Event) -> None:
            used = data[thread]
            for replica in range(thread, len(paths), len(data)):
                (used.time,), used.qpos[:], used.qvel[:] = (part[replica] for part in start)
                used.qacc_warmstart[:] = 0
                if control is not None:
                    mujoco.mj_setState(self.model, used, control[replica, 0], control_spec)
                following = BY_TIME
                for done, count in pieces(nstep, stop=stop):
                    records = paths[replica, done : done + count]
                    records[:] = np.nan
                    steps = Steps(following, count, replica=replica, records=records)
                    following = self._run(used, steps).following
                    if following == BY_TIME:
                        paths[replica, done + count :] = np.nan
                        break

        self._compile()
        on_threads(follow, len(data), len(data))
        return paths

    def _check_data(self, data: mujoco.MjData) -> None:
        if data.model is not self.model:
            name = type(self).__name__
            raise ArgumentError("data.model", data.model, f"must be the model of this {name}")

    def _check_run(self, data: mujoco.MjData) -> None:
        """Check that the timestep is the same still, and that there is memory for the dipoles."""
        if self.model.opt.timestep != self.timestep:
            raise ArgumentError(
                "timestep",
                self.model.opt.timestep,
                f"must still be {self.timestep:g}, since {type(self).__name__} reads it only once",
            )
        needed = stack_bytes(self.model)
        if needed > data.narena - data.parena - data.pstack:
            raise mujoco.FatalError(
                f"the dipoles need {needed} bytes of MuJoCo's memory, which is too small: increase"
                " <size memory>"
            )
