"""How stiffly the outer ring holds the inner ring level."""

import numpy as np
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.devices.motor.scene import Motor

TILT = 0.01
"""Tilt in rad over which second differences of the energy are taken."""


def ring_stiffness(motor: Motor) -> float:
    """Return the smallest stiffness of the level inner ring against a tilt, in N m/rad.

    It is the smallest second derivative of the energy of the inner ring in the field of the outer
    one. Where it is negative, the level ring is unstable; where it is k > 0, the ring's tilts about
    two axes have a mean square of kT/k each, as far as the ball leaves them alone.
    """
    positions, outward = motor.inner_dipole_frame()
    center = np.array([0.0, 0.0, motor.inner_height])
    fixed = motor.outer_sources()

    def energy(x: float, y: float) -> float:
        turn = Rotation.from_rotvec([TILT * x, TILT * y, 0.0])
        moved = turn.apply(positions) + center, motor.moment * turn.apply(outward)
        return float(dipoles.energy(*moved, *fixed).sum())

    level = energy(0, 0)
    along, across = (
        energy(*unit) + energy(*np.negative(unit)) - 2 * level for unit in ((1, 0), (0, 1))
    )
    mixed = (energy(1, 1) + energy(-1, -1) - energy(1, -1) - energy(-1, 1)) / 4
    curvatures = np.linalg.eigvalsh([[along, mixed], [mixed, across]])
    return float(curvatures[0]) / TILT**2
