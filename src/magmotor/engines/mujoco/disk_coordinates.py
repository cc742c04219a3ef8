"""The disk's state in MuJoCo's joint coordinates: a slide along x and a hinge."""

import numpy as np
from numpy.typing import NDArray

from magmotor.states.disk import DiskStates


def joints(states: DiskStates) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`qpos` and `qvel` of the last of the states, shape (replicas, 2)."""
    assert states.theta is not None, "a disk turns"
    assert states.omega is not None, "a disk turns"
    place = np.stack([states.x[-1], states.theta[-1]], axis=-1)
    return place, np.stack([states.v[-1], states.omega[-1]], axis=-1)


def disk_states(
    time: NDArray[np.float64], qpos: NDArray[np.float64], qvel: NDArray[np.float64]
) -> DiskStates:
    """The disk's states from joint coordinates, shape (replicas, T, 2)."""
    (x, theta), (v, omega) = qpos.T, qvel.T
    return DiskStates(time, x, v, theta, omega)
