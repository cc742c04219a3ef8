"""Paths of a model: its states from one start, by any integrator of MuJoCo and any timestep."""

import copy
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np

from magmotor.advice.silence import quiet
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.forces.brownian_wrenches import FACTOR, LEVEL, PATH_NUMBERS
from magmotor.mjcf.lookup import INTEGRATORS

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
"""What a path starts from."""

RECORD = mujoco.mjtState.mjSTATE_FULLPHYSICS
"""What is recorded of it."""

LARGE = 1e10
"""Positions and velocities of this size have diverged, as MuJoCo itself has it."""

_BAD = slice(mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQACC + 1)
"""Warnings of MuJoCo about positions, velocities or accelerations that are not finite."""

REPLICA, FIRST_STEP = 1, 4
"""Elements of `userdata` that select a Brownian path, besides its factor and level."""

_SLICE = 0.05
"""Longest time in s between two looks at the clock, approximately."""


def has_noise(model: mujoco.MjModel) -> bool:
    """Whether a model declares Brownian wrenches that act."""
    # Most models have no such numbers, and need no compiled code to tell.
    return bool(model.body_user.any()) and acting_forces(model) & NOISE > 0


class OutOfTime(Exception):
    """The time that a measurement may take is over."""


@dataclass(frozen=True)
class Path:
    """How one run went."""

    integrator: str
    timestep: float
    diverged: float | None
    """Time in s at which the run was no longer finite."""
    seconds: float
    """Wall time per step."""


class Runs:
    """Runs of a model from one start.

    Parameters
    ----------
    model : mujoco.MjModel
        It is copied, and not changed.
    data : mujoco.MjData, optional
        The start, with its controls and applied forces; by default the initial state.

    Attributes
    ----------
    noisy : bool
        Whether Brownian wrenches act; then all runs follow one Brownian path.

    Raises
    ------
    ValueError
        The data belong to another model, its timestep is not positive, or Brownian wrenches act,
        and `mjData.userdata` has no room to choose their path.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData | None = None):
        self.timestep = check_number("timestep of the model", model.opt.timestep, above=0)
        if data is not None and _sizes(data) != _sizes(mujoco.MjData(model)):
            raise ArgumentError("data", "MjData", "must belong to the model")
        self.model = copy.copy(model)
        self.integrator = next(
            name for name, kind in INTEGRATORS.items() if kind == model.opt.integrator
        )
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.data = mujoco.MjData(self.model)
        self.noisy = has_noise(model)
        if self.noisy and model.nuserdata < PATH_NUMBERS:
            bound = f"must be at least {PATH_NUMBERS}, to follow one Brownian path at all timesteps"
            raise ArgumentError("nuserdata of the model", model.nuserdata, bound)
        self._bad = self.data.warning.number[_BAD]
        self.start = np.empty(mujoco.mj_stateSize(model, STATE))
        source = mujoco.MjData(model) if data is None else data
        mujoco.mj_getState(model, source, self.start, STATE)
        self.began = float(source.time)
        self._size = mujoco.mj_stateSize(model, RECORD)

    def without_noise(self) -> "Runs":
        """Return runs of the same model without Brownian wrenches."""
        if not self.noisy:
            return self
        self.prepare(self.integrator, self.timestep)
        model = copy.copy(self.model)
        model.body_user[:] = 0.0
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, self.start, STATE)
        return Runs(model, data)

    def path(
        self,
        integrator: str,
        timestep: float,
        every: int,
        records: int,
        *,
        start: Array | None = None,
        until: float = np.inf,
    ) -> tuple[Path, Array]:
        """Run a path, and return it with its states, shape (records + 1, state).

        It ends early if it diverges. The first state is the start.

        Raises
        ------
        OutOfTime
            The clock `time.perf_counter` has passed `until`.
        """
        self.prepare(integrator, timestep, start)
        model, data = self.model, self.data
        states = np.empty((records + 1, self._size))
        mujoco.mj_getState(model, data, states[0], RECORD)
        began, diverged, n = time.perf_counter(), None, 0
        piece = every
        with quiet():
            for n in range(1, records + 1):
                left = every
                while left:
                    piece = min(piece, left)
                    now = time.perf_counter()
                    if now > until:
                        raise OutOfTime
                    if not self.advance(piece):
                        diverged = (n - left / every) * every * timestep
                        break
                    left -= piece
                    took = time.perf_counter() - now
                    piece = max(1, int(piece * min(2.0, _SLICE / max(took, 1e-9))))
                if diverged is not None:
                    break
                mujoco.mj_getState(model, data, states[n], RECORD)
            if diverged is None and not _largest(states[n]) < LARGE:  # as with NaN
                diverged = n * every * timestep
        kept = n if diverged is not None else n + 1
        taken = max(1.0, (diverged or n * every * timestep) / timestep)
        seconds = (time.perf_counter() - began) / taken
        return Path(integrator, timestep, diverged, seconds), states[:kept]

    def recorded_start(self) -> Array:
        """Return the start as a record."""
        self.prepare(self.integrator, self.timestep)
        state = np.empty(self._size)
        mujoco.mj_getState(self.model, self.data, state, RECORD)
        return state

    def workspace(self) -> mujoco.MjData:
        """Return other data at the start, with its controls and applied forces."""
        data = mujoco.MjData(self.model)
        mujoco.mj_setState(self.model, data, self.start, STATE)
        return data

    def prepare(self, integrator: str, timestep: float, start: Array | None = None) -> None:
        """Set the model's integrator and timestep, and the data to a start."""
        self.model.opt.integrator = INTEGRATORS[integrator]
        self.model.opt.timestep = timestep
        mujoco.mj_resetData(self.model, self.data)
        begin = self.start if start is None else start
        mujoco.mj_setState(self.model, self.data, begin, STATE)
        if self.noisy:
            steps, parts = (timestep / self.timestep).as_integer_ratio()
            self.data.userdata[FACTOR : LEVEL + 1] = steps, parts.bit_length() - 1
            self.data.userdata[FIRST_STEP] = 0

    def perturbed(self, size: float, seed: int) -> Array:
        """Return the start with other velocities, in part of the fastest one or of 1.

        The seed is also the replica of the noise.
        """
        self.prepare(self.integrator, self.timestep)
        data = self.data
        scale = size * (_largest(data.qvel) or 1.0)
        data.qvel += scale * np.random.default_rng(seed).standard_normal(self.model.nv)
        if self.noisy:
            data.userdata[REPLICA] = seed
        start = np.empty_like(self.start)
        mujoco.mj_getState(self.model, data, start, STATE)
        return start

    def advance(self, steps: int) -> bool:
        """Advance the data, and return whether each step began with numbers and defined forces."""
        try:
            mujoco.mj_step(self.model, self.data, nstep=steps)
        except mujoco.FatalError:
            return False
        return not self._bad.any()

    def tighter(self) -> list[dict[str, float]]:
        """Return settings of the solver, from the model's own to converged ones."""
        option = self.model.opt
        found: list[dict[str, float]] = [{}]
        for times, tolerance in ((4, 1e-10), (16, 1e-12), (64, 1e-15)):
            found.append({
                "iterations": times * option.iterations,
                "ls_iterations": max(100, option.ls_iterations),
                "tolerance": min(tolerance, option.tolerance),
                "ls_tolerance": min(1e-3, option.ls_tolerance),
            })  # fmt: skip
        return found

    @contextmanager
    def solver(self, settings: Mapping[str, float]) -> Iterator[None]:
        """Set options of the model by their names in MJCF, and then restore them."""
        option = self.model.opt
        before = {name: getattr(option, name) for name in settings}
        try:
            for name, value in settings.items():
                setattr(option, name, value)
            yield
        finally:
            for name, value in before.items():
                setattr(option, name, value)

    def kinetic_energy(self) -> float:
        """Return the kinetic energy of the data in J."""
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy[1])

    def places(self, integrator: str, timestep: float, duration: float, count: int) -> list[Array]:
        """Return states at equal times along a path, from which runs can start."""
        self.prepare(integrator, timestep)
        steps, found = max(1, round(duration / timestep / count)), []
        with quiet():
            for _ in range(count):
                found.append(np.empty_like(self.start))
                mujoco.mj_getState(self.model, self.data, found[-1], STATE)
                if not self.advance(steps):
                    break
        return found

    def timed(
        self, integrator: str, timestep: float, steps: int, start: Array | None = None
    ) -> float:
        """Return the wall time per step of one run, without records."""
        self.prepare(integrator, timestep, start)
        with quiet():
            self.advance(1)
            began = time.perf_counter()
            self.advance(steps)
            return (time.perf_counter() - began) / steps


def _sizes(data: mujoco.MjData) -> tuple[int, ...]:
    arrays = data.qpos, data.qvel, data.act, data.ctrl, data.xpos, data.mocap_pos, data.userdata
    return (*(array.size for array in arrays), data.geom_xpos.size, data.sensordata.size)


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))
