"""The equations of motion of a ball that is not balanced, for SciPy; see `unbalanced`.

The state consists of x, y, the orientation, p_x, p_y and pi. On the plane p_z = m omega . u with
u = s x e_z, so that pi - s x (p_x, p_y, 0) = (I + m u u^T) omega, which is inverted by the formula
of Sherman and Morrison.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from magmotor.common.arrays import Array
from magmotor.devices.ball.states import axes
from magmotor.devices.top import unbalanced
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates
from magmotor.dipoles import NOBODY, pack_sources, sum_over_sources
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.rotations import columns, cross, dot, mul_quat, plus, scaled


def problem(scene: Top, initial: BallStates) -> tuple[Callable, Array, Array]:
    """Return right-hand side, initial state and scales of (x, orientation, p, pi)."""
    inverse = np.linalg.inv(scene.inertia_about_center_of_mass)
    lever, weight = scene.center_of_mass, scene.ball_mass * np.array(scene.gravity_vector)
    ball = scene.ball_mass, scene.ball_radius, scene.moment, lever, tuple(map(tuple, inverse))
    drags = scene.friction, scene.drag, scene.rotational_drag, scene.torsional_damping
    around = tuple(map(float, weight)), tuple(map(float, scene.background_field)), drags
    fixed = pack_sources(*scene.ring_sources())
    evaluate = _derivative()

    def derivative(t, y):
        sources = pack_sources(*scene.ring_sources(t)) if scene.ring_script else fixed
        return evaluate(y, sources, ball, around)

    assert initial.orientation is not None, "initial states have orientations"
    linear, turning = unbalanced.momenta(scene, initial)
    state = [initial.position[-1, :2], initial.orientation[-1], linear[-1, :2], turning[-1]]
    speed = np.sqrt(scene.coupling / scene.ring_height**3 / scene.ball_mass)
    momentum = scene.ball_mass * speed
    spin = np.sqrt(scene.inertia[0] / scene.ball_mass) * momentum
    scales = np.repeat([scene.ball_radius, 1.0, momentum, spin], [2, 4, 2, 3])
    return derivative, np.concatenate(state), scales


@compiled_once()
def _derivative(checksum: int):
    """Compile the right-hand side."""

    def derivative(y, sources, ball, around):
        _ = checksum
        mass, radius, moment, (lever_x, lever_y, lever_z), inverse = ball
        weight, background, (friction, drag, turning, torsion) = around
        length = 1.0 / np.sqrt(y[2] * y[2] + y[3] * y[3] + y[4] * y[4] + y[5] * y[5])
        q = length * y[2], length * y[3], length * y[4], length * y[5]
        first, second, axis = columns(q)

        def rotated(a):
            return plus(plus(scaled(a[0], first), a[1], second), a[2], axis)

        def accelerated(torque):
            own = dot(torque, first), dot(torque, second), dot(torque, axis)
            return rotated((dot(inverse[0], own), dot(inverse[1], own), dot(inverse[2], own)))

        s = rotated((lever_x, lever_y, lever_z))
        linear, angular = (y[6], y[7], 0.0), (y[8], y[9], y[10])
        u = s[1], -s[0], 0.0
        free, response = accelerated(plus(angular, -1.0, cross(s, linear))), accelerated(u)
        held = -mass * dot(u, free) / (1.0 + mass * dot(u, response))
        spin = plus(free, held, response)
        swept = cross(spin, s)
        vx, vy = y[6] / mass - swept[0], y[7] / mass - swept[1]
        slip_x, slip_y = vx - radius * spin[1], vy + radius * spin[0]
        mx, my, mz = scaled(moment, axis)
        fx, fy, _, bx, by, bz, _ = sum_over_sources(
            (y[0], y[1], radius, mx, my, mz), NOBODY, sources, sources.shape[1]
        )
        field = plus((bx, by, bz), 1.0, background)
        torque = plus(cross((mx, my, mz), field), 1.0, cross(s, weight))
        torque = plus(torque, mass, cross(swept, (vx, vy, 0.0)))
        torque = plus(torque, friction * radius, (-slip_y, slip_x, 0.0))
        torque = plus(torque, -turning, spin)
        rate = mul_quat((0.0, 0.5 * spin[0], 0.5 * spin[1], 0.5 * spin[2]), q)
        return np.array(
            [
                vx,
                vy,
                rate[0] / length,
                rate[1] / length,
                rate[2] / length,
                rate[3] / length,
                fx + weight[0] - drag * vx - friction * slip_x,
                fy + weight[1] - drag * vy - friction * slip_y,
                torque[0],
                torque[1],
                torque[2] - torsion * spin[2],
            ]
        )

    return derivative


def states(scene: Top, time: Array, rows: Array) -> BallStates:
    """Convert rows of the solution to recorded states."""
    rotation = Rotation.from_quat(rows[:, 2:6], scalar_first=True)  # normalizes
    found = unbalanced.velocities(scene, rows[:, 6:8], rows[:, 8:11], rotation)
    flat = np.zeros((len(rows), 1))
    orientation = rows[:, 2:6] / np.linalg.norm(rows[:, 2:6], axis=1, keepdims=True)
    return BallStates(
        time=time,
        position=np.hstack([rows[:, 0:2], flat + scene.ball_radius]),
        velocity=np.hstack([found[:, :2], flat]),
        axis=axes(orientation),
        angular_velocity=found[:, 2:],
        orientation=orientation,
    )
