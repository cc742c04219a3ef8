"""What computes runs: integrators, differential equations, and adapters of models in MuJoCo."""

from collections.abc import Callable, Generator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.job import Job


class Engine(Protocol):
    """An integrator of a device: an object, or a module with these two functions."""

    def start(self, job: Job) -> Array:
        """Return the engine's internal state at the beginning of a run, as one array.

        Checkpoints accept only arrays of the same shape and type.
        """
        ...

    def run(self, job: Job) -> Generator[tuple[Any, Array]]:
        """Yield the recorded states after the initial one in chunks, each with the internal state.

        Start from `job.state` if it is not None, else from the initial state; see `Job`.
        """
        ...


class Equation(Protocol):
    """The ordinary differential equation of a device without noise, for SciPy's solver."""

    def problem(self, scene: Any, initial: Any) -> tuple[Callable, Array, Array]:
        """Return the right-hand side f(t, y), the initial y, and the natural scale of each y_i."""
        ...

    def states(self, scene: Any, time: Array, rows: Array) -> Any:
        """Return the device's states at these times from the solution, shape (T, len(y))."""
        ...


class MujocoAdapter(Protocol):
    """Translation between a device's states and MuJoCo's; `Device.mujoco` makes one per run.

    Attributes
    ----------
    start : ndarray, shape (replicas, nq + nv + k)
        `qpos` and `qvel` of the initial states, then the k running sums, which start at zero.
    driven : bool
        Whether forces of the compiled callback (dipoles, noise or a potential) act on the model.
    control : int
        Contents of `controls`, as bits of `mjtState`.
    """

    start: Array
    driven: bool
    control: int

    def controls(self, steps: NDArray[np.int64]) -> Array | None:
        """Return the control inputs of these steps, shape (replicas, steps or 1, n), or None.

        Called before each batch of steps; a single row is used in all of its steps.
        """
        ...

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Return the running sums (heat, work) after each step, shape (replicas, steps, k).

        Called after each batch of steps. `before` (replicas, nq + nv + k) is the state before the
        batch, whose first step is number `first` of the run; `paths` (replicas, steps, nq + nv)
        holds the states after each step. With the scheme `baoab`, they are followed by `qpos` in
        the middle of the step, where friction and noise act, and `qvel` before and after these.
        Without sums, return ``paths[..., :0]``.
        """
        ...

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> Any:
        """Return the device's states at these times; the arrays' shape is (replicas, T, n)."""
        ...
