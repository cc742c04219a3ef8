"""Running a scene in MuJoCo: stepping all replicas, and recording."""

from collections.abc import Generator
from contextlib import nullcontext
from copy import copy
from functools import lru_cache
from typing import Any, Protocol

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.environment import thread_count
from magmotor.device import mjcf_parts as parts
from magmotor.device.job import CHUNK, Job
from magmotor.devices.disk.mjcf import DiskMotion, compose_disk
from magmotor.devices.disk.scene import Disk
from magmotor.devices.motor.mjcf import MotorMotion, compose_motor
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.mjcf import BallMotion, compose_top
from magmotor.devices.top.scene import Top
from magmotor.mjcf import hooks as stopwatch
from magmotor.mjcf.langevin import Baoab
from magmotor.mjcf.magnetism import magnetism

Array = NDArray[np.float64]

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}


class Motion(Protocol):
    """What a run must know of a device; it is made from the job.

    Attributes
    ----------
    start : ndarray, shape (replicas, nq + nv + k)
        Joint coordinates of the initial states, and k running sums.
    driven : bool
        Whether anything acts through the compiled callback.
    control : int
        What `controls` holds, as bits of `mjtState`.
    """

    start: Array
    driven: bool
    control: int

    def controls(self, steps: NDArray[np.int64]) -> Array | None:
        """What MuJoCo is given in these steps, shape (replicas, steps or 1, n)."""
        ...

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Running sums after each step, shape (replicas, steps, k).

        `before` (replicas, nq + nv + k) is the state before step number `first` of the run,
        `paths` (replicas, steps, nq + nv) the states after it and those that follow.
        """
        ...

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> Any:
        """States from joint coordinates and sums, shape (replicas, T, nq, nv or k)."""
        ...


MOTIONS: dict[type, Any] = {Top: BallMotion, Motor: MotorMotion, Disk: DiskMotion}


def start(job: Job) -> Array:
    """The state that a run begins with; see `Job`."""
    return MOTIONS[type(job.scene)](job).start


def run(job: Job) -> Generator[tuple[Any, Array]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    model = build(job.scene)
    model.opt.timestep = job.timestep
    splitting = Baoab(model) if job.scheme == "baoab" else None
    if splitting is None:
        model.opt.integrator = INTEGRATORS[job.scheme]
    motion: Motion = MOTIONS[type(job.scene)](job)
    state = motion.start if job.state is None else job.state
    replicas = len(state)
    data = [mujoco.MjData(model) for _ in range(min(replicas, thread_count()))]
    piece = max(1, CHUNK // replicas)
    called_back = motion.driven and splitting is None
    with magnetism() if called_back else nullcontext(), stopwatch.stopped():
        for begin, times in job.chunks(replicas):
            records, end = [], begin + len(times) * job.record_interval
            for first in range(begin, end, piece):
                steps = np.arange(first, min(first + piece, end))
                paths = _advance(model, splitting, data, motion, state, steps)
                sums = motion.sums(state, paths, first)
                paths = np.concatenate([paths, sums], axis=-1)
                state = paths[:, -1].copy()
                records.append(paths[:, (steps + 1) % job.record_interval == 0])
            split = [model.nq, model.nq + model.nv]
            columns = np.split(np.concatenate(records, axis=1), split, axis=-1)
            yield motion.states(times, *columns), state


def _advance(model, splitting, data, motion: Motion, state: Array, steps) -> Array:
    """Joint coordinates after each of these steps, shape (replicas, steps, nq + nv)."""
    whole = np.empty((len(state), 1 + model.nq + model.nv))
    whole[:, 0] = steps[0] * model.opt.timestep  # the sum of timesteps would drift
    whole[:, 1:] = state[:, : model.nq + model.nv]
    controls, spec = motion.controls(steps), motion.control
    if splitting is not None:
        return splitting.rollout(data, whole, controls, control_spec=spec, nstep=len(steps))
    paths, _ = rollout(model, data, whole, controls, control_spec=spec, nstep=len(steps))
    # A warning of huge values ends a rollout, and its last state is repeated.
    paths[np.diff(paths[..., 0], axis=1, prepend=whole[:, :1]) <= 0] = np.nan
    return paths[..., 1:]


COMPOSERS = {Top: compose_top, Motor: compose_motor, Disk: compose_disk}


def compose(scene: Top | Motor | Disk, *, looks: bool) -> parts.Element:
    """The scene as a PyMJCF tree, with lights, cameras and decoration if `looks`.

    Raises
    ------
    ValueError
        There is no such scene in MuJoCo.
    """
    _check(scene)
    return COMPOSERS[type(scene)](scene, looks=looks)


@checked
def build(scene: Top | Motor | Disk, *, looks: bool = False) -> mujoco.MjModel:
    """Compile a scene.

    Parameters
    ----------
    scene : Top, Motor or Disk
        What to build. Dipoles, noise and potential act on the model inside `magnetism()`.
    looks : bool
        Add lights, cameras, materials and decoration, which cost time in every step and change
        nothing in the dynamics.

    Returns
    -------
    mujoco.MjModel
        Its keyframe 0 is the scene's initial state.

    Raises
    ------
    ValueError
        There is no such scene in MuJoCo.

    Examples
    --------
    >>> import magmotor as mm
    >>> model = mm.build(mm.Disk())
    >>> [model.joint(i).name for i in range(model.njnt)]
    ['x', 'theta']
    """
    _check(scene)
    return copy(_compiled(scene, looks))


@lru_cache(maxsize=8)
def _compiled(scene: Top | Motor | Disk, looks: bool) -> mujoco.MjModel:
    """The model of which each caller has a copy: that takes a hundredth of the time."""
    return parts.compiled(compose(scene, looks=looks))


def _check(scene: Top | Motor | Disk) -> None:
    if type(scene) not in COMPOSERS:
        raise reject("scene", scene, "a scene that MuJoCo has: Top, Motor or Disk")
