"""What top and motor have in common: a magnetic ball on a plane, under a ring of dipoles."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.device.device import Scene
from magmotor.numerics.reproducible import applied

Array = NDArray[np.float64]


class BallScene(Scene):
    """A scene with a ball; its fields are those of `Top` and `Motor`.

    Attributes
    ----------
    ball_mass, ball_radius : float
        In kg and m.
    gravity : float
        In m/s^2.
    surface : str
        `planar` or `plane`.
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
        """Positions (N, 3) in m and moments (N, 3) in A m^2 of what acts on the ball."""
        raise NotImplementedError

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Radius and height, in m, of the ring that is nearest to the ball."""
        raise NotImplementedError

    def resting_place(self) -> tuple[float, float]:
        """Where on the plane, in m, the ball rests in the deepest minimum of V_e."""
        raise NotImplementedError

    @property
    def weight(self) -> float:
        """Of the ball, in N."""
        return self.ball_mass * self.gravity


def ring_dipoles(count: int, radius: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (N, 3) and outward directions (N, 3) of equally spaced dipoles, first along x."""
    azimuth = 2 * np.pi * np.arange(count) / count
    outward = np.stack(
        [applied(math.cos, azimuth), applied(math.sin, azimuth), np.zeros_like(azimuth)], axis=1
    )
    return radius * outward, outward
