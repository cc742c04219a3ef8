"""How long a run remembers the velocities from which it starts, by small motions about there."""

import math
from collections.abc import Callable

import mujoco
import numpy as np
from scipy.linalg import block_diag, eigh

from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.baths import LARGEST_MATRIX
from magmotor.mjcf.langevin.friction import Friction, friction_matrix
from magmotor.mjcf.langevin.model import inertia_matrix
from magmotor.mjcf.langevin.stability import crank_nicolson, stiffness_matrix
from magmotor.mjcf.lookup import label
from magmotor.numerics.linear_stability import SmallMotion, splitting_step
from magmotor.numerics.splittings import Scheme

TOLERATED, FORGOTTEN = 0.1, 0.01
"""Parts of the initial energy: the largest mean one in the records without a warning, and the one
that the proposed number of steps leaves."""

LEAST = 1e-300
"""Part that counts instead of 0, whose logarithm is infinite."""

DOUBLINGS = 50
"""Number of times that a number of steps is doubled before nothing is forgotten."""


@np.errstate(all="ignore")
def unsettled(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    friction: Friction,
    scheme: Scheme,
    forces: Callable[[mujoco.MjData], Array] | None,
    settle: int,
    nstep: int,
) -> str:
    """Return a warning if the records remember the initial velocities, else "".

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        The start; it may be changed.
    friction : Friction
    scheme : Scheme
    forces : callable, optional
        Returns the generalized forces (nv,) at the position of an mjData. Without them, only
        friction counts, and what it does not damp at all is left out.
    settle, nstep : int
        Numbers of steps before and within the records.
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
    timestep, nothing = model.opt.timestep, np.zeros((len(rates), len(rates)))
    parts = scheme.parts.replace("S", "R")
    step = splitting_step(parts, scheme.fractions, exact=True, response=crank_nicolson)
    motion = SmallMotion(nothing, np.diag(np.maximum(rates, 0.0)), nothing)
    kept = np.abs(np.diag(step(motion, timestep)[len(rates) :, len(rates) :]))
    loss, shape = -2 * math.log(max(kept.max(), LEAST)), np.eye(len(rates))[kept.argmax()]
    # The energy of an oscillation is lost half as fast.
    if _mean_left(loss / 2, settle, nstep) <= TOLERATED:
        return ""
    if forces is not None:
        stiffness = basis.T @ stiffness_matrix(model, data, forces) @ basis
        values, vectors = np.linalg.eigh((stiffness + stiffness.T) / 2)
        motion = motion._replace(stiffness=vectors * np.maximum(values, 0.0) @ vectors.T)
        loss, shape = _slowest(step(motion, timestep), motion.stiffness)
    left = _mean_left(loss, settle, nstep)
    if not left > TOLERATED or (forces is None and loss == 0.0):
        return ""
    moved = basis @ shape
    slowest = int(np.argmax(moved * (inertia @ moved)))
    rate = float(rates @ shape**2)
    return (
        f"{label(model, 'joint', model.dof_jntid[slowest])}: on average, the records still contain"
        f" {round(100 * left)} % of the energy with which its motion starts, the same in all"
        " replicas, so that their mean is not that of equilibrium and their spread is not its"
        f" error; {_remedy(loss, rate, timestep)} (by small motions about the initial position)"
    )


def _remedy(loss: float, rate: float, timestep: float) -> str:
    """Return what to do about friction of a rate that takes away this part of an energy a step."""
    if loss <= 0.0:
        return "nothing damps it there: give a rate such as friction=1.0"
    needed = math.ceil(-math.log(FORGOTTEN) / loss)
    why = f"friction damps it at {rate:.2g} per s"
    if rate * timestep > 2.0:
        why += ", too strongly for the rule of part O to follow in fewer steps"
    duration = f"{needed:.2g} steps ({needed * timestep:.2g} s)"
    return f"{why}: settle for {duration}, which leaves {100 * FORGOTTEN:g} %"


def _mean_left(loss: float, settle: int, nstep: int) -> float:
    """Return the mean part of an energy that is left, which decays by exp(-loss) in a step."""
    lost = loss * nstep
    return math.exp(-loss * settle) * (-math.expm1(-lost) / lost if lost > 0.0 else 1.0)


def _slowest(step: Array, stiffness: Array) -> tuple[float, Array]:
    """Return the slowest loss of a kinetic energy per step, and its velocities (n,).

    `step` takes positions and velocities, in coordinates of unit masses, through a step. The result
    is NaN if the motion is unstable.
    """
    n = len(stiffness)
    energy, power, count, shapes = block_diag(stiffness, np.eye(n)), step, 1, np.eye(n)
    for _ in range(DOUBLINGS):
        kinetic = power[:, n:].T @ energy @ power[:, n:]
        if not (np.isfinite(power).all() and np.isfinite(kinetic).all()):
            return math.nan, np.zeros(n)
        left, shapes = np.linalg.eigh(kinetic)
        if left[-1] < math.exp(-1):
            return -math.log(max(left[-1], LEAST)) / count, shapes[:, -1]
        power, count = power @ power, 2 * count
    return 0.0, shapes[:, -1]
