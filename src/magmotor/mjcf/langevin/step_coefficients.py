"""The coefficients of a BAOAB step, computed once for a model and a timestep."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from magmotor.common.arrays import Array, Integers
from magmotor.mjcf.langevin.model import Ball, LangevinModel
from magmotor.numerics.splittings import friction_and_noise

BODY, QUATERNION, DOF, CHANNEL, ISOTROPIC, TWIST, LAST_TWIST = 0, 1, 2, 3, 4, 5, 7
"""Columns of `StepCoefficients.balls`: the fields of `Ball`, whether isotropic, and twist axes."""


class StepCoefficients(NamedTuple):
    """Coefficients of one step for n velocities and k Brownian channels.

    In part O, damping and noise add (D L) (u, xi) to the velocities u, where xi are k standard
    normal numbers. The rows of the matrix (D L), shape (n, n + k), are stored in compressed sparse
    form as `starts`, `columns` and `values`.
    """

    timestep: float
    """In s."""
    kick: Array
    """Half a timestep over the inertia of each velocity, shape (n,)."""
    force: Array
    """Constant force on each velocity, shape (n,)."""
    bodies: Integers
    """Body of each velocity, shape (n,)."""
    wrenches: Array
    """Same as in `LangevinModel`, but zero for ball joints, shape (n, 6)."""
    starts: Integers
    """First element of each row in `columns` and `values`, and their end, shape (n + 1,)."""
    columns: Integers
    values: Array
    channels: int
    """Number of Brownian channels, k."""
    balls: Integers
    """Integers of each ball joint, in columns `BODY` to `LAST_TWIST`."""
    ratios: Array
    """`Ball.ratios` of each ball joint, shape (balls, 3)."""


def step_coefficients(model: LangevinModel, timestep: float) -> StepCoefficients:
    """Compute the coefficients of a step of `timestep` seconds for a model."""
    matrix = _damping_and_noise(model, timestep)
    wrenches = model.wrenches.copy()
    for ball in model.balls:
        wrenches[ball.dof : ball.dof + 3] = 0.0
    balls = [(*ball[:4], ball.isotropic, *_twist_axes(ball)) for ball in model.balls]
    return StepCoefficients(
        timestep,
        0.5 * timestep / model.masses,
        model.force,
        model.bodies,
        wrenches,
        matrix.indptr.astype(np.int64),
        matrix.indices.astype(np.int64),
        np.asarray(matrix.data, dtype=float),
        model.noise.shape[1],
        np.array(balls, dtype=np.int64).reshape(-1, 8),
        np.array([ball.ratios for ball in model.balls]).reshape(-1, 3),
    )


def _damping_and_noise(model: LangevinModel, timestep: float) -> csr_array:
    """Compute the matrix (D L) of `StepCoefficients`.

    Each group of velocities that are coupled by damping or noise is a separate block, computed by
    `magmotor.numerics.splittings.friction_and_noise`.
    """
    damping, noise = model.damping, model.noise
    n = len(damping)
    matrix = np.zeros((n, n + noise.shape[1]))
    groups, group = connected_components(csr_array(abs(damping) + abs(noise) @ abs(noise.T)))
    for number in range(groups):
        dofs = np.flatnonzero(group == number)
        channels = np.flatnonzero(noise[dofs].any(axis=0))
        decrement, increment = friction_and_noise(
            model.masses[dofs],
            damping[np.ix_(dofs, dofs)],
            noise[np.ix_(dofs, channels)],
            timestep,
            exact=True,
        )
        matrix[np.ix_(dofs, dofs)] = decrement
        matrix[np.ix_(dofs, n + channels)] = increment
    return csr_array(matrix)


def _twist_axes(ball: Ball) -> tuple[int, int, int]:
    """Return the axes of the twists in `_drift`, in a symmetric sequence.

    They are the two axes other than that of the median moment of inertia. The one whose moment
    differs most from the median is in the middle; it is the symmetry axis of a symmetric body.
    """
    _, outer, middle = np.argsort(abs(ball.ratios - 1), kind="stable").tolist()
    return outer, middle, outer
