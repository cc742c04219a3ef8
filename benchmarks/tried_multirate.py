"""Multiple time stepping of the top, tried and dropped: the field is evaluated once a step.

The field and its gradient are taken at the middle of the step, where the ball will be if it keeps
its velocity. In the field so expanded to first order, the ball takes a number of steps of Verlet's
scheme: its libration about the field, the fast motion, no longer bounds the step.
"""

import math

from numba import njit

from magmotor.devices.ball.rigid_steps import drifted_ball, friction_on_ball, kicked_ball
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.numerics.rotations import cross, plus, scaled, third_axis


@njit(inline="always")
def field_and_gradient(x, y, z, sources):
    """B at a point, and its derivatives along x and along y: the gradients of B_x and of B_y."""
    bx, by, bz, xx, xy, xz, yy, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(sources.shape[1]):
        rx, ry, rz = x - sources[0, j], y - sources[1, j], z - sources[2, j]
        mx, my, mz = sources[3, j], sources[4, j], sources[5, j]
        inverse = 1.0 / (rx * rx + ry * ry + rz * rz)
        scale = 3.0 * PERMEABILITY_OVER_4PI * sources[6, j] * inverse * inverse * math.sqrt(inverse)
        along = mx * rx + my * ry + mz * rz
        third = 1.0 / (3.0 * inverse)
        bx += scale * (along * rx - third * mx)
        by += scale * (along * ry - third * my)
        bz += scale * (along * rz - third * mz)
        steep = 5.0 * along * inverse
        xx += scale * (along + 2.0 * mx * rx - steep * rx * rx)
        xy += scale * (mx * ry + my * rx - steep * rx * ry)
        xz += scale * (mx * rz + mz * rx - steep * rx * rz)
        yy += scale * (along + 2.0 * my * ry - steep * ry * ry)
        yz += scale * (my * rz + mz * ry - steep * ry * rz)
    return (bx, by, bz), (xx, xy, xz), (xy, yy, yz)


@njit(nogil=True, error_model="numpy", fastmath=True)
def advance(ball, h, count, substeps, bodies, magnets):
    """The ball after a number of steps."""
    t = h / substeps
    rate = bodies.slip_friction * (1.0 / bodies.mass + bodies.radius**2 / bodies.inertia)
    lost = -math.expm1(-rate * t)
    along = lost / rate - t if rate > 0.0 else 0.0
    triple = -lost / (1.0 / bodies.mass + bodies.radius**2 / bodies.inertia), 0.0, along
    for _ in range(count):
        middle = ball[0][0] + 0.5 * h * ball[1][0], ball[0][1] + 0.5 * h * ball[1][1]
        x, y = middle
        field, by_x, by_y = field_and_gradient(x, y, bodies.radius, magnets.fixed)
        for _ in range(substeps):
            ball = drifted_ball(ball, 0.5 * t, False)
            x, y = ball[0][0] - middle[0], ball[0][1] - middle[1]
            moment = scaled(magnets.moment, third_axis(ball[2]))
            force = (
                by_x[0] * moment[0] + by_x[1] * moment[1] + by_x[2] * moment[2],
                by_y[0] * moment[0] + by_y[1] * moment[1] + by_y[2] * moment[2],
                0.0,
            )
            torque = cross(moment, plus(plus(field, x, by_x), y, by_y))
            push, twist = friction_on_ball(ball, force, torque, (0.0, 0.0), bodies, triple)
            push, twist = plus(push, t, force), plus(twist, t, torque)
            ball = kicked_ball(ball, 1.0, push, twist, bodies)
            ball = drifted_ball(ball, 0.5 * t, False)
    return ball
