"""What gives a motor its temperature: a shaken plate, and a shaken damper of the inner ring."""

import math
from typing import NamedTuple

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import Positive, Seconds
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells
from magmotor.dipoles import PERMEABILITY_OVER_4PI


class Shaking(NamedTuple):
    """White velocity noise, alike in each direction, of what friction acts against.

    If friction is -c (V - u), where V is the slip and u the velocity of what it slips on, the force
    c u is the noise alpha dW/dt if u = (alpha/c) dW/dt. It acts where friction does.
    """

    density: float
    """Two-sided spectral density alpha^2/c^2 = 2 kT/c, in (m/s)^2/Hz or (rad/s)^2/Hz."""

    def speed(self, hold: float) -> float:
        """Return the root mean square of u in one direction if each value is held for `hold` s."""
        return math.sqrt(self.density / hold)

    def stroke(self, window: float) -> float:
        """Return the root mean square of the displacement in one direction, in m or rad.

        The noise is that of `BrownianPath.held` with a window of this many seconds.
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


@checked
def plate_shaking(scene: Motor) -> Shaking:
    """Return the motion of the plate that acts on the ball as the noise alpha_B does.

    Raises
    ------
    ValueError
        The ball has no friction.
    """
    return _shaking("friction_ball", scene.noises[0], scene.frictions[0])


@checked
def damper_shaking(scene: Motor) -> Shaking:
    """Return the rotation of the ring's damper that acts as the noise alpha_R does.

    Raises
    ------
    ValueError
        The ring has no friction.
    """
    return _shaking("friction_ring", scene.noises[-1], scene.frictions[-1])


def _shaking(name: str, noise: float, friction: float) -> Shaking:
    if not friction:
        raise reject(name, friction, "must be positive, or shaking has no effect")
    return Shaking((noise / friction) ** 2)


@checked
def axis_magnet(
    scene: Motor, *, moment: Positive, coil_radius: Positive, turns: Positive, hold: Seconds
) -> AxisMagnet:
    """Return what coils need in order to act on the inner ring as the noise alpha_R does.

    A uniform field does not turn a ring of outward dipoles, whose moments cancel. A magnet in the
    center of the ring, with its moment along the ring's axis, is turned about both horizontal axes.

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
    return AxisMagnet(torque, field, current, at_most * pair, at_most * moment)
