"""Moments over the replicas at a recorded time."""

import numpy as np
from numpy.typing import NDArray

from magmotor.observables.disk import energy
from magmotor.scenes import Disk, LangevinParticle
from magmotor.states.disk import DiskStates

POWERS = (1, 2, 4)
"""Of which moments are taken; the fourth gives the standard error of the second."""


def quantities(scene: Disk | LangevinParticle) -> dict[str, str]:
    """Names and descriptions of what moments are taken of."""
    common = {
        "x": "displacement since the start",
        "v": "velocity",
        "energy": "total energy",
    }
    if isinstance(scene, LangevinParticle):
        return common
    return common | {
        "omega": "angular velocity",
        "slip": "slip velocity v + omega",
        "d": "-v + sigma omega, which friction and noise leave alone",
        "y": "displacement of x + theta since the start",
    }


def moments(
    scene: Disk | LangevinParticle, states: DiskStates, start: DiskStates
) -> NDArray[np.float64]:
    """Means of the powers of each of `quantities` in the last row, shape (quantities, powers)."""
    x, v, omega = states.x[-1], states.v[-1], None
    moved = x - start.x[-1]
    columns = [moved, v]
    if isinstance(scene, Disk):
        assert states.theta is not None
        assert states.omega is not None
        assert start.theta is not None
        omega = states.omega[-1]
        turned = states.theta[-1] - start.theta[-1]
        columns += [omega, v + omega, scene.sigma * omega - v, moved + turned]
    columns.insert(2, energy(scene, x, v, omega))
    squares = [column * column for column in columns]
    fourth = [square * square for square in squares]
    return np.array([np.mean(powers, axis=1) for powers in (columns, squares, fourth)]).T
