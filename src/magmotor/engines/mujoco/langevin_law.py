"""The numbers of a model and a timestep that the compiled splitting applies."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from magmotor.engines.friction import friction_and_noise
from magmotor.engines.mujoco.langevin_model import Ball, LangevinModel
from magmotor.reproducible import orthonormal_rows, product

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BODY, PLACE, DOF, CHANNEL, ISOTROPIC, TWIST, LAST_TWIST = 0, 1, 2, 3, 4, 5, 7
"""Columns of `Law.balls`: those of `Ball`, whether it is isotropic, and the axes of its twists."""


class Law(NamedTuple):
    """What acts on n velocities in the parts of a step.

    The rows of the sparse matrix (D L), as `starts`, `columns` and `values`, are what friction and
    noise add to each velocity.
    """

    timestep: float
    kick: Array
    """Half a step over the inertia of each velocity."""
    force: Array
    bodies: Integers
    wrenches: Array
    """As in `LangevinModel`, but of slides and hinges alone."""
    starts: Integers
    columns: Integers
    values: Array
    channels: int
    balls: Integers
    ratios: Array


def law(model: LangevinModel, timestep: float) -> Law:
    """The numbers of a model and a timestep."""
    matrix = _friction_and_noise(model, timestep)
    wrenches = model.wrenches.copy()
    for ball in model.balls:
        wrenches[ball.dof : ball.dof + 3] = 0.0
    balls = [(*ball[:4], ball.isotropic, *_twists(ball)) for ball in model.balls]
    return Law(
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


def _friction_and_noise(model: LangevinModel, timestep: float) -> csr_array:
    """The matrix (D L), group by group of velocities that friction or noise couple."""
    friction, noise = model.friction, model.noise
    n = len(friction)
    matrix = np.zeros((n, n + noise.shape[1]))
    groups, group = connected_components(csr_array(abs(friction) + abs(noise) @ abs(noise.T)))
    for number in range(groups):
        dofs = np.flatnonzero(group == number)
        channels = np.flatnonzero(noise[dofs].any(axis=0))
        driven = noise[np.ix_(dofs, channels)]
        # The root of the covariance wants Brownian motions that differ in what they drive.
        combinations = orthonormal_rows(driven)
        if len(combinations) == len(channels):
            combinations = np.eye(len(channels))
        decrement, increment = friction_and_noise(
            model.masses[dofs],
            friction[np.ix_(dofs, dofs)],
            product(driven, combinations.T),
            timestep,
            exact=True,
        )
        matrix[np.ix_(dofs, dofs)] = decrement
        matrix[np.ix_(dofs, n + channels)] = product(increment, combinations)
    return csr_array(matrix)


def _twists(ball: Ball) -> tuple[int, int, int]:
    """A palindrome of the axes whose moments of inertia differ from the median.

    That of a symmetric body is in the middle.
    """
    _, outer, middle = np.argsort(abs(ball.ratios - 1), kind="stable").tolist()
    return outer, middle, outer
