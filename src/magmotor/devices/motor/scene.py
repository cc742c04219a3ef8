"""The fluctuation-driven motor: a ball on a plane under two rings, the inner of which turns."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import check_choice, check_number, reject
from magmotor.device.quantities import check_fields, quantity
from magmotor.devices.ball.scene import BallScene, ring_dipoles
from magmotor.dipoles import PERMEABILITY_OVER_4PI

LARGEST_TILT = math.radians(20)
"""Tilt of the inner ring (rad) beyond which it is taken as lost: it snaps onto the ball."""

THERMAL = {
    "uniform": {"alpha_ball": 1e-3, "alpha_ring": 1e-3, "friction_ring": 0.15},
    "nonuniform": {"alpha_ball": 0.0, "alpha_ring": 2e-4, "friction_ring": 0.0},
}
"""What the temperature sets where it is not given: the paper's values."""

PAPER = {
    "nonuniform-a": ("nonuniform", 2e-4, 1),
    "nonuniform-b": ("nonuniform", 2e-4, 2),
    "nonuniform-c": ("nonuniform", 2.5e-4, 3),
    "uniform-a": ("uniform", 1e-3, 1),
    "uniform-b": ("uniform", 1e-3, 2),
    "uniform-c": ("uniform", 7.5e-4, 3),
    "uniform-d": ("uniform", 7.5e-4, 4),
}
"""The paper's seven runs: temperature, alpha in N m sqrt(s), and our seed for its realization."""


@dataclass(frozen=True, kw_only=True)
class Motor(BallScene):
    """The paper's motor; the defaults are its simulation at uniform temperature, alpha = 1e-3.

    Ball, inner and outer ring carry dipoles; the inner ring turns freely about its fixed center,
    the outer ring is fixed. With `temperature` uniform, friction and noise act on the slip of the
    ball's contact point and on the inner ring, in the ratio of one temperature; with nonuniform,
    they are what they are given as: in the paper noise on the ring alone, friction on the ball.

    Raises
    ------
    ValueError
        Names the field, its value and the bound.
    """

    temperature: str = quantity(
        "uniform", "", "one temperature, or not", choices=("uniform", "nonuniform")
    )
    alpha_ball: float | None = quantity(
        None, "N sqrt(s)", "noise of the slip force on the ball (none: as in the paper)", at_least=0
    )
    alpha_ring: float | None = quantity(
        None, "N m sqrt(s)", "noise of the ring's torque (none: as in the paper)", at_least=0
    )
    friction_ball: float = quantity(
        0.15, "kg/s", "viscous friction c_B of the ball: force = -c_B V_Q", at_least=0
    )
    friction_ring: float | None = quantity(
        None,
        "kg m^2/s",
        "friction c_R of the ring: torque = -c_R omega_R (none: as in the paper)",
        at_least=0,
    )
    ball_ring_factor: float = quantity(
        2.0, "1", "how often ball and inner ring are counted: 2 in the paper, 1 in physics", above=0
    )
    coupling: float = quantity(2e-6, "J m^3", "mu0 m_a m_b/(4 pi) of a pair of dipoles", above=0)
    ball_mass: float = quantity(0.5, "kg", "mass of the ball", above=0)
    ball_radius: float = quantity(0.04, "m", "radius of the ball", above=0)
    inner_dipoles: int = quantity(20, "1", "number of dipoles N on the inner ring", at_least=1)
    inner_radius: float = quantity(0.75, "m", "radius of the inner ring", above=0)
    inner_height: float = quantity(0.48, "m", "height of the inner ring's center", above=0)
    inner_mass: float = quantity(6.0, "kg", "mass of the inner ring", above=0)
    inner_inertia: float | None = quantity(
        None, "kg m^2", "inner ring's moment of inertia across its axis (none: J_3/2)", above=0
    )
    inner_axial_inertia: float | None = quantity(
        None, "kg m^2", "inner ring's moment of inertia J_3 about its axis (none: m r^2)", above=0
    )
    outer_dipoles: int = quantity(5, "1", "number of dipoles M on the outer ring", at_least=1)
    outer_radius: float = quantity(0.98, "m", "radius of the outer ring", above=0)
    outer_height: float = quantity(0.48, "m", "height of the outer ring's center", above=0)
    position: tuple[float, float] | None = quantity(
        None,
        "m",
        "where the ball starts (none: in the well under the first outer dipole)",
        size=2,
    )
    velocity: tuple[float, float] = quantity((0.0, 0.0), "m/s", "the ball's initial velocity")
    axis: tuple[float, float, float] | None = quantity(
        None, "1", "initial direction of the dipole xi_3, of any length (none: along B)", size=3
    )
    spin: float = quantity(0.0, "rad/s", "initial angular velocity of the ball about xi_3")
    gravity: float = quantity(9.81, "m/s^2", "gravitational acceleration", at_least=0)
    surface: str = quantity(
        "planar",
        "",
        "planar: held at z = r, the paper's constraint; plane: gravity and unilateral contact",
        choices=("planar", "plane"),
    )

    def __post_init__(self) -> None:
        """Check every field, alone and against the others."""
        check_choice("temperature", self.temperature, tuple(THERMAL))
        for name, value in THERMAL[self.temperature].items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        check_fields(self)
        if self.axis is not None and not any(self.axis):
            raise reject("axis", self.axis, "must be a direction: not all zero")
        self._check_rings()
        self._check_temperature()
        if self.surface == "plane" and self.gravity == 0:
            raise reject("gravity", self.gravity, "must be positive when surface = 'plane'")

    def _check_rings(self) -> None:
        top, reach = 2 * self.ball_radius, self.inner_radius * math.sin(LARGEST_TILT)
        why = f"m (the ball, of a ring tilted by {math.degrees(LARGEST_TILT):g} degrees)"
        check_number("inner_height", self.inner_height, above=top + reach, unit=why)
        check_number("outer_height", self.outer_height, above=top, unit="m (the ball's top)")
        clear = math.hypot(self.outer_radius, self.outer_height - self.inner_height)
        if clear <= self.inner_radius:
            sentence = (
                f"must be less than {clear:g} m: the rings overlap, the inner one cannot turn"
            )
            raise reject("inner_radius", self.inner_radius, sentence)
        across, _, axial = self.inner_moments
        if axial > 2 * across:
            sentence = f"must be at most twice the moment across it, {2 * across:g} kg m^2"
            raise reject("inner_axial_inertia", axial, sentence)

    def _check_temperature(self) -> None:
        for noise, friction in (("alpha_ball", "friction_ball"), ("alpha_ring", "friction_ring")):
            needed = self.temperature == "uniform" and getattr(self, noise) > 0
            if needed and getattr(self, friction) == 0:
                raise reject(
                    friction, 0.0, f"must be positive with {noise} at a uniform temperature"
                )
        ball, ring = (
            friction / alpha**2 if alpha else math.inf
            for friction, alpha in zip(self.frictions[1:3], self.noises[1:3], strict=True)
        )
        if self.temperature == "uniform" and not math.isclose(ball, ring, rel_tol=1e-9):
            sentence = f"must be friction_ball/alpha_ball^2 = {ball:g} when temperature = 'uniform'"
            raise reject("friction_ring/alpha_ring^2", ring, sentence)

    @classmethod
    def paper(cls, run: str = "uniform-a", **changes: Any) -> "Motor":
        """One of the paper's seven runs, a key of `PAPER`; `changes` replace fields."""
        check_choice("run", run, tuple(PAPER))
        temperature, alpha, _ = PAPER[run]
        fields: dict[str, Any] = {"temperature": temperature, "alpha_ring": alpha}
        if temperature == "uniform":
            fields["alpha_ball"] = alpha
        return cls(**(fields | changes))

    @classmethod
    def si(cls, **changes: Any) -> "Motor":
        """The paper's moments read in SI: the coupling is 20 times larger.

        The ball then never leaves its first well.
        """
        reading: dict[str, Any] = {"coupling": 4e-5}
        return cls(**(reading | changes))

    def replace(self, **changes: Any) -> "Motor":
        """A copy with some fields changed, checked anew.

        With another `temperature`, noise and the ring's friction are the paper's again.
        """
        if changes.get("temperature", self.temperature) != self.temperature:
            changes = dict.fromkeys(THERMAL["uniform"]) | changes
        return replace(self, **changes)

    @property
    def kT(self) -> float:
        """Temperature kT = alpha^2/(2c) in J; the paper's text has alpha^2/c, its Gibbs law this.

        Raises
        ------
        ValueError
            The temperature is not uniform.
        """
        if self.temperature != "uniform":
            raise reject("temperature", self.temperature, "must be uniform: else there is no kT")
        if not self.alpha_ring:
            return 0.0
        return self.noises[-1] ** 2 / (2 * self.frictions[-1])

    @property
    def beta(self) -> float:
        """Inverse temperature 2c/alpha^2 in 1/J, of Gibbs' measure (kjhss); infinite without noise.

        Raises
        ------
        ValueError
            The temperature is not uniform.
        """
        return 1 / self.kT if self.kT else math.inf

    @property
    def frictions(self) -> tuple[float, ...]:
        """Friction along the five velocities (V_x, V_y of the slip, omega_R): c_B, c_B, c_R..."""
        ring = self.friction_ring or 0.0
        return self.friction_ball, self.friction_ball, ring, ring, ring

    @property
    def noises(self) -> tuple[float, ...]:
        """Noise along the same: alpha_B, alpha_B, alpha_R, alpha_R, alpha_R."""
        ball, ring = self.alpha_ball or 0.0, self.alpha_ring or 0.0
        return ball, ball, ring, ring, ring

    @property
    def moment(self) -> float:
        """Magnetic moment of every dipole, in A m^2."""
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
        """Positions (N, 3) and outward directions (N, 3) of the inner dipoles in its own frame."""
        return ring_dipoles(self.inner_dipoles, self.inner_radius)

    def outer_sources(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (M, 3) in m and moments (M, 3) in A m^2 of the outer ring."""
        positions, outward = ring_dipoles(self.outer_dipoles, self.outer_radius)
        return positions + np.array([0.0, 0.0, self.outer_height]), self.moment * outward

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Radius and height of the inner ring, in m."""
        check_number("time", time)
        return self.inner_radius, self.inner_height

    def resting_place(self) -> tuple[float, float]:
        """Where on the plane, in m, the ball rests under the first outer dipole."""
        from magmotor.devices.ball.landscape import valley_radius

        return valley_radius(self), 0.0

    def ring_sources(self, time: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and moments of all that act on the ball while the inner ring is level.

        The inner ring's moments are multiplied by `ball_ring_factor`.
        """
        check_number("time", time)
        positions, outward = self.inner_dipole_frame()
        counted = self.ball_ring_factor * self.moment * outward
        places, moments = self.outer_sources()
        center = np.array([0.0, 0.0, self.inner_height])
        return np.vstack([positions + center, places]), np.vstack([counted, moments])
