"""How accurately a motor must be built: what changes its potential by as much as a barrier."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import aligned_energy, on_plane, total_field, valley
from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells
from magmotor.dipoles import pack_sources

AZIMUTHS = 90
"""Points around the valley; the effects vary once around it, or near one magnet."""

SMALL = 1e-4
"""Size of the change, relative to that of order one, by which its effect is differentiated."""


class Tolerances(NamedTuple):
    """Sizes of effects that tilt the valley by one barrier between two wells.

    Each size makes the largest minus the smallest change of the energy around the valley equal to
    the barrier, to first order.
    """

    floor_tilt: float
    """Angle by which the floor descends, in rad."""
    background_field: float
    """Horizontal field on a ball of the scene's `moment`, in T."""
    ring_lean: float
    """Angle by which the inner ring leans, in rad."""
    inner_center_of_mass: float
    """Distance of the inner ring's center of mass from its axis that causes this lean, in m.

    Only the outer ring resists. It is 0 if the level ring is unstable.
    """
    inner_moment: float
    """Relative error of the moment of one magnet of the inner ring."""
    inner_place: float
    """Error of the radius at which one magnet of the inner ring sits, in m."""
    center_of_mass: float
    """Distance of the ball's center of mass from the line of its dipole through the center, in m.
    """
    rolling_friction: float
    """Torque over load, in m, of a dry friction that takes this energy in each turn."""


@checked
def motor_tolerances(scene: Motor) -> Tolerances:
    """Return how accurately a motor must be built and set up.

    A tilt of the floor and a background field of the scene are left out. Energies are those of a
    ball at rest in the valley, whose axis follows the field. If the center of mass is beside the
    dipole, its height changes by twice its distance times the sine of the axis's angle from the
    vertical as the ball rolls half a turn about its axis.
    """
    scene = scene.replace(floor_tilt=(0.0, 0.0), background_field=(0.0, 0.0, 0.0))
    around = 2 * math.pi * np.arange(AZIMUTHS) / AZIMUTHS
    points = valley(scene, around)
    positions, moments = scene.ring_sources()
    inner = np.arange(len(positions)) < scene.inner_dipoles
    barrier = abs(motor_wells(scene).barrier)

    def largest(changed: Callable[[float], tuple[Array, Array]], size: float) -> float:
        sources = (pack_sources(*changed(sign * SMALL * size)) for sign in (1, -1))
        up, down = (aligned_energy(scene, points, each) for each in sources)
        return 2 * SMALL * size * barrier / float(np.ptp(up - down))

    def leaning(angle: float) -> tuple[Array, Array]:
        turned, center = Rotation.from_rotvec([0.0, angle, 0.0]), [0.0, 0.0, scene.inner_height]
        places = np.where(inner[:, None], turned.apply(positions - center) + center, positions)
        return places, np.where(inner[:, None], turned.apply(moments), moments)

    def stronger(part: float) -> tuple[Array, Array]:
        return positions, moments * np.where(np.arange(len(moments)) == 0, 1 + part, 1)[:, None]

    def outward(shift: float) -> tuple[Array, Array]:
        return positions + np.outer(np.arange(len(moments)) == 0, [shift, 0.0, 0.0]), moments

    field = total_field(scene, on_plane(scene, points), pack_sources(positions, moments))
    axis = field / np.linalg.norm(field, axis=1, keepdims=True)
    lean = float(np.hypot(*axis[0, :2]))
    ring_lean, ring_weight = largest(leaning, 1.0), scene.inner_mass * scene.gravity
    way = 2 * math.pi * float(np.hypot(*points[0]))
    return Tolerances(
        floor_tilt=barrier / (scene.weight * float(np.ptp(points[:, 0]))),
        background_field=barrier / (scene.moment * float(np.ptp(axis[:, 0]))),
        ring_lean=ring_lean,
        inner_center_of_mass=ring_lean * max(ring_stiffness(scene), 0.0) / ring_weight,
        inner_moment=largest(stronger, 1.0),
        inner_place=largest(outward, scene.inner_radius),
        center_of_mass=barrier / (2 * scene.weight * lean),
        rolling_friction=barrier * scene.ball_radius / (scene.weight * way),
    )
