"""Runge-Kutta methods on the Lie group, tried and dropped: four evaluations of the forces a step.

Munthe-Kaas' with the classical weights (Runge-Kutta methods on Lie groups, 1998), and the
commutator-free one of Celledoni, Marthinsen and Owren (Commutator-free Lie group methods, 2003).
"""

from functools import cache
from typing import Any

from numba import njit

from magmotor.devices.ball.rigid_forces import force_and_field
from magmotor.devices.ball.rigid_steps import friction_on_ball
from magmotor.numerics.rotations import (
    cross,
    exponential,
    normalised,
    plus,
    product,
    scaled,
    third_axis,
)


@njit(inline="always")
def along(a, s, b):
    """The vector a + s b in the plane."""
    return a[0] + s * b[0], a[1] + s * b[1]


@njit(inline="always")
def slope(ball, bodies, magnets):
    """Velocity, acceleration, angular velocity and acceleration."""
    place, v, turn, omega = ball
    moment = scaled(magnets.moment, third_axis(turn))
    force, field = force_and_field((place[0], place[1], bodies.radius), moment, magnets.fixed)
    torque = cross(moment, field)
    friction = -bodies.slip_friction, 0.0, 0.0
    push, twist = friction_on_ball(ball, force, torque, (0.0, 0.0), bodies, friction)
    spin = scaled(1.0 / bodies.inertia, plus(torque, 1.0, twist))
    return v, along(scaled(1.0 / bodies.mass, push), 1.0 / bodies.mass, force), omega, spin


@njit(inline="always")
def moved(ball, time, k):
    """The ball after such a slope for a time."""
    place, v, turn, omega = ball
    turn = product(exponential(scaled(time, k[2])), turn)
    return along(place, time, k[0]), along(v, time, k[1]), turn, plus(omega, time, k[3])


@njit(inline="always")
def pulled_back(k, u):
    """A slope whose angular velocity is taken to the step's start: dexp^-1_u omega, of order 4."""
    first = cross(u, k[2])
    return k[0], k[1], plus(plus(k[2], -0.5, first), 1.0 / 12.0, cross(u, first)), k[3]


@njit(inline="always")
def added(a, s, b):
    """The slope a + s b."""
    return along(a[0], s, b[0]), along(a[1], s, b[1]), plus(a[2], s, b[2]), plus(a[3], s, b[3])


@njit(inline="always")
def averaged(k1, k2, k3, k4):
    """Six times the classical mean of four slopes."""
    return added(added(added(k1, 2.0, k2), 2.0, k3), 1.0, k4)


@njit(inline="always")
def munthe_kaas(ball, h, bodies, magnets) -> Any:
    """A step."""
    k1 = slope(ball, bodies, magnets)
    k2 = slope(moved(ball, 0.5 * h, k1), bodies, magnets)
    k2 = pulled_back(k2, scaled(0.5 * h, k1[2]))
    k3 = slope(moved(ball, 0.5 * h, k2), bodies, magnets)
    k3 = pulled_back(k3, scaled(0.5 * h, k2[2]))
    k4 = pulled_back(slope(moved(ball, h, k3), bodies, magnets), scaled(h, k3[2]))
    return moved(ball, h / 6.0, averaged(k1, k2, k3, k4))


@njit(inline="always")
def commutator_free(ball, h, bodies, magnets) -> Any:
    """A step: the rotations of its stages begin where other stages ended."""
    turn = ball[2]
    k1 = slope(ball, bodies, magnets)
    second = moved(ball, 0.5 * h, k1)
    k2 = slope(second, bodies, magnets)
    k3 = slope(moved(ball, 0.5 * h, k2), bodies, magnets)
    place, v, _, omega = moved(ball, h, k3)
    ahead = product(exponential(scaled(h, plus(k3[2], -0.5, k1[2]))), second[2])
    k4 = slope((place, v, ahead, omega), bodies, magnets)
    place, v, _, omega = moved(ball, h / 6.0, averaged(k1, k2, k3, k4))
    middle = scaled(2.0, plus(k2[2], 1.0, k3[2]))
    early = plus(plus(middle, 3.0, k1[2]), -1.0, k4[2])
    late = plus(plus(middle, -1.0, k1[2]), 3.0, k4[2])
    turn = product(exponential(scaled(h / 12.0, early)), turn)
    return place, v, product(exponential(scaled(h / 12.0, late)), turn), omega


@cache
def advance(free: bool) -> Any:
    """The function advance(ball, h, count, bodies, magnets) -> ball; `free` of commutators."""

    @njit(nogil=True, error_model="numpy")
    def steps(ball, h, count, bodies, magnets):
        for _ in range(count):
            if free:
                place, v, turn, omega = commutator_free(ball, h, bodies, magnets)
            else:
                place, v, turn, omega = munthe_kaas(ball, h, bodies, magnets)
            ball = place, v, normalised(turn), omega
        return ball

    return steps
