"""The Langevin splitting BAOAB for MuJoCo models (Leimkuhler and Matthews, 2013).

A step h consists of B, a kick by the forces for h/2; A, free motion for h/2; O, exact integration
of damping and noise for h; A again; and B with the forces at the new configuration, which also
serve the first B of the next step. The method is of second order, and damping and noise have the
exact temperature for any h. No constraints are solved.
"""

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_floats, check_integer, check_type, reject
from magmotor.common.environment import physical_memory
from magmotor.common.hints import Count, floats, integer, several
from magmotor.mjcf import hooks
from magmotor.mjcf.forces.dipole_wrenches import stack_bytes
from magmotor.mjcf.langevin.coefficients import step_coefficients
from magmotor.mjcf.langevin.compiled_loop import BY_TIME, compiled
from magmotor.mjcf.langevin.model import langevin_model
from magmotor.noise import LARGEST_STEP

ALL_OF_STATE = 2 ** int(mujoco.mjtState.mjNSTATE) - 1
"""All bits of `mjtState`."""

FIRST_STEPS = 64
"""Number of steps taken before their duration is known."""

SECONDS_BETWEEN_CHECKS = 0.1
"""Approximate time between two checks for Ctrl-C."""


class Baoab:
    """Langevin dynamics of a MuJoCo model by the BAOAB splitting.

    The method is of second order and evaluates forces once per step. The forces are those that
    `magnetism` describes (dipoles, Brownian wrenches of bodies, periodic potentials of joints),
    gravity, `xfrc_applied` and `qfrc_applied`. Damping and noise are integrated exactly, so that
    their temperature does not depend on the timestep.

    Parameters
    ----------
    model : mujoco.MjModel
        Read once; do not change it afterwards. The parent of each moving body must be the world or
        a body fixed to it. Its joints must be slides followed by at most one hinge, ball or free
        joint at the center of mass. Damping is `damping` of joints and fixed tendons, or a viscous
        contact like that of the planar scenes of `build`. A body with a ball or free joint and
        unequal moments of inertia may have damping, and three equal Brownian torques about x, y
        and z. The options of the integrator and of the solver have no effect.

    Raises
    ------
    ValueError
        The model has other forces or constraints, or damping and noise are not constant linear
        maps of the velocities. The message names the element and the requirement.
    LayoutError
        This version of MuJoCo lays out its structs differently than it declares.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mm.build(mm.Motor())
    >>> data = mujoco.MjData(model)
    >>> langevin = mm.Baoab(model)
    >>> langevin.step(data, nstep=1000)
    >>> print(f"{data.time / model.opt.timestep:.0f}")
    1000
    """

    def __init__(self, model: mujoco.MjModel):
        check_type("model", model, mujoco.MjModel)
        self.model = model
        self._coefficients = step_coefficients(langevin_model(model), model.opt.timestep)
        self._advance = compiled()

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance the state by steps of the model's timestep.

        This changes `qpos`, `qvel`, `time`, the frames of bodies, geoms and sites, and
        `xfrc_applied`, which then contains the final forces of the dipoles. It runs
        without the GIL and needs no `magnetism` block. The result has the same bits if the steps
        are divided among several calls. Ctrl-C is checked about every 0.1 s, between two steps.

        Parameters
        ----------
        data : mujoco.MjData
            Data of this model. `userdata` selects the Brownian path, as in `magnetism`, and `time`
            the step of that path.
        nstep : int
            Number of steps, less than 2^53.

        Raises
        ------
        ValueError
            The data belong to another model, the timestep was changed, or `nstep` is invalid.
        FloatingPointError
            The state is no longer finite.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        remaining = check_integer("nstep", nstep, at_least=0)
        if remaining >= LARGEST_STEP:
            raise reject("nstep", nstep, f"must be less than 2^53 = {LARGEST_STEP}")
        following, count = BY_TIME, min(remaining, FIRST_STEPS)
        while True:
            start = time.monotonic()
            following = self._run(data, following, count, np.empty((0, 0)))
            if following == BY_TIME:
                raise FloatingPointError(
                    f"the state is not finite at t = {data.time:g}: the timestep is too long,"
                    " or dipoles came too close to each other"
                )
            remaining -= count
            if not remaining:
                return
            elapsed = max(time.monotonic() - start, 1e-6)
            count = min(remaining, 1 + int(count * SECONDS_BETWEEN_CHECKS / elapsed))

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
            `qpos` and `qvel` after each step; NaN once they are no longer finite.

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
            raise reject("data", data, "must not contain one mjData twice: each is for one thread")
        width = 1 + self.model.nq + self.model.nv
        check_floats("initial_state", initial_state, "replicas", width)
        size = mujoco.mj_stateSize(self.model, control_spec)
        if control is not None:
            check_floats("control", control, "replicas", 1, size)
        room = physical_memory() / (8 * max(1, len(initial_state) * (width - 1)))
        if nstep > room:
            raise reject("nstep", nstep, f"must be at most {int(room)} to fit in memory")
        start = np.split(initial_state, [1, 1 + self.model.nq], axis=1)
        paths = np.full((len(initial_state), nstep, initial_state.shape[1] - 1), np.nan)

        def follow(thread: int) -> None:
            used = data[thread]
            for replica in range(thread, len(paths), len(data)):
                (used.time,), used.qpos[:], used.qvel[:] = (part[replica] for part in start)
                if control is not None:
                    mujoco.mj_setState(self.model, used, control[replica, 0], control_spec)
                self._run(used, BY_TIME, nstep, paths[replica])

        with ThreadPoolExecutor(len(data)) as pool:
            list(pool.map(follow, range(len(data))))
        return paths

    def _check_data(self, data: mujoco.MjData) -> None:
        if data.model is not self.model:
            raise reject("data.model", data.model, "must be the model of this Baoab")

    def _run(self, data: mujoco.MjData, first: int, nstep: int, path: Array) -> int:
        """Call the compiled loop; see `advance` in `magmotor.mjcf.langevin.compiled_loop`."""
        if self.model.opt.timestep != self._coefficients.timestep:
            raise reject(
                "timestep",
                self.model.opt.timestep,
                f"must still be {self._coefficients.timestep:g}, since Baoab reads it only once",
            )
        needed = stack_bytes(self.model.nsite, self.model.ntuple) if self.model.nuser_site else 0
        if needed > data.narena - data.parena - data.pstack:
            raise mujoco.FatalError(
                f"the dipoles need {needed} bytes of MuJoCo's memory, which is too small: increase"
                " <size memory>"
            )
        work = np.empty(3 * len(self._coefficients.kick) + self._coefficients.channels)
        with hooks.errors_raised():
            addresses = self.model._address, data._address
            return self._advance(*addresses, first, nstep, self._coefficients, path, work)
