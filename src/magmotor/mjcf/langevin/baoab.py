"""The Langevin splitting BAOAB, with MuJoCo as its engine.

A step h (Leimkuhler and Matthews, 2013): B kicks with the forces for h/2, A moves freely for h/2, O
applies friction and noise for h, exactly; then A, the forces at the new place, and B with them,
which are also those of the next step's first B. It is of second order, and friction and noise have
their temperature at any step. No constraint is solved.
"""

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_floats, check_integer, check_type, reject
from magmotor.common.environment import physical_memory
from magmotor.common.hints import Count, floats, integer, several
from magmotor.mjcf import hooks
from magmotor.mjcf.langevin.loop import BY_TIME, compiled, step_coefficients
from magmotor.mjcf.langevin.model import langevin_model
from magmotor.noise import LARGEST_STEP

Array = NDArray[np.float64]

ALL_OF_STATE = 2 ** int(mujoco.mjtState.mjNSTATE) - 1
"""All bits of `mjtState`."""

FIRST_STEPS = 64
"""How many are taken before it is known how long they last."""

SECONDS_BETWEEN_LOOKS = 0.1
"""How long compiled code steps before Ctrl-C is heard, about."""


class Baoab:
    """Langevin dynamics of a model by the splitting BAOAB: second order, forces once a step.

    What acts on the model is what `magnetism` describes: dipoles, Brownian wrenches of bodies,
    periodic potentials of joints; and gravity, `xfrc_applied` and `qfrc_applied`. Friction and
    noise are solved exactly, so that their temperature does not depend on the timestep.

    Parameters
    ----------
    model : mujoco.MjModel
        It is read once, and must not be changed afterwards. Each body that moves hangs on the
        world, by slides and at most one hinge, ball or free joint at its center of mass. Friction
        is `damping` of joints and fixed tendons, or a viscous contact such as that of `build`'s
        planar scenes. A body on a ball or free joint whose moments of inertia differ may have
        damping, and three equal Brownian torques about x, y and z. The options of the integrator
        and of the solver do not matter.

    Raises
    ------
    ValueError
        Something else acts, or friction and noise are no constant linear map of the velocities.
        Names what is in the way, and what must hold.
    LayoutError
        This version of MuJoCo keeps its data in other places than it declares.

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
        """Take steps, each of the model's timestep.

        They change `qpos`, `qvel` and `time`; frames of bodies, geoms and sites follow, and
        `xfrc_applied` holds the forces at the end, but for the Brownian ones. A call runs without
        the GIL, and needs no `magnetism` block. The same steps in several calls are the same to
        the bit. Ctrl-C is heard every 0.1 s or so, between two steps.

        Parameters
        ----------
        data : mujoco.MjData
            Of this model. Its `userdata` chooses the Brownian path as in `magnetism`, and its
            `time` the step of that path.
        nstep : int
            How many, less than 2^53.

        Raises
        ------
        ValueError
            The data are another model's, the timestep was changed, or `nstep` is no such integer.
        FloatingPointError
            The state is no longer finite.
        mujoco.FatalError
            As from `magnetism`.
        """
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        left = check_integer("nstep", nstep, at_least=0)
        if left >= LARGEST_STEP:
            raise reject("nstep", nstep, f"must be less than 2^53 = {LARGEST_STEP}")
        following, count = BY_TIME, min(left, FIRST_STEPS)
        while True:
            began = time.monotonic()
            following = self._run(data, following, count, np.empty((0, 0)))
            if following == BY_TIME:
                raise FloatingPointError(
                    f"the state is not finite at t = {data.time:g}: the timestep is too long,"
                    " or dipoles came too near to each other"
                )
            left -= count
            if not left:
                return
            elapsed = max(time.monotonic() - began, 1e-6)
            count = min(left, 1 + int(count * SECONDS_BETWEEN_LOOKS / elapsed))

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
        """Run replicas, on as many threads as there are data; see `mujoco.rollout.rollout`.

        Parameters
        ----------
        data : sequence of mujoco.MjData
        initial_state : ndarray, shape (replicas, 1 + nq + nv)
            Time, `qpos` and `qvel` of each.
        control : ndarray, shape (replicas, 1, k), optional
            What else each is given, the same in all steps ...
        control_spec : int
            ... as bits of `mjtState`.
        nstep : int
            How many steps.

        Returns
        -------
        ndarray, shape (replicas, nstep, nq + nv)
            `qpos` and `qvel` after each step, NaN from where they are no longer finite.

        Raises
        ------
        ValueError
            The data are another model's, an array has another shape than this model's state, or
            there are more steps than fit in memory.
        mujoco.FatalError
            As from `magnetism`.
        """
        for used in data:
            self._check_data(used)
        width = 1 + self.model.nq + self.model.nv
        check_floats("initial_state", initial_state, "replicas", width)
        size = mujoco.mj_stateSize(self.model, control_spec)
        if control is not None:
            check_floats("control", control, "replicas", 1, size)
        room = physical_memory() / (8 * max(1, len(initial_state) * (width - 1)))
        if nstep > room:
            raise reject("nstep", nstep, f"must be at most {int(room)}, for which there is memory")
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
            raise reject("data.model", data.model, "must be the model that is stepped")

    def _run(self, data: mujoco.MjData, first: int, nstep: int, path: Array) -> int:
        """Step, recording in `path` if it has rows; `first` and what returns are as in the loop."""
        if self.model.opt.timestep != self._coefficients.timestep:
            raise reject(
                "timestep",
                self.model.opt.timestep,
                f"must be {self._coefficients.timestep:g}, as it was",
            )
        work = np.empty(3 * len(self._coefficients.kick) + self._coefficients.channels)
        with hooks.errors_raised():
            addresses = self.model._address, data._address
            return self._advance(*addresses, first, nstep, self._coefficients, path, work)
