"""Closed forms for the motor: injection rates, wells, and small motions."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.hints import Seconds
from magmotor.devices.ball.landscape import effective_potential, valley_radius
from magmotor.devices.ball.resting import (
    background_drag,
    moved,
    resting_ball,
    scales,
    slip_friction,
    stiffness,
)
from magmotor.devices.ball.slip import mobility
from magmotor.devices.motor.scene import Motor
from magmotor.numerics.linear_stability import SmallMotion


@checked
def slip_mobility(scene: Motor) -> float:
    """Slip acceleration per force on the contact point, A = 1/m + r^2/J_B in 1/kg.

    The ball rotates freely; the field, which holds its axis, makes the slip decay more slowly.
    """
    return mobility(scene.ball_mass, scene.ball_radius, scene.ball_inertia)


@checked
def ball_injection_rate(scene: Motor) -> float:
    """Mean power alpha_B^2 (1/m + r^2/J_B) of the noise on the ball in W; remark after (kjhss).

    With background drag, its noise adds alpha^2/m for the translation and 3 alpha^2/(2 J_B) for the
    rotation.
    """
    drag, rotational_drag = scene.drag_noises
    drags = drag**2 / scene.ball_mass + 1.5 * rotational_drag**2 / scene.ball_inertia
    return scene.noises[0] ** 2 * slip_mobility(scene) + drags


@checked
def ring_injection_rate(scene: Motor) -> float:
    """Mean power (alpha_R^2/2) tr(I_R^-1) of the noise on the ring in W; both remarks on E."""
    return scene.noises[-1] ** 2 / 2 * sum(1 / moment for moment in scene.inner_moments)


class MotorWells(NamedTuple):
    """The wells of V_e under the outer dipoles, in the valley under a level inner ring."""

    azimuth: NDArray[np.float64]
    """Azimuths 2 pi k/M of the wells in rad."""
    radius: float
    """Distance of the first well from the center in m."""
    energy: float
    """V_e in the first well in J."""
    barrier: float
    """V_e halfway between the first two wells minus `energy`, in J."""


@checked
def motor_wells(scene: Motor) -> MotorWells:
    """Compute the wells that the ball passes on its way around.

    The first dipoles of both rings are at the same azimuth. Rotation of the inner ring changes the
    ripple of the potential, which is small if the inner ring has many dipoles.
    """
    azimuth = 2 * math.pi * np.arange(scene.outer_dipoles) / scene.outer_dipoles
    well, saddle = 0.0, math.pi / scene.outer_dipoles
    radius = valley_radius(scene, well)
    energy, top = (_valley_energy(scene, angle) for angle in (well, saddle))
    return MotorWells(azimuth, radius, energy, top - energy)


def _valley_energy(scene: Motor, azimuth: float) -> float:
    radius = valley_radius(scene, azimuth)
    point = radius * np.array([math.cos(azimuth), math.sin(azimuth)])
    return float(effective_potential(scene, point))


@checked
def euler_slip_overheating(scene: Motor, timestep: Seconds) -> float:
    """Factor 1/(1 - lambda h/2) by which explicit Euler overheats the slip, lambda = c_B A.

    It applies to the slip by itself, V' = (1 - lambda h) V + alpha A sqrt(h) N(0, 1).

    Raises
    ------
    ValueError
        The step is not in (0, 2/lambda).
    """
    rate = scene.friction_ball * slip_mobility(scene)
    check_number("timestep", timestep, above=0, below=2 / rate if rate else np.inf, unit="s")
    return 1 / (1 - rate * timestep / 2)


def small_motion(scene: Motor) -> SmallMotion:
    """Linearize about rest: x, y, rotations of the ball and of the ring about x, y, z."""
    position, axis = resting_ball(scene)
    center = np.array([0.0, 0.0, scene.inner_height])
    arms, outward = scene.inner_dipole_frame()
    ring, outer = (arms, scene.ball_ring_factor * scene.moment * outward), scene.outer_sources()

    def force(q: Array) -> Array:
        ball, moment = moved(scene, position, axis, q)
        rotation = Rotation.from_rotvec(q[:, 5:8])
        inverse, transposed = rotation.inv(), rotation.as_matrix().swapaxes(1, 2)
        by_ring = dipoles.wrench(inverse.apply(ball - center), inverse.apply(moment), *ring)
        push, twist = (rotation.apply(part) for part in by_ring)
        on_ring = -np.cross(ball - center, push) - twist
        inner_arms, inner_moments = arms @ transposed, scene.moment * outward @ transposed
        pushes, twists = dipoles.wrench(inner_arms + center, inner_moments, *outer)
        on_ring += np.sum(np.cross(inner_arms, pushes) + twists, axis=1)
        outer_push, outer_twist = dipoles.wrench(ball, moment, *outer)
        twist = twist + outer_twist + np.cross(moment, scene.background_field)
        return np.hstack([(push + outer_push)[:, :2], twist, on_ring])

    sphere = scene.ball_inertia
    inertia = np.diag([scene.ball_mass, scene.ball_mass, *3 * [sphere], *scene.inner_moments])
    damper = np.diag([0.0] * 5 + [scene.frictions[-1]] * 3) + background_drag(scene, 8)
    friction = slip_friction(scene.friction_ball, scene.ball_radius, 8) + damper
    return SmallMotion.of(inertia, stiffness(force, scales(scene, 8)), friction, damper)
