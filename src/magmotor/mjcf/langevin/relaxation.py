"""How long a run remembers the state from which it starts, by small motions about there."""

import math
from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.baths import LARGEST_MATRIX
from magmotor.mjcf.langevin.friction import Friction, friction_matrix, inertia_matrix
from magmotor.mjcf.langevin.linear_limit import crank_nicolson, stiffness_matrix
from magmotor.mjcf.lookup import label
from magmotor.numerics.linear_stability import SmallMotion, splitting_step
from magmotor.numerics.splittings import Scheme

TOLERATED, INTOLERABLE, FORGOTTEN = 0.01, 0.1, 0.01
"""Mean parts of the initial energy in the records: up to the first one, the relative error that our
documents state of temperatures, there is no warning, and above the second one, there always is.
Between them, there is one if the part exceeds the standard error of this energy in the sample. The
third one is left after the proposed number of steps. A start that is hotter than kT counts as many
times as it is hotter.
"""

LINEAR = 2.0
"""Ratio of a force to that of small motions up to which these describe a thermal displacement."""

LEAST = 1e-300
"""Part that counts instead of 0, whose logarithm is infinite."""

DOUBLINGS = 50
"""Number of times that a number of steps is doubled before nothing is forgotten."""


class Sampling(NamedTuple):
    """How much of a motion is recorded, in steps."""

    burn_in: int
    """Before the records."""
    interval: int
    """From one record to the next."""
    records: int
    replicas: int

    @property
    def nstep(self) -> int:
        """Number of steps with the records."""
        return self.interval * self.records


@np.errstate(all="ignore")
def unsettled(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    friction: Friction,
    scheme: Scheme,
    forces: Callable[[mujoco.MjData], Array] | None,
    kT: float,
    sampling: Sampling,
) -> str:
    """Return a warning if the records remember the initial state, else "".

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        The start; it may be changed.
    friction : Friction
    scheme : Scheme
    forces : callable, optional
        Returns the generalized forces (nv,) at the position of an mjData. Without them, or of more
        than `LARGEST_MATRIX` velocities, only the friction of velocities counts, and what it does
        not damp at all is left out.
    kT : float
        In J; it decides which positions have an equilibrium nearby and so are judged, too.
    sampling : Sampling
    """
    mujoco.mj_fwdPosition(model, data)
    inertia, damping = inertia_matrix(model, data), friction_matrix(model, data, friction)
    if model.nv > LARGEST_MATRIX:  # the slowest rate is at most that of any direction
        slowest = (damping.diagonal() / inertia.diagonal()).argmin()
        basis = np.eye(model.nv)[:, [slowest]] / math.sqrt(inertia[slowest, slowest])
        rates, forces = (basis.T @ damping @ basis).diagonal(), None
    else:
        try:
            rates, basis = eigh(damping, inertia)
        except np.linalg.LinAlgError:  # joints that move nearly the same
            return ""
    n, timestep = len(rates), model.opt.timestep
    parts = scheme.parts.replace("S", "R")
    step = splitting_step(parts, scheme.fractions, exact=True, response=crank_nicolson)
    motion = SmallMotion(np.zeros((n, n)), np.diag(np.maximum(rates, 0.0)), np.zeros((n, n)))
    start = np.eye(2 * n)[:, n:]
    kept = np.abs(np.diag(step(motion, timestep)[n:, n:]))
    loss, shape = -2 * math.log(max(kept.max(), LEAST)), np.eye(n)[kept.argmax()]
    hot = _times_hotter(model, data, inertia, kT)
    if forces is not None:
        try:
            stiffness = basis.T @ stiffness_matrix(model, data, forces) @ basis
            values, modes = np.linalg.eigh((stiffness + stiffness.T) / 2)
            held = _held(model, data, forces, basis @ modes, values, kT)
        except (ValueError, mujoco.FatalError):  # which the run meets, too
            return ""
        # The energy of an oscillation is lost half as fast.
        if not held.any() and not _too_much(loss / 2, hot, sampling):
            return ""
        motion = motion._replace(stiffness=modes * np.maximum(values, 0.0) @ modes.T)
        start = block_diag(modes[:, held] / np.sqrt(values[held]), np.eye(n))
        loss, shape = _slowest(step(motion, timestep), motion.stiffness, start)
    left = _too_much(loss, hot, sampling)
    if not left or (forces is None and loss == 0.0):
        return ""
    position, velocity = np.split(start @ shape, 2)
    places = position @ motion.stiffness @ position > velocity @ velocity
    shape = position if places else velocity
    shape = shape / np.linalg.norm(shape)
    moved, rate = basis @ shape, float(rates @ shape**2)
    slowest = int(np.argmax(moved * (inertia @ moved)))
    too_strong = ""
    if places and rate**2 > 4 * (shape @ motion.stiffness @ shape):
        too_strong = "its position"
    elif rate * timestep > 2.0:
        too_strong = "the rule of part O"
    start = f" (of about {hot:.2g} times kT for each degree of freedom)" if hot > 1.0 else ""
    return (
        f"{label(model, 'joint', model.dof_jntid[slowest])}: on average, the records still contain"
        f" {100 * left:.3g} % of the energy with which its motion starts{start}, the same in all"
        " replicas, so that their mean is not that of equilibrium and their spread is not its"
        f" error; {_remedy(loss, rate, timestep, hot, too_strong)} (by small motions about the"
        " initial position)"
    )


def _times_hotter(model: mujoco.MjModel, data: mujoco.MjData, inertia: Array, kT: float) -> float:
    """Return the kinetic energy of a state over that at a temperature, at least 1."""
    energy = float(data.qvel @ inertia @ data.qvel)
    return max(1.0, energy / (model.nv * kT)) if kT > 0.0 else 1.0


def _held(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    forces: Callable[[mujoco.MjData], Array],
    modes: Array,
    stiffness: Array,
    kT: float,
) -> NDArray[np.bool_]:
    """Return which modes have an equilibrium nearby, with nearly linear forces at thermal widths.

    None has if another one is driven away from its start by more than thermal fluctuations. The
    modes (nv, n) have unit masses; their stiffness has shape (n,).
    """
    held, moved, force = stiffness > 0.0, mujoco.MjData(model), modes.T @ forces(data)
    mujoco.mj_copyState(model, data, moved, int(mujoco.mjtState.mjSTATE_INTEGRATION))
    for i in np.flatnonzero(held):
        mode, width = modes[:, i], math.sqrt(kT / stiffness[i])
        for side in (width, -width):
            moved.qpos[:] = data.qpos
            mujoco.mj_integratePos(model, moved.qpos, mode, force[i] / stiffness[i] + side)
            try:
                found = mode @ forces(moved) / (-side * stiffness[i])
            except (ValueError, mujoco.FatalError):  # such as dipoles at the same place
                found = 0.0
            held[i] &= 1 / LINEAR < found < LINEAR
    stays = held | (force**2 <= kT * np.abs(stiffness))
    return held & stays.all()


def _remedy(loss: float, rate: float, timestep: float, hot: float, too_strong: str) -> str:
    """Return what to do about friction of a rate that takes away this part of an energy a step."""
    if loss <= 0.0:
        return "nothing damps it there: give a rate such as friction=1.0"
    needed = math.ceil(-math.log(FORGOTTEN / hot) / loss)
    why = f"friction damps it at {rate:.2g} per s"
    if too_strong:
        why += f", too strongly for {too_strong} to follow in fewer steps"
    burn_in = f"a burn_in of {needed * timestep:.2g} s ({needed:.2g} steps)"
    return f"{why}: {burn_in} leaves {100 * FORGOTTEN / hot:.2g} %"


def _too_much(loss: float, hot: float, sampling: Sampling) -> float:
    """Return the mean part in the records of an energy that decays by exp(-loss) in a step.

    The result is 0 if this is tolerated of a start that is `hot` times hotter than the sample. The
    relative variance of an energy is 2, and its correlation decays as it does.
    """
    records, lost = sampling.records, loss * sampling.interval
    mean = math.expm1(-lost * records) / math.expm1(-lost) / records if lost > 0.0 else 1.0
    left = math.exp(-loss * (sampling.burn_in + sampling.interval)) * mean
    independent = sampling.replicas * min(max(lost * records / 2, 1.0), records)
    tolerated = min(max(math.sqrt(2 / independent), TOLERATED), INTOLERABLE)
    return left if left * hot > tolerated else 0.0


def _slowest(step: Array, stiffness: Array, start: Array) -> tuple[float, Array]:
    """Return the slowest loss of an energy per step, and where it starts (m,).

    `step` takes positions and velocities, in coordinates of unit masses, through a step. `start`
    (2n, m) are states of energy 1. The result is NaN if the motion is unstable.
    """
    energy, power, count = block_diag(stiffness, np.eye(len(stiffness))), step, 1
    kept = np.eye(start.shape[1])
    for _ in range(DOUBLINGS):
        reached = power @ start
        kept = reached.T @ energy @ reached
        if not (np.isfinite(power).all() and np.isfinite(kept).all()):
            return math.nan, kept[-1]
        if kept.diagonal().max() < FORGOTTEN:  # at most the largest eigenvalue
            left, shapes = np.linalg.eigh(kept)
            if left[-1] < FORGOTTEN:
                return -math.log(max(left[-1], LEAST)) / count, shapes[:, -1]
        power, count = power @ power, 2 * count
    return 0.0, np.linalg.eigh(kept)[1][:, -1]
