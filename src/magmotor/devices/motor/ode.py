"""The motor without noise: the paper's equations, with orientations as quaternions."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.ball.rigid_forces import wrenches
from magmotor.devices.ball.states import axes
from magmotor.devices.motor.reference import bodies, magnets, unpack
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates
from magmotor.numerics.compiled import compiled_once
from magmotor.numerics.rotations import product, scaled, stretched, third_axis

Array = NDArray[np.float64]


def problem(scene: Motor, initial: MotorStates) -> tuple[Callable, Array, Array]:
    """Right-hand side, initial state and scales of position, velocity, and so on.

    The state is place, velocity, orientation and angular velocity of the ball, orientation and
    angular momentum of the ring, and the heat of both.
    """
    evaluate = _derivative()
    numbers = bodies(scene), magnets(scene)

    def derivative(t, y):
        return evaluate(y, *numbers)

    across, _, axial = scene.inner_moments
    first = MotorStates(*[column[-1] for column in initial])
    turn, spin = first.ring_orientation[0], first.ring_angular_velocity[0]
    axis = axes(turn)
    momentum = across * spin + (axial - across) * (axis @ spin) * axis
    state = [
        first.position[0, :2], first.velocity[0, :2], first.orientation[0],
        first.angular_velocity[0], turn, momentum, first.ball_heat, first.ring_heat,
    ]  # fmt: skip
    energy = scene.coupling / scene.inner_height**3
    speed, spin = np.sqrt(energy / scene.ball_mass), np.sqrt(energy / scene.ball_inertia)
    scales = [scene.ball_radius, speed, 1.0, spin, 1.0, np.sqrt(energy * across), energy]
    return derivative, np.concatenate(state), np.repeat(scales, [2, 2, 4, 3, 4, 3, 2])


@compiled_once(error_model="numpy")
def _derivative(checksum: int):
    """The right-hand side."""

    def derivative(s, bodies, magnets):
        _ = checksum
        r, c, c_ring = bodies.radius, bodies.slip_friction, bodies.ring_friction
        ball, omega = (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10])
        ring, pi = (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17])
        work = np.empty_like(magnets.frame)
        work[6] = magnets.frame[6]
        force, torque, on_ring = wrenches((s[0], s[1], r), ball, ring, work, magnets)
        spin = stretched(pi, third_axis(ring), 1.0 / bodies.across, 1.0 / bodies.axial)
        slip_x, slip_y = s[2] - r * omega[1], s[3] + r * omega[0]
        out = np.empty(20)
        out[0], out[1] = s[2], s[3]
        out[2] = (force[0] - c * slip_x) / bodies.mass
        out[3] = (force[1] - c * slip_y) / bodies.mass
        out[4], out[5], out[6], out[7] = product((0.0, *scaled(0.5, omega)), ball)
        out[8] = (torque[0] - r * c * slip_y) / bodies.inertia
        out[9] = (torque[1] + r * c * slip_x) / bodies.inertia
        out[10] = torque[2] / bodies.inertia
        out[11], out[12], out[13], out[14] = product((0.0, *scaled(0.5, spin)), ring)
        for k in range(3):
            out[15 + k] = on_ring[k] - c_ring * spin[k]
        out[18] = c * (slip_x * slip_x + slip_y * slip_y)
        out[19] = c_ring * (spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2])
        return out

    return derivative


def states(scene: Motor, time: Array, rows: Array) -> MotorStates:
    """Recorded states from rows of the solution."""
    across, _, axial = scene.inner_moments
    turn, momentum = rows[:, 11:15], rows[:, 15:18]
    axis = axes(turn)
    along = np.sum(momentum * axis, axis=1, keepdims=True)
    spin = momentum / across + (1 / axial - 1 / across) * along * axis
    none = np.zeros((len(rows), 2))
    whole = np.hstack([rows[:, :15], spin, rows[:, 18:], none])
    return unpack(time, whole[:, np.newaxis], scene.ball_radius)
