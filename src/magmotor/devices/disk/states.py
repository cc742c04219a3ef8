"""Recorded states of the sliding disk, and of the Langevin particle, which has no angle."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.disk.scene import Disk, LangevinParticle


class DiskStates(NamedTuple):
    """Recorded states, shape (T, replicas), time (T,); dimensionless."""

    time: NDArray[np.float64]
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    theta: NDArray[np.float64] | None
    omega: NDArray[np.float64] | None


def start_disk(scene: Disk | LangevinParticle, replicas: int = 1) -> DiskStates:
    """Return the initial state in the scene's fields, the same in each replica."""
    is_disk = isinstance(scene, Disk)
    return DiskStates(
        time=np.zeros(1),
        x=np.full((1, replicas), scene.x),
        v=np.full((1, replicas), scene.v),
        theta=np.full((1, replicas), scene.theta) if is_disk else None,
        omega=np.full((1, replicas), scene.omega) if is_disk else None,
    )
