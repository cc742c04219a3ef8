"""The common base of the scenes of top and motor: a magnetic ball on a plane, under a ring."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.device import Scene
from magmotor.numerics.reproducible import applied


class BallScene(Scene):
    """A scene with a ball; `Top` and `Motor` define the fields.

    Attributes
    ----------
    ball_mass, ball_radius : float
        In kg and m.
    gravity : float
        In m/s^2.
    surface : str
        `planar`: the ball is constrained to the plane; `plane`: a contact bears it.
    coupling : float
        See the field of `Top` and `Motor`.
    """

    ball_mass: float
    ball_radius: float
    gravity: float
    surface: str
    coupling: float

    @property
    def moment(self) -> float:
        """Magnetic moment of the ball, in A m^2."""
        raise NotImplementedError

    def ring_sources(self, time: float = 0.0) -> tuple[Array, Array]:
        """Return positions (N, 3) in m and moments (N, 3) in A m^2 of the rings' dipoles."""
        raise NotImplementedError

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Return radius and height, in m, of the ring that is nearest to the ball."""
        raise NotImplementedError

    def resting_place(self) -> tuple[float, float]:
        """Return the deepest minimum of V_e on the plane, in m, where the ball can rest."""
        raise NotImplementedError

    @property
    def weight(self) -> float:
        """Weight of the ball, in N."""
        return self.ball_mass * self.gravity


def ring_dipoles(count: int, radius: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return positions (N, 3) and outward directions (N, 3) of equally spaced dipoles from x on."""
    azimuth = 2 * np.pi * np.arange(count) / count
    outward = np.stack(
        [applied(math.cos, azimuth), applied(math.sin, azimuth), np.zeros_like(azimuth)], axis=1
    )
    return radius * outward, outward
