"""The ordinary differential equation of the disk without noise, equation (slidingdisk)."""

from collections.abc import Callable

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.disk.scene import Disk
from magmotor.devices.disk.scene import derivative as potential
from magmotor.devices.disk.states import DiskStates
from magmotor.numerics.reproducible import product


def problem(scene: Disk, initial: DiskStates) -> tuple[Callable, Array, Array]:
    """Return right-hand side, initial state and scales of (x, theta, v, omega), all replicas."""
    friction = scene.friction_matrix / np.array(scene.masses)[:, np.newaxis]

    def derivative(t: float, y: Array) -> Array:
        x, _, v, omega = y.reshape(4, -1)
        velocities = np.stack([v, omega])
        accelerations = -product(friction, velocities)
        accelerations[0] -= potential(scene.coefficients, x, 1)
        return np.concatenate([velocities, accelerations]).ravel()

    assert initial.theta is not None, "a disk rotates"
    assert initial.omega is not None, "a disk rotates"
    columns = [initial.x[-1], initial.theta[-1], initial.v[-1], initial.omega[-1]]
    state = np.concatenate(columns)
    return derivative, state, np.ones_like(state)


def states(scene: Disk, time: Array, rows: Array) -> DiskStates:
    """Return recorded states from rows of the solution."""
    x, theta, v, omega = rows.reshape(len(rows), 4, -1).transpose(1, 0, 2)
    return DiskStates(time, x, v, theta, omega)
