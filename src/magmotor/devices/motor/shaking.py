"""What gives a motor its temperature: a shaken plate, and a shaken damper of the inner ring."""

import math
from typing import NamedTuple

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Positive, Seconds
from magmotor.devices.ball.landscape import aligned_energy, valley
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells
from magmotor.dipoles import PERMEABILITY_OVER_4PI, pack_sources


class Shaking(NamedTuple):
    """White velocity noise, alike in each direction, of what friction acts against.

    If friction is -c (V - u), where V is the slip and u the velocity of what it slips on, the force
    c u is the noise alpha dW/dt if u = (alpha/c) dW/dt. It acts where friction does.
    """

    density: float
    """Two-sided spectral density alpha^2/c^2 = 2 kT/c, in (m/s)^2/Hz or (rad/s)^2/Hz."""

    @checked
    def speed(self, hold: Seconds) -> float:
        """Return the root mean square of u in one direction if each value is held for `hold` s."""
        return math.sqrt(self.density / hold)

    @checked
    def stroke(self, window: Seconds) -> float:
        """Return the root mean square displacement from the start in one direction, in m or rad.

        The noise is that of `BrownianPath.held` with a window of this many seconds, and the motion
        has lasted for longer than that. About the mean position, the root mean square is smaller by
        a factor of sqrt 2: the displacement is [B(t + window) - B(t) - B(window)]/sqrt 2, where B
        is a Brownian motion, and B(window) only moves the mean.
        """
        return math.sqrt(self.density * window)


class AxisMagnet(NamedTuple):
    """A magnet on the axis of the inner ring, in two crossed Helmholtz pairs."""

    torque: float
    """Root mean square of the torque about one horizontal axis, in N m."""
    field: float
    """Root mean square of the field of one pair at the magnet, in T."""
    current: float
    """Root mean square of the current in one pair, in A."""
    stray_field: float
    """Root mean square of the field of one pair at the ball, at most, in T."""
    magnet_field: float
    """Field of the magnet at the ball, at most, in T."""
    barrier: float
    """Barrier between two wells if the magnet points up, in J, to first order in its moment."""


@checked
def plate_shaking(scene: Motor) -> Shaking:
    """Return the motion of the plate that acts on the ball as the noise alpha_B does.

    Its density is zero if the ball has no noise.

    Raises
    ------
    ValueError
        The ball has no friction.
    """
    return _shaking("friction_ball", scene.noises[0], scene.frictions[0])


@checked
def damper_shaking(scene: Motor) -> Shaking:
    """Return the rotation of the ring's damper that acts as the noise alpha_R does.

    Its density is zero if the ring has no noise.

    Raises
    ------
    ValueError
        The ring has no friction.
    """
    return _shaking("friction_ring", scene.noises[-1], scene.frictions[-1])


def _shaking(name: str, noise: float, friction: float) -> Shaking:
    if not friction:
        raise ArgumentError(name, friction, "must be positive, or shaking has no effect")
    return Shaking((noise / friction) ** 2)


@checked
def axis_magnet(
    scene: Motor, *, moment: Positive, coil_radius: Positive, turns: Positive, hold: Seconds
) -> AxisMagnet:
    """Return what coils need in order to act on the inner ring as the noise alpha_R does.

    A uniform field does not turn a ring of outward dipoles, whose moments cancel. A magnet in the
    center of the ring, with its moment along the ring's axis, is turned about both horizontal axes.
    The magnet's own field is symmetric about the axis, so that it hardly changes the barrier.

    Parameters
    ----------
    scene : Motor
    moment : float
        Of the magnet, in A m^2.
    coil_radius : float
        Radius of the four coils, in m. A pair is one radius apart; its field at the center is
        (4/5)^(3/2) mu0 turns current/radius.
    turns : float
        Of each coil.
    hold : float
        Time in s for which each value of the torque is held.
    """
    torque = scene.noises[-1] / math.sqrt(hold)
    field = torque / moment
    mu0 = 4 * math.pi * PERMEABILITY_OVER_4PI
    current = field * coil_radius / (0.8**1.5 * mu0 * turns)
    height = scene.inner_height - scene.ball_radius
    distance = math.hypot(motor_wells(scene).radius, height)
    at_most = 2 * PERMEABILITY_OVER_4PI / distance**3
    pair = 2 * turns * current * math.pi * coil_radius**2
    return AxisMagnet(
        torque, field, current, at_most * pair, at_most * moment, _barrier_with(scene, moment)
    )


def _barrier_with(scene: Motor, moment: float) -> float:
    """Return the barrier with an upward moment in the center of the inner ring.

    As in `bill_of_materials`, the ball's magnet has sqrt(ball_ring_factor) of the scene's moment.
    """
    positions, moments = scene.ring_sources()
    upward = [0.0, 0.0, math.sqrt(scene.ball_ring_factor) * moment]
    sources = pack_sources(
        np.vstack([positions, [0.0, 0.0, scene.inner_height]]),
        np.vstack([moments, upward]),
    )
    points = valley(scene, np.array([0.0, math.pi / scene.outer_dipoles]))
    well, top = aligned_energy(scene, points, sources)
    return float(top - well)
