"""Runs in MuJoCo: stepping all replicas and recording their states."""

from collections.abc import Generator
from contextlib import nullcontext
from copy import copy
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import rollout

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.environment import thread_count
from magmotor.device.device import Scene
from magmotor.device.engine import MujocoAdapter
from magmotor.device.job import CHUNK, Job
from magmotor.mjcf import model_parts
from magmotor.mjcf.error_raising import raise_recorded, silence
from magmotor.mjcf.hooks import without_stopwatch
from magmotor.mjcf.langevin.langevin import Langevin, record_exchange
from magmotor.mjcf.magnetism import magnetism
from magmotor.mjcf.notice_sentences import OF_RUNS

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}


def start(job: Job) -> Array:
    """Return the initial state of a run; see `Job`."""
    return job.scene.device.mujoco(job).start


def run(job: Job) -> Generator[tuple[Any, Array]]:
    """Yield the recorded states after the initial one, in chunks; see `Job`."""
    model = build(job.scene)
    model.opt.timestep = job.timestep
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # it would hide divergence
    splitting = Langevin(model) if job.scheme == "baoab" else None
    if splitting is None:
        model.opt.integrator = INTEGRATORS[job.scheme]
    else:
        record_exchange(splitting)
    motion = job.scene.device.mujoco(job)
    state = motion.start if job.state is None else job.state
    replicas = len(state)
    data = [mujoco.MjData(model) for _ in range(min(replicas, thread_count()))]
    piece = max(1, CHUNK // replicas)
    called_back = motion.driven and splitting is None
    with magnetism() if called_back else nullcontext(), without_stopwatch():
        silence(OF_RUNS)  # the guard judges
        for begin, times in job.chunks(replicas):
            records, end = [], begin + len(times) * job.record_interval
            for first in range(begin, end, piece):
                steps = np.arange(first, min(first + piece, end))
                paths = _advance(model, splitting, data, motion, state, steps)
                sums = motion.sums(state, paths, first)
                paths = np.concatenate([paths[..., : model.nq + model.nv], sums], axis=-1)
                state = paths[:, -1].copy()
                records.append(paths[:, (steps + 1) % job.record_interval == 0])
            split = [model.nq, model.nq + model.nv]
            columns = np.split(np.concatenate(records, axis=1), split, axis=-1)
            yield motion.states(times, *columns), state


def _advance(model, splitting, data, motion: MujocoAdapter, state: Array, steps) -> Array:
    """Return qpos and qvel after each of these steps; see `MujocoAdapter.sums`."""
    whole = np.empty((len(state), 1 + model.nq + model.nv))
    whole[:, 0] = steps[0] * model.opt.timestep  # the sum of timesteps would drift
    whole[:, 1:] = state[:, : model.nq + model.nv]
    controls, spec = motion.controls(steps), motion.control
    if splitting is not None:
        return splitting.rollout(data, whole, controls, control_spec=spec, nstep=len(steps))
    paths, _ = rollout(model, data, whole, controls, control_spec=spec, nstep=len(steps))
    raise_recorded()
    # After a warning about huge values, a rollout repeats its last state.
    paths[np.diff(paths[..., 0], axis=1, prepend=whole[:, :1]) <= 0] = np.nan
    return paths[..., 1:]


def compose(scene: Scene, *, visual: bool) -> model_parts.Element:
    """Return the scene as a PyMJCF tree, with lights, cameras and decoration if `visual`.

    Raises
    ------
    ValueError
        MuJoCo cannot represent this scene.
    """
    return scene.device.compose(scene, visual=visual)


@checked
def build(scene: Scene, *, visual: bool = False) -> mujoco.MjModel:
    """Compile a scene.

    Parameters
    ----------
    scene : Top, Motor or Disk
        Its dipoles, noise and potential act on the model inside `magnetism()`.
    visual : bool
        Add lights, cameras, materials and decoration. They slow down every step and do not affect
        the dynamics.

    Returns
    -------
    mujoco.MjModel
        Its keyframe 0 is the scene's initial state.

    Raises
    ------
    ValueError
        MuJoCo cannot represent this scene, or rejects its numbers.

    Examples
    --------
    >>> import magmotor as mm
    >>> model = mm.build(mm.Disk())
    >>> [model.joint(i).name for i in range(model.njnt)]
    ['x', 'theta']
    """
    return copy(_compiled(scene, visual))


@lru_cache(maxsize=8)
def _compiled(scene: Scene, visual: bool) -> mujoco.MjModel:
    """Compile a scene once; callers copy the model, which takes a hundredth of the time."""
    return model_parts.compiled(compose(scene, visual=visual))
