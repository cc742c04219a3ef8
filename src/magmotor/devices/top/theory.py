"""Closed forms for Hamel's top, each with its source in the paper."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.hints import NotNegative
from magmotor.devices.ball.resting import (
    background_drag,
    moved,
    resting_ball,
    scales,
    slip_friction,
    stiffness,
)
from magmotor.devices.ball.slip import mobility
from magmotor.devices.top import unbalanced
from magmotor.devices.top.scene import Top
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.numerics.linear_stability import SmallMotion


@checked
def field_under_center(scene: Top) -> float:
    """Compute |B| in tesla at the height of the ball's center, under the center of a level ring.

    B_z = 3 N (mu0 m/(4 pi)) R h/(R^2 + h^2)^(5/2), h = H - r: the sum of (magneticfield) over the
    ring, exact for any number N of dipoles.
    """
    height = scene.ring_height - scene.ball_radius
    strength = PERMEABILITY_OVER_4PI * scene.moment * scene.ring_dipoles
    distance = math.hypot(scene.ring_radius, height)
    return 3 * strength * scene.ring_radius * abs(height) / distance**5


@checked
def libration_frequency(scene: Top, field: NotNegative) -> float:
    """Angular frequency sqrt(m |B|/I) in rad/s at which the axis swings about a field (tesla).

    It follows from the linearized Lie-Poisson equation (magtopc) of a balanced ball that does not
    spin.
    """
    return math.sqrt(scene.moment * field / scene.inertia[0])


@checked
def slip_relaxation_rate(scene: Top) -> float:
    """Rate c (1/m + r^2/I) in 1/s at which friction alone makes the slip velocity decay.

    The ball is balanced and rotates freely; if the field holds its axis, the slip decays more
    slowly. The rate follows from (magtopnc): dV_Q/dt = -c V_Q/m + (torque r c V_Q)/I in the plane.
    """
    return scene.friction * mobility(scene.ball_mass, scene.ball_radius, scene.inertia[0])


@checked
def highest_valley(scene: Top) -> float:
    """Height of a level ring, in m, above which the ball is stable under the center of the ring.

    Below this height, the effective potential has a maximum there and a circular valley around it.
    Near the axis B.B = f^2 + rho^2 (f'^2/4 - f f''/2) with f = B_z on the axis, the field of
    `field_under_center`; the bracket vanishes at (H - r)/R = sqrt((11 + sqrt(145))/24) = 0.980.
    """
    return scene.ball_radius + math.sqrt((11 + math.sqrt(145)) / 24) * scene.ring_radius


def small_motion(scene: Top) -> SmallMotion:
    """Linearize about rest in the deepest minimum of V_e: x, y and rotations about x, y, z."""
    across, _, axial = scene.inertia
    position, axis = resting_ball(scene)
    sources = scene.ring_sources()
    inertia = scene.ball_mass * np.eye(5)
    inertia[2:, 2:] = across * np.eye(3) + (axial - across) * np.outer(axis, axis)
    lever, weight = np.zeros(3), scene.ball_mass * np.array(scene.gravity_vector)
    if scene.is_unbalanced:
        rotation = unbalanced.resting_rotation(scene)
        lever = rotation.apply(scene.center_of_mass)[0]
        inertia = unbalanced.planar_mass_matrix(scene, rotation)[0]

    def force(q: Array) -> Array:
        centers, moments = moved(scene, position, axis, q)
        push, twist = dipoles.wrench(centers, moments, *sources)
        twist = twist + np.cross(moments, scene.background_field)
        if lever.any():
            turned: Array = Rotation.from_rotvec(q[:, 2:5]).apply(lever)
            twist = twist + np.cross(turned, weight)
        return np.hstack([push[:, :2], twist])

    friction = slip_friction(scene.friction, scene.ball_radius, 5)
    friction[4, 4] += scene.torsional_damping
    damper = background_drag(scene, 5)
    return SmallMotion.of(inertia, stiffness(force, scales(scene, 5)), friction + damper, damper)


def poses(scene: Top) -> list[Top]:
    """Return the scene with its ring at rest, once for each waypoint if it has a script.

    Waypoints at which the ball would find no rest are left out, unless it finds none at any.
    """
    still = [
        scene.replace(ring_script=(), ring_height=height, tilt=tilt, tilt_azimuth=azimuth)
        for _, height, tilt, azimuth in scene.ring_script
    ] or [scene]
    return [pose for pose in still if _finds_rest(pose)] or still


def _finds_rest(scene: Top) -> bool:
    try:
        resting_ball(scene)
    except ValueError:
        return False
    return True
