"""Observables of the sliding disk and of the Langevin particle."""

import numpy as np
from numpy.typing import NDArray

from magmotor.scenes import Disk, LangevinParticle
from magmotor.scenes.potential import derivative

Array = NDArray[np.float64]


def energy(scene: Disk | LangevinParticle, x: Array, v: Array, omega: Array | None = None) -> Array:
    """Energy E = v^2/2 + sigma omega^2/2 + U(x), equation (slidingdiskE); any shape."""
    kinetic = 0.5 * v**2
    if isinstance(scene, Disk) and omega is not None:
        kinetic = kinetic + 0.5 * scene.sigma * omega**2
    return kinetic + derivative(scene.coefficients, x)
