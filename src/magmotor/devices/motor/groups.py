"""The dimensionless groups of the motor, and the motor of the same groups at another size."""

import math
from typing import Any, NamedTuple, TypeVar

from magmotor.common.checks import check_choice, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.devices.motor.parameters import MotorParameters
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.mjcf.magnets.grades import GRADES

M = TypeVar("M", bound=MotorParameters)


class MotorGroups(NamedTuple):
    """What decides the motion of a motor, in units of its own.

    The units are the radius L of the inner ring, the mass m of the ball, the energy k/L^3 of the
    coupling k, and the time T_0 = sqrt(m L^5/k). Drag, tilt of the floor, background field and load
    are left out; the weight matters only for whether the ball stays on its plane.
    """

    ball_radius: float
    inner_height: float
    outer_radius: float
    outer_height: float
    inner_mass: float
    inner_inertia: float
    inner_axial_inertia: float
    friction_ball: float
    friction_ring: float
    noise_ball: float
    """alpha_B^2 over friction unit and energy unit; with the friction, 2 kT c."""
    noise_ring: float
    weight: float
    """m g over the unit of force."""


class MotorUnits(NamedTuple):
    """The units of a motor's groups."""

    length: float
    """In m."""
    mass: float
    """In kg."""
    time: float
    """In s."""

    @property
    def energy(self) -> float:
        """In J."""
        return self.mass * (self.length / self.time) ** 2


def motor_units(scene: MotorParameters) -> MotorUnits:
    """Return the units of a motor's groups."""
    length, mass = scene.inner_radius, scene.ball_mass
    return MotorUnits(length, mass, math.sqrt(mass * length**5 / scene.coupling))


def motor_groups(scene: MotorParameters) -> MotorGroups:
    """Return the dimensionless groups of a motor."""
    unit = motor_units(scene)
    length, inertia = unit.length, unit.mass * unit.length**2
    friction = unit.mass / unit.time
    across, _, axial = scene.inner_moments
    return MotorGroups(
        ball_radius=scene.ball_radius / length,
        inner_height=scene.inner_height / length,
        outer_radius=scene.outer_radius / length,
        outer_height=scene.outer_height / length,
        inner_mass=scene.inner_mass / unit.mass,
        inner_inertia=across / inertia,
        inner_axial_inertia=axial / inertia,
        friction_ball=scene.frictions[0] / friction,
        friction_ring=scene.frictions[-1] / (inertia / unit.time),
        noise_ball=scene.noises[0] ** 2 / (friction * unit.energy),
        noise_ring=scene.noises[-1] ** 2 / (friction * length**2 * unit.energy),
        weight=scene.weight * length / unit.energy,
    )


def resized(scene: M, inner_radius: float, grade: str, magnet_fraction: float) -> M:
    """Return the motor with the same groups, but for the weight, with other magnets.

    Parameters
    ----------
    scene : Motor
        Without drag, tilt of the floor and background field.
    inner_radius : float
        In m.
    grade : str
        Material of the magnets, such as "N42".
    magnet_fraction : float
        Part of the ball's volume that is a magnet. The rest has the magnet's density, so that the
        moment of inertia is that of a uniform ball.
    """
    length = check_number("inner_radius", inner_radius, above=0, unit="m")
    check_choice("grade", grade, tuple(GRADES))
    part = check_number("magnet_fraction", magnet_fraction, above=0)
    if part > 1:
        raise ArgumentError("magnet_fraction", magnet_fraction, "must be at most 1")
    remanence, density = GRADES[grade]
    groups, radius = motor_groups(scene), scene.ball_radius * length / scene.inner_radius
    volume = 4 / 3 * math.pi * radius**3
    moment = remanence * part * volume / (4 * math.pi * PERMEABILITY_OVER_4PI)
    mass, coupling = density * volume, PERMEABILITY_OVER_4PI * moment**2 / scene.ball_ring_factor
    unit = MotorUnits(length, mass, math.sqrt(mass * length**5 / coupling))
    friction, inertia = mass / unit.time, mass * length**2
    fields: dict[str, Any] = {
        "ball_radius": radius,
        "ball_mass": mass,
        "coupling": coupling,
        "inner_radius": length,
        "inner_height": groups.inner_height * length,
        "inner_mass": groups.inner_mass * mass,
        "inner_inertia": groups.inner_inertia * inertia,
        "inner_axial_inertia": groups.inner_axial_inertia * inertia,
        "outer_radius": groups.outer_radius * length,
        "outer_height": groups.outer_height * length,
        "friction_ball": groups.friction_ball * friction,
        "friction_ring": groups.friction_ring * friction * length**2,
        "alpha_ball": math.sqrt(groups.noise_ball * friction * unit.energy),
        "alpha_ring": math.sqrt(groups.noise_ring * friction * length**2 * unit.energy),
    }
    return scene.replace(**fields)
