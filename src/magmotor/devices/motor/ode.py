"""The paper's equations of the motor without noise, with orientations as quaternions.

The forces are computed independently of the integrators that are tested against this solution.
"""

from collections.abc import Callable

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.ball.states import axes
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates
from magmotor.dipoles import NOBODY, pack_sources, sum_over_sources
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.rotations import (
    columns,
    cross,
    dot,
    mul_quat,
    place_dipoles,
    plus,
    scaled,
    stretched,
    third_axis,
)


def problem(scene: Motor, initial: MotorStates) -> tuple[Callable, Array, Array]:
    """Return right-hand side, initial state and scales.

    The state consists of position, velocity, orientation and angular velocity of the ball,
    orientation and angular momentum of the ring, and the heat of both.
    """
    across, _, axial = scene.inner_moments
    arms, outward = scene.inner_dipole_frame()
    evaluate = _derivative()
    numbers = (
        (scene.ball_mass, scene.ball_radius, scene.ball_inertia, across, axial),
        (float(scene.frictions[0]), float(scene.frictions[-1])),
        scene.moment,
        (
            pack_sources(*scene.outer_sources()),
            pack_sources(arms, scene.moment * outward),
            scene.inner_height,
            float(scene.ball_ring_factor),
        ),
        (
            *map(float, scene.background_field),
            *map(float, scene.downhill_force[:2]),
            float(scene.drag),
            float(scene.rotational_drag),
            float(scene.load_torque),
        ),
    )

    def derivative(t, y):
        return evaluate(y, *numbers)

    first = MotorStates(*[column[-1] for column in initial])
    orientation, spin = first.ring_orientation[0], first.ring_angular_velocity[0]
    axis = axes(orientation)
    momentum = across * spin + (axial - across) * (axis @ spin) * axis
    state = [
        first.position[0, :2], first.velocity[0, :2], first.orientation[0],
        first.angular_velocity[0], orientation, momentum, first.ball_heat, first.ring_heat,
    ]  # fmt: skip
    energy = scene.coupling / scene.inner_height**3
    speed, spin = np.sqrt(energy / scene.ball_mass), np.sqrt(energy / scene.ball_inertia)
    scales = [scene.ball_radius, speed, 1.0, spin, 1.0, np.sqrt(energy * across), energy]
    return derivative, np.concatenate(state), np.repeat(scales, [2, 2, 4, 3, 4, 3, 2])


@compiled_once(error_model="numpy")
def _derivative(checksum: int):
    """Compile the right-hand side; the torque on the ring is the sum over its dipoles."""

    def derivative(s, masses, frictions, moment, magnets, others):
        _ = checksum
        background, (push_x, push_y, drag, turning, load) = others[:3], others[3:]
        mass, r, inertia, across, axial = masses
        c, c_ring = frictions
        outer, frame, height, factor = magnets
        ball, omega = (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10])
        ring, pi = (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17])
        axis, center = scaled(moment, third_axis(ball)), (0.0, 0.0, height)
        inner = frame.copy()
        place_dipoles(inner, columns(ring), center, frame)
        on_ball = (s[0], s[1], r, axis[0], axis[1], axis[2])
        near = sum_over_sources(on_ball, NOBODY, inner, inner.shape[1])
        far = sum_over_sources(on_ball, NOBODY, outer, outer.shape[1])
        force_x = far[0] + factor * near[0] + push_x - drag * s[2]
        force_y = far[1] + factor * near[1] + push_y - drag * s[3]
        if load != 0.0:
            square = s[0] * s[0] + s[1] * s[1]
            force_x -= load * s[1] / square
            force_y += load * s[0] / square
        field = plus((far[3], far[4], far[5]), factor, (near[3], near[4], near[5]))
        field = plus(field, 1.0, background)
        torque = plus(cross(axis, field), -turning, omega)
        source = np.full((7, COUNT), NOBODY)
        source[:6, 0] = s[0], s[1], r, factor * axis[0], factor * axis[1], factor * axis[2]
        source[6, 0] = 0.0
        on_ring = (0.0, 0.0, 0.0)
        for k in range(frame.shape[1]):
            x, y, z, mx, my, mz, label = inner[:, k]
            if label != NOBODY:
                arm, dipole = plus((x, y, z), -1.0, center), (mx, my, mz)
                target = (x, y, z, mx, my, mz)
                for sources in (outer, source):
                    by = sum_over_sources(target, NOBODY, sources, sources.shape[1])
                    on_ring = plus(on_ring, 1.0, cross(arm, (by[0], by[1], by[2])))
                    on_ring = plus(on_ring, 1.0, cross(dipole, (by[3], by[4], by[5])))
        spin = stretched(pi, third_axis(ring), 1.0 / across, 1.0 / axial)
        slip_x, slip_y = s[2] - r * omega[1], s[3] + r * omega[0]
        out = np.empty(20)
        out[0], out[1] = s[2], s[3]
        out[2], out[3] = (force_x - c * slip_x) / mass, (force_y - c * slip_y) / mass
        out[4], out[5], out[6], out[7] = mul_quat((0.0, *scaled(0.5, omega)), ball)
        out[8] = (torque[0] - r * c * slip_y) / inertia
        out[9] = (torque[1] + r * c * slip_x) / inertia
        out[10] = torque[2] / inertia
        out[11], out[12], out[13], out[14] = mul_quat((0.0, *scaled(0.5, spin)), ring)
        for k in range(3):
            out[15 + k] = on_ring[k] - c_ring * spin[k]
        out[18] = c * (slip_x * slip_x + slip_y * slip_y)
        out[18] += drag * (s[2] * s[2] + s[3] * s[3]) + turning * dot(omega, omega)
        out[19] = c_ring * (spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2])
        return out

    return derivative


def states(scene: Motor, time: Array, rows: Array) -> MotorStates:
    """Convert rows of the solution to recorded states."""
    across, _, axial = scene.inner_moments
    orientation, momentum = rows[:, 11:15], rows[:, 15:18]
    axis = axes(orientation)
    along = np.sum(momentum * axis, axis=1, keepdims=True)
    spin = momentum / across + (1 / axial - 1 / across) * along * axis
    flat, no_work = np.zeros((len(rows), 1)), np.zeros(len(rows))
    found = {
        "position": np.hstack([rows[:, 0:2], flat + scene.ball_radius]),
        "velocity": np.hstack([rows[:, 2:4], flat]),
        "orientation": rows[:, 4:8],
        "angular_velocity": rows[:, 8:11],
        "ring_orientation": orientation,
        "ring_angular_velocity": spin,
        "ball_heat": rows[:, 18],
        "ring_heat": rows[:, 19],
        "ball_work": no_work,
        "ring_work": no_work,
    }
    return MotorStates(time=time, **{name: c[:, np.newaxis] for name, c in found.items()})
