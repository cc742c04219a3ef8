"""Hamel's magnetic top: a magnetized ball on a plane under a ring of dipoles."""

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import check_array, check_integer, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.quantities import check_fields, described, quantity
from magmotor.devices.ball.scene import BallScene, ring_dipoles
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.numerics.reproducible import product


class Waypoint(NamedTuple):
    """Pose of the ring at one time; it moves smoothly between waypoints and rests at each.

    Parameters
    ----------
    time : float
        In s.
    height : float
        Height of the ring's center, in m.
    tilt : float
        Angle of the ring's normal from the vertical, in rad.
    azimuth : float, optional
        Direction in which the normal leans, in rad; by default the scene's `tilt_azimuth`.
    """

    time: float
    height: float
    tilt: float
    azimuth: float | None = None


def pose(script: tuple[Waypoint, ...], time: float) -> tuple[Any, ...]:
    """Return height (m), tilt and azimuth (rad) at a time, from waypoints that have all of them.

    They are constant before the first waypoint and after the last. The interpolation between
    waypoints is 6 s^5 - 15 s^4 + 10 s^3, with continuous velocity and acceleration.
    """
    after = bisect_right(script, time, key=lambda waypoint: waypoint.time)
    if after == 0 or after == len(script):
        return script[0 if after == 0 else -1][1:]
    start, end = script[after - 1], script[after]
    s = (time - start.time) / (end.time - start.time)
    s = s**3 * (10 + s * (6 * s - 15))
    ends: Any = zip(start[1:], end[1:], strict=True)
    return tuple(x + s * (y - x) for x, y in ends)


def check_script(
    script: tuple[Waypoint, ...], lowest: float, azimuth: float
) -> tuple[Waypoint, ...]:
    """Check a script and return it as waypoints, which all have an azimuth.

    Raises
    ------
    ValueError
        The times do not increase, a height is not above `lowest` or a tilt is not in [0, pi/2).
    """
    if not isinstance(script, tuple | list):
        raise ArgumentError("ring_script", script, "must be a tuple of waypoints")
    checked: list[Waypoint] = []
    for i, entry in enumerate(script):
        name = f"ring_script[{i}]"
        if not isinstance(entry, tuple | list) or len(entry) not in (3, 4):
            raise ArgumentError(name, entry, "must be time, height, tilt and optionally an azimuth")
        time, height, tilt, around = Waypoint(*entry)
        waypoint = Waypoint(
            check_number(f"{name}.time", time, unit="s"),
            check_number(f"{name}.height", height, above=lowest, unit="m"),
            check_number(f"{name}.tilt", tilt, at_least=0.0, below=math.pi / 2, unit="rad"),
            azimuth if around is None else check_number(f"{name}.azimuth", around, unit="rad"),
        )
        if checked and waypoint.time <= checked[-1].time:
            before = f"{checked[-1].time:g} s, the time of the waypoint before"
            raise ArgumentError(f"{name}.time", time, f"must be greater than {before}")
        checked.append(waypoint)
    return tuple(checked)


PAPER_TILT = math.pi / 64
SMALLEST_DRY_FRICTION = 1e-5
ROUNDING = 1e-12
"""Relative rounding error of principal moments of inertia."""


@dataclass(frozen=True, kw_only=True)
class Top(BallScene):
    """Hamel's top; the defaults are the paper's fourth case, the one that acquires spin.

    Raises
    ------
    ValueError
        The message names the field, its value and the bound.
    """

    ball_mass: float = quantity(0.2, "kg", "mass of the ball", above=0)
    ball_radius: float = quantity(0.018, "m", "radius of the ball", above=0)
    ball_inertia: float | None = quantity(
        None, "kg m^2", "moment of inertia across the axis xi_3 (default: 2/5 m r^2)", above=0
    )
    ball_axial_inertia: float | None = quantity(
        None, "kg m^2", "moment of inertia about the axis xi_3 (default: 2/5 m r^2)", above=0
    )
    center_of_mass: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m", "center of mass in the ball's frame, from the ball's center"
    )
    products_of_inertia: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "kg m^2",
        "elements xy, xz, yz of the inertia about the center of mass in the ball's frame",
    )
    friction: float = quantity(0.3, "kg/s", "viscous friction c: force = -c V_Q", at_least=0)
    torsional_damping: float = quantity(
        0.0, "N m s", "viscous torsion k of the contact: torque = -k omega_z", at_least=0
    )
    position: tuple[float, float] = quantity((-0.05, 0.02), "m", "initial position of the ball")
    velocity: tuple[float, float] = quantity((0.0, 0.0), "m/s", "initial velocity of the ball")
    axis: tuple[float, float, float] = quantity(
        (0.0, 0.0, 1.0), "1", "initial direction of the dipole xi_3, of any length"
    )
    spin: float = quantity(0.0, "rad/s", "initial angular velocity about xi_3")
    ring_dipoles: int = quantity(20, "1", "number of dipoles N on the ring", at_least=1)
    ring_radius: float = quantity(0.34, "m", "radius of the ring", above=0)
    ring_height: float = quantity(0.2, "m", "height H of the ring's center", above=0)
    tilt: float = quantity(
        PAPER_TILT,
        "rad",
        "angle of the ring's normal from the vertical",
        at_least=0,
        below=math.pi / 2,
    )
    tilt_azimuth: float = quantity(0.0, "rad", "direction in which the ring's normal leans")
    ring_script: tuple[Waypoint, ...] = described(
        (),
        "waypoints (time in s, height in m, tilt in rad, azimuth in rad) of a moving ring, which"
        " replace ring_height and tilt; without any, the ring is at rest",
    )
    coupling: float = quantity(
        1e-5, "J m^3", "mu0 m_ball m_ring/(4 pi) of a pair of dipoles", above=0
    )
    coulomb_friction: float = quantity(
        0.0, "1", "dry friction coefficient (surface plane)", at_least=0
    )
    torsional_friction: float = quantity(
        0.0, "m", "dry friction torque about the normal over load (surface plane)", at_least=0
    )
    rolling_friction: float = quantity(
        0.0, "m", "dry rolling friction torque over load (surface plane)", at_least=0
    )

    def __post_init__(self) -> None:
        """Check each field, by itself and against the others."""
        check_fields(self)
        lowest = 2 * self.ball_radius
        script = check_script(self.ring_script, lowest, self.tilt_azimuth)
        object.__setattr__(self, "ring_script", script)
        if not script:
            check_number("ring_height", self.ring_height, above=lowest, unit="m (the ball's top)")
        for time in [entry.time for entry in script] or [0.0]:
            height, tilt = self.ring_pose(time)
            if height <= self.ring_radius * math.sin(tilt):
                limit = math.asin(height / self.ring_radius)
                sentence = f"must be less than {limit:.4g} rad, where the ring touches the floor"
                raise ArgumentError("tilt", tilt, sentence)
        if not any(self.axis):
            raise ArgumentError("axis", self.axis, "must have a nonzero component")
        if self.inertia[2] > 2 * self.inertia[0]:
            limit = 2 * self.inertia[0]
            sentence = f"must be at most twice the moment across the axis, {limit:g} kg m^2"
            raise ArgumentError("ball_axial_inertia", self.inertia[2], sentence)
        if self.is_unbalanced:
            self._check_mass_distribution()
        self._check_dry_friction()
        self._check_surroundings()

    def _check_mass_distribution(self) -> None:
        """Check that a ball can have this center of mass and these products of inertia."""
        distance = math.hypot(*self.center_of_mass)
        if distance >= self.ball_radius:
            sentence = (
                f"must be within the ball: its distance, {distance:g} m, must be less than"
                f" {self.ball_radius:g} m"
            )
            raise ArgumentError("center_of_mass", self.center_of_mass, sentence)
        low, middle, high = np.linalg.eigvalsh(self.inertia_about_center_of_mass).tolist()
        if low <= 0:
            sentence = (
                f"must be smaller: the smallest principal moment, {low:g} kg m^2, must be greater"
                " than 0 kg m^2"
            )
            raise ArgumentError("products_of_inertia", self.products_of_inertia, sentence)
        if high > (low + middle) * (1 + ROUNDING):
            sentence = (
                f"must be smaller: the largest principal moment, {high:g} kg m^2, must be at most"
                f" the sum of the others, {low + middle:g} kg m^2"
            )
            raise ArgumentError("products_of_inertia", self.products_of_inertia, sentence)

    def _check_dry_friction(self) -> None:
        """Check the order: MuJoCo's rolling friction needs torsional, and that needs Coulomb's."""
        names = ("coulomb_friction", "torsional_friction", "rolling_friction")
        for i, (name, value) in enumerate(zip(names, self.dry_friction, strict=True)):
            if value > 0 and self.surface == "planar":
                raise ArgumentError(name, value, "must be zero unless surface = 'plane'")
            needed = value > 0 or any(self.dry_friction[i:])
            if needed and value < SMALLEST_DRY_FRICTION:
                bound = f"at least {SMALLEST_DRY_FRICTION:g}, MuJoCo's minimum,"
                others = " or ".join(names[i:])
                raise ArgumentError(name, value, f"must be {bound} if {others} is positive")

    @classmethod
    def paper(cls, case: int = 4, **changes: Any) -> "Top":
        """Return one of the paper's four simulations; `changes` replace fields."""
        cases: dict[int, dict[str, Any]] = {
            1: {"tilt": 0.0, "friction": 0.0, "position": (0.01, 0.005)},
            2: {"tilt": PAPER_TILT, "friction": 0.0, "position": (0.01, 0.005)},
            3: {"tilt": 0.0, "friction": 0.3, "position": (0.01, 0.005)},
            4: {"tilt": PAPER_TILT, "friction": 0.3, "position": (-0.05, 0.02)},
        }
        return cls(**(cases[check_integer("case", case, at_least=1, at_most=4)] | changes))

    @classmethod
    def si(cls, **changes: Any) -> "Top":
        """Return the fourth case with the paper's moments in SI: 100 times the coupling.

        As the ball moves out, the magnetic lift exceeds its weight, and a planar run stops. Use a
        larger `gravity` to hold the ball down, or `surface="plane"` to let it leave the plane
        until it falls into a dipole.
        """
        reading: dict[str, Any] = {"coupling": 1e-3}
        return cls(**(reading | changes))

    @classmethod
    def experiment(cls, **changes: Any) -> "Top":
        """Return the paper's experiment: the ring is lowered over the resting ball, then tilted.

        The ring descends from 0.6 m, where the ball is stable under the center, to the paper's
        height. The ball rolls out to the ring of minima; then the tilt makes it roll along that
        ring and spin.
        """
        script = (
            Waypoint(0.0, 0.6, 0.0),
            Waypoint(5.0, 0.2, 0.0),
            Waypoint(12.0, 0.2, 0.0),
            Waypoint(14.0, 0.2, PAPER_TILT),
        )
        start = {"position": (-0.01, 0.006), "ring_script": script}
        return cls(**(start | changes))

    @classmethod
    def turning(cls, seconds: float = 60.0, **changes: Any) -> Self:
        """Return a top whose tilt turns once around, and which starts at rest on the low side.

        Parameters
        ----------
        seconds : float
            Time in which the ring's normal turns around the vertical, from rest to rest.
        **changes
            Other fields, except `position`, `axis` and `ring_script`, which follow from them.
        """
        from magmotor.devices.ball.resting import resting_ball

        seconds = check_number("seconds", seconds, above=0, unit="s")
        for name in {"position", "axis", "ring_script"} & changes.keys():
            raise ArgumentError(name, changes[name], "must not be given: it follows from the tilt")
        still = cls(**changes)
        (x, y, _), axis = resting_ball(still)
        around = still.tilt_azimuth, still.tilt_azimuth + 2 * math.pi
        script = tuple(
            Waypoint(time, still.ring_height, still.tilt, azimuth)
            for time, azimuth in zip((0.0, seconds), around, strict=True)
        )
        return still.replace(
            position=(float(x), float(y)), axis=tuple(axis.tolist()), ring_script=script
        )

    @property
    def inertia(self) -> tuple[float, float, float]:
        """Moments of inertia (I, I, I_3) across and about xi_3, in kg m^2."""
        sphere = 0.4 * self.ball_mass * self.ball_radius**2
        across = sphere if self.ball_inertia is None else self.ball_inertia
        axial = sphere if self.ball_axial_inertia is None else self.ball_axial_inertia
        return across, across, axial

    @property
    def is_unbalanced(self) -> bool:
        """Whether the center of mass is not at the dipole, or xi_3 is not an axis of symmetry."""
        return any(self.center_of_mass) or any(self.products_of_inertia)

    def balanced(self) -> Self:
        """Return a copy whose center of mass is at the dipole and whose axis is one of symmetry."""
        zero = (0.0, 0.0, 0.0)
        return self.replace(center_of_mass=zero, products_of_inertia=zero)

    @property
    def inertia_about_center_of_mass(self) -> NDArray[np.float64]:
        """Inertia matrix about the center of mass in the ball's frame, (3, 3), in kg m^2."""
        xy, xz, yz = self.products_of_inertia
        return np.diag(self.inertia) + np.array([[0, xy, xz], [xy, 0, yz], [xz, yz, 0]])

    @property
    def mass_offsets(self) -> tuple[float, float]:
        """Distances of the center of mass from the dipole, across xi_3 and along it, in m."""
        x, y, z = self.center_of_mass
        return math.hypot(x, y), z

    @property
    def dry_friction(self) -> tuple[float, float, float]:
        """Coefficients of Coulomb (1), torsional (m) and rolling (m) friction."""
        return self.coulomb_friction, self.torsional_friction, self.rolling_friction

    @property
    def moment(self) -> float:
        """Magnetic moment of the ball and of each dipole of the ring, in A m^2."""
        return math.sqrt(self.coupling / PERMEABILITY_OVER_4PI)

    def ring_pose(self, time: float = 0.0) -> tuple[float, float]:
        """Height (m) and tilt (rad) of the ring at a time (s)."""
        height, tilt, _ = self._pose(time)
        return height, tilt

    def tilt_direction(self, time: float = 0.0) -> float:
        """Direction in which the ring's normal leans at a time (s), in rad."""
        return self._pose(time)[2]

    def _pose(self, time: float) -> tuple[Any, ...]:
        time = check_number("time", time)
        if self.ring_script:
            return pose(self.ring_script, time)
        return self.ring_height, self.tilt, self.tilt_azimuth

    def near_ring(self, time: float = 0.0) -> tuple[float, float]:
        """Radius and height of the ring, in m, at a time (s)."""
        return self.ring_radius, self.ring_pose(time)[0]

    def resting_place(self) -> tuple[float, float]:
        """Position on the plane, in m, of the ball at rest in the deepest minimum of V_e."""
        from magmotor.devices.ball.landscape import minimum

        return minimum(self).position

    def ring_orientation(self, time: float = 0.0) -> NDArray[np.float64]:
        """Orientation (w, x, y, z) of the ring at a time (s), turned about a horizontal axis."""
        _, tilt, azimuth = self._pose(time)
        half = tilt / 2
        return np.array(
            [
                math.cos(half),
                -math.sin(half) * math.sin(azimuth),
                math.sin(half) * math.cos(azimuth),
                0.0,
            ]
        )

    def ring_dipole_frame(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) and outward directions (N, 3) of the dipoles in the ring's own frame."""
        return ring_dipoles(self.ring_dipoles, self.ring_radius)

    def ring_sources(self, time: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) in meters and moments (N, 3) in A m^2 of the ring at a time (s)."""
        positions, directions = self.ring_dipole_frame()
        return self.in_world(positions, self.moment * directions, time)

    def in_world(
        self, positions: NDArray[np.float64], moments: NDArray[np.float64], time: float = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Transform positions (n, 3) in m and moments (n, 3) from ring frame to world frame."""
        positions = check_array("positions", positions, "n", 3)
        moments = check_array("moments", moments, "n", 3)
        rotation = _rotation_matrix(self.ring_orientation(time))
        positions = product(positions, rotation.T)
        positions[:, 2] += self.ring_pose(time)[0]
        return positions, product(moments, rotation.T)


def _rotation_matrix(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
