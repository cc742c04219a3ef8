"""Energy of the motor with a fixed, tilted inner ring and the ball at its energy minimum."""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.devices.ball.landscape import aligned_energy
from magmotor.devices.motor.scene import Motor

RADII, SECTORS = 30, 120
"""Size of the polar grid that the search for the energy minimum starts from."""


class TiltedRing(NamedTuple):
    """The two terms of the energy in J; the axis of the ball is along the field."""

    ball: float
    """Energy of the ball in the field of both rings."""
    outer: float
    """Energy of the inner ring in the field of the outer ring."""


def tilted_ring(motor: Motor, tilt: float, azimuth: float, *, outer: bool = True) -> TiltedRing:
    """Compute the energy of the ball and of a fixed, tilted inner ring.

    Parameters
    ----------
    motor : Motor
        The energy of ball and inner ring is multiplied by `ball_ring_factor`.
    tilt : float
        Angle of the ring's normal from the vertical in rad.
    azimuth : float
        Azimuth of the direction in which the normal leans, in rad.
    outer : bool
        Whether to include the outer ring.

    Returns
    -------
    TiltedRing
    """
    across = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    rotation = Rotation.from_rotvec(tilt * across)
    positions, outward = (rotation.apply(vectors) for vectors in motor.inner_dipole_frame())
    positions[:, 2] += motor.inner_height
    moments = motor.moment * outward
    fixed = motor.outer_sources()
    inner = positions, motor.ball_ring_factor * moments
    if not outer:
        return TiltedRing(_minimum(motor, dipoles.pack_sources(*inner)), 0.0)
    between = float(dipoles.energy(positions, moments, *fixed).sum())
    both = dipoles.pack_sources(*map(np.vstack, zip(inner, fixed, strict=True)))
    return TiltedRing(_minimum(motor, both), between)


def _minimum(motor: Motor, sources: dipoles.Packed) -> float:
    """Return the minimum of -m |B| over positions of the ball within the outer ring."""
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
