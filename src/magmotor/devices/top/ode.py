"""The paper's ordinary differential equation (magtopnc) of the top."""

from collections.abc import Callable

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.top import unbalanced_ode
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates
from magmotor.dipoles import NOBODY, pack_sources, sum_over_sources
from magmotor.numerics.compiled_once import compiled_once


def problem(scene: Top, initial: BallStates) -> tuple[Callable, Array, Array]:
    """Return right-hand side, initial state and scales of (x, v, xi_3, pi).

    A ball that is not balanced has an equation of its own.
    """
    if scene.is_unbalanced:
        return unbalanced_ode.problem(scene, initial)
    inertia, _, axial = scene.inertia
    c, r, m, mu = scene.friction, scene.ball_radius, scene.ball_mass, scene.moment
    parameters = (c, r, m, inertia, axial, mu)
    drags = scene.drag, scene.rotational_drag, scene.torsional_damping
    others = tuple(map(float, (*scene.background_field, *scene.downhill_force[:2], *drags)))
    fixed = pack_sources(*scene.ring_sources())
    evaluate = _derivative()

    def derivative(t, y):
        sources = pack_sources(*scene.ring_sources(t)) if scene.ring_script else fixed
        return evaluate(y, sources, parameters, others)

    axis, spin = initial.axis[-1], initial.angular_velocity[-1]
    momentum = inertia * spin + (axial - inertia) * (spin @ axis) * axis
    state = [initial.position[-1, :2], initial.velocity[-1, :2], axis, momentum]
    speed = np.sqrt(scene.coupling / scene.ring_height**3 / m)
    scales = np.repeat([r, speed, 1.0, np.sqrt(inertia * m) * speed], [2, 2, 3, 3])
    return derivative, np.concatenate(state), scales


@compiled_once()
def _derivative(checksum: int):
    """Compile the right-hand side of (magtopnc)."""

    def derivative(y, sources, parameters, others):
        _ = checksum
        c, r, m, inertia, axial, mu = parameters
        background_x, background_y, background_z, push_x, push_y, drag, turning, torsion = others
        vx, vy = y[2], y[3]
        ax, ay, az = y[4], y[5], y[6]
        px, py, pz = y[7], y[8], y[9]
        along = (inertia - axial) / axial * (px * ax + py * ay + pz * az)
        wx, wy, wz = (
            (px + along * ax) / inertia,
            (py + along * ay) / inertia,
            (pz + along * az) / inertia,
        )
        fx, fy, _, bx, by, bz, _ = sum_over_sources(
            (y[0], y[1], r, mu * ax, mu * ay, mu * az), NOBODY, sources, sources.shape[1]
        )
        bx, by, bz = bx + background_x, by + background_y, bz + background_z
        fx, fy = fx + push_x - drag * vx, fy + push_y - drag * vy
        slip_x, slip_y = vx - r * wy, vy + r * wx
        return np.array(
            [
                vx,
                vy,
                (fx - c * slip_x) / m,
                (fy - c * slip_y) / m,
                wy * az - wz * ay,
                wz * ax - wx * az,
                wx * ay - wy * ax,
                mu * (ay * bz - az * by) - c * r * slip_y - turning * wx,
                mu * (az * bx - ax * bz) + c * r * slip_x - turning * wy,
                mu * (ax * by - ay * bx) - (turning + torsion) * wz,
            ]
        )

    return derivative


def states(scene: Top, time: Array, rows: Array) -> BallStates:
    """Convert rows of the solution to recorded states."""
    if scene.is_unbalanced:
        return unbalanced_ode.states(scene, time, rows)
    inertia, _, axial = scene.inertia
    flat = np.zeros((len(rows), 1))
    axis, momentum = rows[:, 4:7], rows[:, 7:10]
    along = np.sum(momentum * axis, axis=1, keepdims=True)
    return BallStates(
        time=time,
        position=np.hstack([rows[:, 0:2], flat + scene.ball_radius]),
        velocity=np.hstack([rows[:, 2:4], flat]),
        axis=axis,
        angular_velocity=(momentum + (inertia - axial) / axial * along * axis) / inertia,
        orientation=None,
    )
