"""The motor at the size at which its temperature is that of a living cell.

The paper expects its mechanism to be "sufficient for intracellular transport". The dimensionless
groups of the motor decide: at a given magnetization, its kT grows with its volume, so that 300 K
fixes its size, and everything else follows.
"""

import math
from typing import NamedTuple

from scipy import constants

from magmotor.devices.motor.scene import Motor

GRADE, ROOM = "N42", 300.0
"""The strongest of common magnets, and a temperature in K."""

WATER, AIR_SPEED = 1e-3, 2e-3
"""Viscosity in Pa s; speed in m/s of the paper's ball, for its drag in air."""

NITROGEN = 28.0 * constants.atomic_mass
"""Mass of a molecule, in kg."""

HAMAKER, GAP = 1e-19, 3e-10
"""Hamaker constant in J, and distance of surfaces in contact in m, typical of solids."""


class MolecularMotor(NamedTuple):
    """A motor of full-strength magnets with the paper's groups at room temperature."""

    inner_radius: float
    """in m"""
    ball_radius: float
    """in m"""
    ball_mass: float
    """in kg"""
    time: float
    """unit of time of the groups, in s"""
    water: float
    """rate at which water damps rolling, over the rate at which air does at the paper's size, each
    in the units of its motor: the latter already halves the paper's flights"""
    pressure: float
    """of a gas that damps rolling like that air, in Pa"""
    adhesion: float
    """energy of the ball on its plane by van der Waals forces, over kT"""


def molecular_motor(temperature: float = ROOM, grade: str = GRADE) -> MolecularMotor:
    """Return the motor whose kT is that of a temperature.

    With the groups and the magnetization, mass and kT grow with the cube of the size, and the unit
    of time with the size.

    Parameters
    ----------
    temperature : float
        In K.
    grade : str
        Material of the magnets, as in `Motor.desk`.

    Raises
    ------
    ValueError
        The grade is unknown.
    """
    kT = constants.k * temperature
    large = Motor.desk(inner_radius=1.0, grade=grade, magnet_fraction=1.0)
    size = math.cbrt(kT / large.kT)
    radius, mass, time = (
        size * large.ball_radius,
        size**3 * large.ball_mass,
        size * large.units.time,
    )
    paper = Motor().in_air(AIR_SPEED)
    allowed = (
        paper.units.time
        / time
        * rolling_rate(paper.drag, paper.rotational_drag, paper.ball_mass, paper.ball_radius)
    )
    stokes = 6 * math.pi * WATER * radius, 8 * math.pi * WATER * radius**3
    return MolecularMotor(
        size,
        radius,
        mass,
        time,
        rolling_rate(*stokes, mass, radius) / allowed,
        allowed / rolling_rate(*rarefied_drag(radius, temperature), mass, radius),
        HAMAKER * radius / (6 * GAP) / kT,
    )


def rolling_rate(drag: float, rotational_drag: float, mass: float, radius: float) -> float:
    """Return the rate in 1/s at which drag (kg/s; kg m^2/s) damps a rolling ball's velocity."""
    return (drag + rotational_drag / radius**2) / (1.4 * mass)


def rarefied_drag(radius: float, temperature: float) -> tuple[float, float]:
    """Return the drag of a rarefied gas on a sphere, and on its rotation, over its pressure.

    Molecules that the sphere reflects diffusely exert the drag 4 pi/3 (1 + pi/8) rho c r^2 v and
    the torque 2 pi/3 rho c r^4 omega, with the density rho and the mean speed c (P. S. Epstein,
    Phys. Rev. 23, 710, 1924).
    """
    kT = constants.k * temperature
    density_times_speed = NITROGEN / kT * math.sqrt(8 * kT / (math.pi * NITROGEN))
    sliding = 4 * math.pi / 3 * (1 + math.pi / 8) * density_times_speed * radius**2
    return sliding, 2 * math.pi / 3 * density_times_speed * radius**4
