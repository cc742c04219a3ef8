"""The parts of a motor of permanent magnets."""

import math
from dataclasses import dataclass

from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.devices.motor.parameters import MotorParameters
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.mjcf.magnets.grades import GRADES

LEAST_OCTUPOLE = math.sqrt(3) / 2
"""Height over diameter of a cylinder without an octupole: it acts as a dipole, like a sphere."""


@dataclass(frozen=True)
class RingMagnets:
    """The magnets of one ring, each of which has the moment of a dipole.

    Attributes
    ----------
    count : int
    moment : float
        Of each, in A m^2.
    cube : float
        Edge of each in m if it is a cube.
    cylinder : tuple of float
        Diameter and height of each in m if it is a cylinder, magnetized along its axis.
    mass : float
        Of each, in kg.
    """

    count: int
    moment: float
    cube: float
    cylinder: tuple[float, float]
    mass: float


@dataclass(frozen=True)
class BillOfMaterials:
    """What a motor is made of; `print` shows it.

    Attributes
    ----------
    grade : str
        Material of all magnets.
    ball_diameter, ball_mass : float
        In m and kg.
    ball_moment : float
        In A m^2.
    ball_magnet_diameter, ball_magnet_mass : float
        Of the spherical magnet in the center of the ball, in m and kg.
    shell_density : float
        Density of the rest of the ball in kg/m^3; 0 if there is no rest.
    ball_inertia_excess : float
        Relative excess of the ball's moment of inertia over 2/5 m r^2.
    inner, outer : RingMagnets
    carrier_mass : float
        What the inner ring has for its hoop, spokes and hub, in kg.
    carrier_inertia : float
        What the inner ring has for them of its moment of inertia about its axis, in kg m^2; the
        magnets count as points.
    """

    grade: str
    ball_diameter: float
    ball_mass: float
    ball_moment: float
    ball_magnet_diameter: float
    ball_magnet_mass: float
    shell_density: float
    ball_inertia_excess: float
    inner: RingMagnets
    outer: RingMagnets
    carrier_mass: float
    carrier_inertia: float

    def __str__(self) -> str:
        """One line for each part."""
        lines = [f"ball: {1e3 * self.ball_diameter:.1f} mm, {1e3 * self.ball_mass:.1f} g"]
        lines.append(
            f"  magnet: a sphere of {1e3 * self.ball_magnet_diameter:.1f} mm of {self.grade},"
            f" {1e3 * self.ball_magnet_mass:.1f} g, {self.ball_moment:.2f} A m²"
        )
        lines.append(f"  shell: {1e-3 * self.shell_density:.2f} g/cm³")
        for name, ring in (("inner", self.inner), ("outer", self.outer)):
            diameter, height = (1e3 * length for length in ring.cylinder)
            lines.append(
                f"{name} ring: {ring.count} magnets of {self.grade}, {ring.moment:.2f} A m²,"
                f" {1e3 * ring.mass:.1f} g each, {1e3 * ring.count * ring.mass:.0f} g together"
            )
            lines.append(
                f"  cubes of {1e3 * ring.cube:.1f} mm, or cylinders of {diameter:.1f} mm x"
                f" {height:.1f} mm"
            )
        lines.append(
            f"  left for what carries the inner magnets: {1e3 * self.carrier_mass:.0f} g,"
            f" {1e3 * self.carrier_inertia:.1f} g m² about the axis"
        )
        return "\n".join(lines)


def bill_of_materials(scene: MotorParameters, grade: str) -> BillOfMaterials:
    """See `Motor.bill_of_materials`."""
    check_choice("grade", grade, tuple(GRADES))
    remanence, density = GRADES[grade]
    root = math.sqrt(scene.ball_ring_factor)
    strong, weak = scene.moment * root, scene.moment / root

    def volume(moment: float) -> float:
        return 4 * math.pi * PERMEABILITY_OVER_4PI * moment / remanence

    def ring(count: int, moment: float) -> RingMagnets:
        size = volume(moment)
        diameter = (4 * size / (math.pi * LEAST_OCTUPOLE)) ** (1 / 3)
        cylinder = diameter, LEAST_OCTUPOLE * diameter
        return RingMagnets(count, moment, size ** (1 / 3), cylinder, density * size)

    magnet = density * volume(strong)
    radius, whole = (3 * volume(strong) / (4 * math.pi)) ** (1 / 3), scene.ball_radius
    inner = ring(scene.inner_dipoles, strong)
    carrier = scene.inner_mass - inner.count * inner.mass
    rest = 4 / 3 * math.pi * (whole**3 - radius**3)
    small = 1e-9 * scene.ball_mass
    if rest < -small / density or magnet > scene.ball_mass + small:
        sentence = f"its magnet of {2e3 * radius:.3g} mm and {1e3 * magnet:.3g} g does not fit"
        size = f"a ball of {2e3 * whole:.3g} mm and {1e3 * scene.ball_mass:.3g} g"
        raise ArgumentError("grade", grade, f"must be stronger: {sentence} into {size}")
    if carrier < 0:
        most = strong * scene.inner_mass / (inner.count * inner.mass)
        total = f"{inner.count} magnets weigh {inner.count * inner.mass:.3g} kg"
        sentence = f"must be at most {most:.3g} A m^2 with this grade: {total}, but the inner ring"
        name = "moment of each inner magnet"
        raise ArgumentError(name, strong, f"{sentence} has {scene.inner_mass:.3g} kg")
    shell = max(scene.ball_mass - magnet, 0.0)
    filled = rest > small / density
    across = 0.4 * magnet * radius**2
    if filled:
        across += 0.4 * shell * (whole**5 - radius**5) / (whole**3 - radius**3)
    return BillOfMaterials(
        grade=grade,
        ball_diameter=2 * whole,
        ball_mass=scene.ball_mass,
        ball_moment=strong,
        ball_magnet_diameter=2 * radius,
        ball_magnet_mass=magnet,
        shell_density=shell / rest if filled else 0.0,
        ball_inertia_excess=across / scene.ball_inertia - 1,
        inner=inner,
        outer=ring(scene.outer_dipoles, weak),
        carrier_mass=carrier,
        carrier_inertia=scene.inner_moments[2] - inner.count * inner.mass * scene.inner_radius**2,
    )
