"""Energy of the motor while its inner ring is held tilted and the ball is where it is deepest."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.devices.ball.landscape import aligned_energy
from magmotor.devices.motor.scene import Motor

Array = NDArray[np.float64]

RADII, SECTORS = 30, 120
"""Of the polar grid on which the search for the ball's deepest place begins."""


class TiltedRing(NamedTuple):
    """Parts of the energy in J, whose sum is the energy; the ball's axis is along the field."""

    ball: float
    """Of the ball, in the field of both rings."""
    outer: float
    """Of the inner ring in the field of the outer one."""


def tilted_ring(motor: Motor, tilt: float, azimuth: float, *, outer: bool = True) -> TiltedRing:
    """Energy of the ball and of an inner ring that is held tilted.

    Parameters
    ----------
    motor : Motor
        Ball and inner ring count `ball_ring_factor` times.
    tilt : float
        Of the ring's normal from the vertical, in rad.
    azimuth : float
        Of the side to which the normal leans, in rad.
    outer : bool
        False leaves out the outer ring.

    Returns
    -------
    TiltedRing
    """
    across = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    turn = Rotation.from_rotvec(tilt * across)
    places, outward = (turn.apply(vectors) for vectors in motor.inner_dipole_frame())
    places[:, 2] += motor.inner_height
    moments = motor.moment * outward
    fixed = motor.outer_sources()
    sources = places, motor.ball_ring_factor * moments
    if not outer:
        return TiltedRing(_deepest(motor, sources), 0.0)
    between = float(dipoles.energy(places, moments, *fixed).sum())
    both = np.vstack([sources[0], fixed[0]]), np.vstack([sources[1], fixed[1]])
    return TiltedRing(_deepest(motor, both), between)


def _deepest(motor: Motor, sources: tuple[Array, Array]) -> float:
    """The least of -m |B| over the ball's places on the plane, within the outer ring."""
    radius, around = np.meshgrid(
        np.linspace(0, motor.outer_radius, RADII),
        np.linspace(0, 2 * math.pi, SECTORS, endpoint=False),
    )
    grid = np.stack([radius * np.cos(around), radius * np.sin(around)], axis=-1).reshape(-1, 2)
    start = grid[aligned_energy(motor, grid, sources).argmin()]
    found = minimize(
        lambda point: float(aligned_energy(motor, point, sources)) / motor.coupling,
        start,
        method="Nelder-Mead",
    )
    return float(found.fun) * motor.coupling
