"""The linear limit of stability of a splitting, for small motions of a model about a position."""

from collections.abc import Callable

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.friction import Friction, friction_matrix, inertia_matrix
from magmotor.numerics.linear_stability import SmallMotion, largest_stable_step, splitting_step
from magmotor.numerics.splittings import Scheme

DISPLACEMENT = 1e-6
"""Displacement for differences of forces, in rad or m."""


@np.errstate(all="ignore")
def largest_timestep(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    forces: Callable[[mujoco.MjData], Array],
    friction: Friction,
    scheme: Scheme,
) -> float:
    """Return the smallest unstable timestep of small motions about the position of `data`, in s.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    forces : callable
        Returns the generalized forces (nv,) at the position of an mjData.
    friction : Friction
    scheme : Scheme
    """
    moved = mujoco.MjData(model)
    mujoco.mj_copyState(model, data, moved, int(mujoco.mjtState.mjSTATE_INTEGRATION))
    forces(moved)
    inertia, damping = inertia_matrix(model, moved), friction_matrix(model, moved, friction)
    stiffness = stiffness_matrix(model, data, forces)
    motion = SmallMotion.of(inertia, stiffness, damping, np.zeros_like(damping))
    step = splitting_step(scheme.parts, scheme.fractions, exact=True, response=crank_nicolson)
    return largest_stable_step(motion, step)


def stiffness_matrix(
    model: mujoco.MjModel, data: mujoco.MjData, forces: Callable[[mujoco.MjData], Array]
) -> Array:
    """Return the symmetric part of the derivatives of forces at a position, shape (nv, nv)."""
    moved, stiffness = mujoco.MjData(model), np.empty((model.nv, model.nv))
    mujoco.mj_copyState(model, data, moved, int(mujoco.mjtState.mjSTATE_INTEGRATION))
    for column, unit in zip(stiffness.T, np.eye(model.nv), strict=True):
        pair = []
        for sign in (1, -1):
            moved.qpos[:] = data.qpos
            mujoco.mj_integratePos(model, moved.qpos, sign * unit, DISPLACEMENT)
            pair.append(forces(moved))
        column[:] = (pair[1] - pair[0]) / (2 * DISPLACEMENT)
    return (stiffness + stiffness.T) / 2


def crank_nicolson(x: Array) -> Array:
    """Return the mean decay of the Crank-Nicolson rule, which approximates (exp(x) - 1)/x."""
    return 1 / (1 - x / 2)
