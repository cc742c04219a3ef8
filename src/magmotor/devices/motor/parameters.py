"""The parameters of the motor, and what follows from them at once."""

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import check_choice, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.quantities import check_fields, quantity
from magmotor.devices.ball.scene import BallScene, ring_dipoles
from magmotor.dipoles import PERMEABILITY_OVER_4PI

LARGEST_TILT = math.radians(20)
"""Tilt of the inner ring (rad) beyond which it counts as lost, since it snaps onto the ball."""

THERMAL = {
    "uniform": {"alpha_ball": 1e-3, "alpha_ring": 1e-3, "friction_ring": 0.15},
    "nonuniform": {"alpha_ball": 0.0, "alpha_ring": 2e-4, "friction_ring": 0.0},
}
"""Defaults of fields that depend on `temperature`: the paper's values."""


@dataclass(frozen=True, kw_only=True)
class MotorParameters(BallScene):
    """The fields of a `Motor`, and the numbers that its rings, friction and noise have."""

    temperature: str = quantity(
        "uniform",
        "",
        "whether ball and ring have the same temperature",
        choices=("uniform", "nonuniform"),
    )
    alpha_ball: float | None = quantity(
        None, "N sqrt(s)", "noise of the slip force on the ball (default: the paper's)", at_least=0
    )
    alpha_ring: float | None = quantity(
        None, "N m sqrt(s)", "noise of the torque on the ring (default: the paper's)", at_least=0
    )
    friction_ball: float = quantity(
        0.15, "kg/s", "viscous friction c_B of the ball: force = -c_B V_Q", at_least=0
    )
    friction_ring: float | None = quantity(
        None,
        "kg m^2/s",
        "friction c_R of the ring: torque = -c_R omega_R (default: the paper's)",
        at_least=0,
    )
    drag_temperature: float | None = quantity(
        None,
        "J",
        "temperature kT of the background drag (default: that of Gibbs, or 0)",
        at_least=0,
    )
    load_torque: float = quantity(
        0.0,
        "N m",
        "load: torque about the vertical through the rings' center on the ball's center, as a"
        " force load_torque/rho along e_phi, counterclockwise",
    )
    ball_ring_factor: float = quantity(
        2.0,
        "1",
        "factor of the energy of ball and inner ring: 2 in the paper, 1 in physics",
        above=0,
    )
    coupling: float = quantity(2e-6, "J m^3", "mu0 m_a m_b/(4 pi) of a pair of dipoles", above=0)
    ball_mass: float = quantity(0.5, "kg", "mass of the ball", above=0)
    ball_radius: float = quantity(0.04, "m", "radius of the ball", above=0)
    inner_dipoles: int = quantity(20, "1", "number of dipoles N on the inner ring", at_least=1)
    inner_radius: float = quantity(0.75, "m", "radius of the inner ring", above=0)
    inner_height: float = quantity(0.48, "m", "height of the inner ring's center", above=0)
    inner_mass: float = quantity(6.0, "kg", "mass of the inner ring", above=0)
    inner_inertia: float | None = quantity(
        None, "kg m^2", "inner ring's moment of inertia across its axis (default: J_3/2)", above=0
    )
    inner_axial_inertia: float | None = quantity(
        None,
        "kg m^2",
        "inner ring's moment of inertia J_3 about its axis (default: m r^2)",
        above=0,
    )
    inner_dipole_angle: float = quantity(
        0.0,
        "rad",
        "angle by which the inner dipoles are turned out of the radius about the ring's axis,"
        " counterclockwise from outward; other than 0 and pi, the ring is chiral",
    )
    outer_dipoles: int = quantity(5, "1", "number of dipoles M on the outer ring", at_least=1)
    outer_radius: float = quantity(0.98, "m", "radius of the outer ring", above=0)
    outer_height: float = quantity(0.48, "m", "height of the outer ring's center", above=0)
    position: tuple[float, float] | None = quantity(
        None,
        "m",
        "initial position of the ball (default: the well under the first outer dipole)",
        size=2,
    )
    velocity: tuple[float, float] = quantity((0.0, 0.0), "m/s", "initial velocity of the ball")
    axis: tuple[float, float, float] | None = quantity(
        None, "1", "initial direction of the dipole xi_3, of any length (default: along B)", size=3
    )
    spin: float = quantity(0.0, "rad/s", "initial angular velocity of the ball about xi_3")

    def __post_init__(self) -> None:
        """Check each field, by itself and against the others."""
        check_choice("temperature", self.temperature, tuple(THERMAL))
        for name, value in THERMAL[self.temperature].items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        check_fields(self)
        if self.axis is not None and not any(self.axis):
            raise ArgumentError("axis", self.axis, "must have a nonzero component")
        self._check_rings()
        self._check_temperature()
        self._check_surroundings()
        if self.load_torque and self.surface == "plane":
            sentence = (
                "must be zero when surface = 'plane', which needs MuJoCo, without such a force"
            )
            raise ArgumentError("load_torque", self.load_torque, sentence)

    def _check_rings(self) -> None:
        top, reach = 2 * self.ball_radius, self.inner_radius * math.sin(LARGEST_TILT)
        why = f"m (the ball's top, for a ring tilted by {math.degrees(LARGEST_TILT):g} degrees)"
        check_number("inner_height", self.inner_height, above=top + reach, unit=why)
        check_number("outer_height", self.outer_height, above=top, unit="m (the ball's top)")
        clear = math.hypot(self.outer_radius, self.outer_height - self.inner_height)
        if clear <= self.inner_radius:
            sentence = f"must be less than {clear:g} m: otherwise the rings overlap"
            raise ArgumentError("inner_radius", self.inner_radius, sentence)
        if any(self.background_field) and self.inner_dipoles == 1:
            sentence = "must be zero with one inner dipole, whose torque in it is not modeled"
            raise ArgumentError("background_field", self.background_field, sentence)
        across, _, axial = self.inner_moments
        if axial > 2 * across:
            sentence = f"must be at most twice the moment across the axis, {2 * across:g} kg m^2"
            raise ArgumentError("inner_axial_inertia", axial, sentence)

    def _check_temperature(self) -> None:
        for noise, friction in (("alpha_ball", "friction_ball"), ("alpha_ring", "friction_ring")):
            needed = self.temperature == "uniform" and getattr(self, noise) > 0
            if needed and getattr(self, friction) == 0:
                raise ArgumentError(
                    friction, 0.0, f"must be positive with {noise} at a uniform temperature"
                )
        ball, ring = (
            friction / alpha**2 if alpha else math.inf
            for friction, alpha in zip(self.frictions[1:3], self.noises[1:3], strict=True)
        )
        if self.temperature == "uniform" and not math.isclose(ball, ring, rel_tol=1e-9):
            sentence = f"must be friction_ball/alpha_ball^2 = {ball:g} when temperature = 'uniform'"
            if math.isinf(ball):
                sentence = "must have alpha_ball > 0 beside it when temperature = 'uniform'"
            raise ArgumentError("friction_ring/alpha_ring^2", ring, sentence)

    def replace(self, **changes: Any) -> Self:
        """Return a checked copy with some fields changed.

        Another `temperature` resets the noise and the friction of the ring to the paper's values.
        """
        temperature = changes.get("temperature", self.temperature)
        if isinstance(temperature, str) and temperature != self.temperature:
            changes = dict.fromkeys(THERMAL["uniform"]) | changes
        return replace(self, **changes)

    @property
    def kT(self) -> float:
        """Temperature kT = alpha^2/(2c) in J, as in the paper's Gibbs law; its text has alpha^2/c.

        Raises
        ------
        ValueError
            The temperature is not uniform.
        """
        if self.temperature != "uniform":
            raise ArgumentError(
                "temperature", self.temperature, "must be uniform, or kT is undefined"
            )
        if not self.alpha_ring:
            return 0.0
        return self.noises[-1] ** 2 / (2 * self.frictions[-1])

    @property
    def has_two_temperatures(self) -> bool:
        """Whether the temperatures alpha^2/(2c) of ball and ring differ, so that heat flows."""
        pairs = zip(self.frictions[1:3], self.noises[1:3], strict=True)
        (c, a), (c_ring, a_ring) = pairs
        return self.is_noisy and not math.isclose(a**2 * c_ring, a_ring**2 * c, rel_tol=1e-9)

    @property
    def beta(self) -> float:
        """Inverse temperature 2c/alpha^2 in 1/J of Gibbs' law (kjhss); infinite without noise.

        Raises
        ------
        ValueError
            The temperature is not uniform.
        """
        return 1 / self.kT if self.kT else math.inf

    @property
    def frictions(self) -> tuple[float, ...]:
        """Friction c_B, c_B, c_R, c_R, c_R for the five velocities: slip V_x, V_y and omega_R."""
        ring = self.friction_ring or 0.0
        return self.friction_ball, self.friction_ball, ring, ring, ring

    @property
    def noises(self) -> tuple[float, ...]:
        """Noise alpha_B, alpha_B, alpha_R, alpha_R, alpha_R for the same velocities."""
        ball, ring = self.alpha_ball or 0.0, self.alpha_ring or 0.0
        return ball, ball, ring, ring, ring

    @property
    def drag_noises(self) -> tuple[float, float]:
        """Noise of the drag of the ball's translation (N sqrt(s)) and rotation (N m sqrt(s))."""
        kT = self.drag_temperature
        if kT is None:
            kT = self.kT if self.temperature == "uniform" else 0.0
        return math.sqrt(2 * kT * self.drag), math.sqrt(2 * kT * self.rotational_drag)

    @property
    def is_noisy(self) -> bool:
        """Whether any noise acts."""
        return any(self.noises) or any(self.drag_noises)

    @property
    def moment(self) -> float:
        """Magnetic moment of each dipole in A m^2."""
        return math.sqrt(self.coupling / PERMEABILITY_OVER_4PI)

    @property
    def ball_inertia(self) -> float:
        """The ball's moment of inertia 2/5 m r^2 in kg m^2."""
        return 0.4 * self.ball_mass * self.ball_radius**2

    @property
    def inner_moments(self) -> tuple[float, float, float]:
        """Principal moments of inertia (J, J, J_3) of the inner ring in kg m^2."""
        hoop = self.inner_mass * self.inner_radius**2
        axial = hoop if self.inner_axial_inertia is None else self.inner_axial_inertia
        across = axial / 2 if self.inner_inertia is None else self.inner_inertia
        return across, across, axial

    def inner_dipole_frame(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) and directions (N, 3) of the inner dipoles in the ring frame.

        The directions are outward, turned by `inner_dipole_angle`.
        """
        positions, outward = ring_dipoles(self.inner_dipoles, self.inner_radius)
        if not self.inner_dipole_angle:
            return positions, outward
        cosine, sine = math.cos(self.inner_dipole_angle), math.sin(self.inner_dipole_angle)
        x, y, z = outward.T
        return positions, np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=1)

    def outer_sources(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (M, 3) in m and moments (M, 3) in A m^2 of the outer ring."""
        positions, outward = ring_dipoles(self.outer_dipoles, self.outer_radius)
        return positions + np.array([0.0, 0.0, self.outer_height]), self.moment * outward

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Radius and height of the inner ring, in m."""
        check_number("time", time)
        return self.inner_radius, self.inner_height

    def resting_place(self) -> tuple[float, float]:
        """Position on the plane, in m, of the ball at rest under the first outer dipole."""
        from magmotor.devices.ball.landscape import valley_radius

        return valley_radius(self), 0.0

    def ring_sources(self, time: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and moments of all dipoles that act on the ball if the inner ring is level.

        The moments of the inner ring are multiplied by `ball_ring_factor`.
        """
        check_number("time", time)
        inner_positions, outward = self.inner_dipole_frame()
        inner_moments = self.ball_ring_factor * self.moment * outward
        positions, moments = self.outer_sources()
        center = np.array([0.0, 0.0, self.inner_height])
        return (
            np.vstack([inner_positions + center, positions]),
            np.vstack([inner_moments, moments]),
        )
