"""The common base of the scenes of top and motor: a magnetic ball on a plane, under a ring."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.quantities import quantity
from magmotor.numerics.reproducible import applied


@dataclass(frozen=True, kw_only=True)
class BallScene(Scene):
    """A scene with a ball; `Top` and `Motor` define most of its fields.

    Rings, fields and motion are described in the frame of the floor, to which the rings are fixed.
    """

    ball_mass: float
    ball_radius: float
    coupling: float
    gravity: float = quantity(9.81, "m/s^2", "gravitational acceleration", at_least=0)
    surface: str = quantity(
        "planar",
        "",
        "planar: constrained to z = r as in the paper; plane: gravity and unilateral contact",
        choices=("planar", "plane"),
    )
    floor_tilt: tuple[float, float] = quantity(
        (0.0, 0.0),
        "rad",
        "angles by which the floor descends along x and y",
        at_least=-0.5,
        below=0.5,
    )
    background_field: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "T", "uniform field, such as the earth's, in the frame of the floor"
    )
    drag: float = quantity(
        0.0, "kg/s", "background drag on the ball's center: force = -drag v", at_least=0
    )
    rotational_drag: float = quantity(
        0.0, "N m s", "background drag on the ball's rotation: torque = -drag omega", at_least=0
    )

    def _check_surroundings(self) -> None:
        """Check gravity where it bears the ball or moves it, and drag, which needs slide joints."""
        for name in ("drag", "rotational_drag"):
            if self.surface == "plane" and getattr(self, name):
                sentence = "must be zero when surface = 'plane'"
                raise ArgumentError(name, getattr(self, name), sentence)
        if self.gravity == 0 and self.surface == "plane":
            raise ArgumentError("gravity", self.gravity, "must be positive when surface = 'plane'")
        if self.gravity == 0 and any(self.floor_tilt):
            raise ArgumentError(
                "gravity", self.gravity, "must be positive when floor_tilt is not zero"
            )

    @property
    def moment(self) -> float:
        """Magnetic moment of the ball, in A m^2."""
        raise NotImplementedError

    @property
    def mass_offsets(self) -> tuple[float, float]:
        """Distances of the center of mass from the dipole, across the axis and along it, in m."""
        return 0.0, 0.0

    def ring_sources(self, time: float = 0.0) -> tuple[Array, Array]:
        """Return positions (N, 3) in m and moments (N, 3) in A m^2 of the rings' dipoles."""
        raise NotImplementedError

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Return radius and height, in m, of the ring that is nearest to the ball."""
        raise NotImplementedError

    def resting_place(self) -> tuple[float, float]:
        """Return the deepest minimum of V_e on the plane, in m, where the ball can rest."""
        raise NotImplementedError

    def in_air(self, speed: float = 0.0, viscosity: float = 1.8e-5, density: float = 1.2) -> Self:
        """Return a copy of the scene with the drag of air, or of another fluid.

        The drag is 6 pi eta r (1 + 0.15 Re^0.687) with Re = 2 r density speed/eta, the correction
        of Schiller and Naumann (1933) for Re < 1000, and that of rotation 8 pi eta r^3. The floor,
        which increases both, is left out.

        Parameters
        ----------
        speed : float
            Typical speed of the ball, in m/s.
        viscosity, density : float
            In Pa s and kg/m^3.
        """
        speed = check_number("speed", speed, at_least=0, unit="m/s")
        viscosity = check_number("viscosity", viscosity, above=0, unit="Pa s")
        density = check_number("density", density, at_least=0, unit="kg/m^3")
        reynolds = 2 * self.ball_radius * density * speed / viscosity
        check_number("Reynolds number 2 r density speed/viscosity", reynolds, below=1000)
        stokes = 6 * math.pi * viscosity * self.ball_radius
        return self.replace(
            drag=stokes * (1 + 0.15 * reynolds**0.687),
            rotational_drag=8 * math.pi * viscosity * self.ball_radius**3,
        )

    @property
    def gravity_vector(self) -> tuple[float, float, float]:
        """Acceleration of gravity in the frame of the floor, in m/s^2."""
        x, y = (math.sin(angle) for angle in self.floor_tilt)
        return self.gravity * x, self.gravity * y, -self.gravity * math.sqrt(1.0 - x * x - y * y)

    @property
    def weight(self) -> float:
        """Component of the ball's weight across the floor, in N."""
        return -self.ball_mass * self.gravity_vector[2]

    @property
    def downhill_force(self) -> tuple[float, float, float]:
        """The part of the ball's weight along the floor, in N."""
        x, y, _ = self.gravity_vector
        return self.ball_mass * x, self.ball_mass * y, 0.0


def gravitational_energy(scene: BallScene, position: Array) -> Array:
    """Return the energy (...) in J of a ball at positions (..., 3) in m; 0 at the center."""
    x, y, _ = scene.downhill_force
    raised = scene.weight * (position[..., 2] - scene.ball_radius)
    return raised - (x * position[..., 0] + y * position[..., 1])


def ring_dipoles(count: int, radius: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return positions (N, 3) and outward directions (N, 3) of equally spaced dipoles from x on."""
    azimuth = 2 * np.pi * np.arange(count) / count
    outward = np.stack(
        [applied(math.cos, azimuth), applied(math.sin, azimuth), np.zeros_like(azimuth)], axis=1
    )
    return radius * outward, outward
