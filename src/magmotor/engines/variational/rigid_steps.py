"""What a step does to the ball and to the ring, by each scheme; a drift or a kick at a time.

A ball is (place, velocity, orientation, omega), place and velocity with x and y only; a ring is
(orientation, omega).
"""

import math

from numba import njit

from magmotor.engines.books import heat_and_work
from magmotor.engines.variational.rigid_momentum import angular_velocity, discrete_momentum
from magmotor.rotations import (
    cayley,
    dot,
    exponential,
    normalised,
    plus,
    product,
    scaled,
    stretched,
    third_axis,
)


@njit(inline="always")
def slip(ball, radius):
    """Velocity of the contact point."""
    _, v, _, omega = ball
    return v[0] - radius * omega[1], v[1] + radius * omega[0]


@njit(inline="always")
def kicked_ball(ball, time, force, torque, bodies):
    """The ball after a force and a torque have acted."""
    place, v, turn, omega = ball
    scale = time / bodies.mass
    v = v[0] + scale * force[0], v[1] + scale * force[1]
    return place, v, turn, plus(omega, time / bodies.inertia, torque)


@njit(inline="always")
def kicked_ring(ring, impulse, bodies):
    """The ring after an angular impulse."""
    turn, omega = ring
    change = stretched(impulse, third_axis(turn), 1.0 / bodies.across, 1.0 / bodies.axial)
    return turn, plus(omega, 1.0, change)


@njit(inline="always")
def friction_on_ball(ball, xi, bodies, law):
    """Impulse of friction and noise at the contact point, and its angular impulse."""
    u, (a, b) = slip(ball, bodies.radius), law.slip
    x, y = a * u[0] + b * xi[0], a * u[1] + b * xi[1]
    return (x, y, 0.0), (bodies.radius * y, -bodies.radius * x, 0.0)


@njit(inline="always")
def friction_on_ring(ring, xi, law):
    """Angular impulse of friction and noise on the ring."""
    turn, omega = ring
    axis = third_axis(turn)
    friction = stretched(omega, axis, law.across[0], law.axial[0])
    return plus(friction, 1.0, stretched(xi, axis, law.across[1], law.axial[1]))


@njit(inline="always")
def drifted_ball(ball, time, by_cayley):
    """The ball after it has rolled and turned freely."""
    place, v, turn, omega = ball
    W = scaled(time, omega)
    by = cayley(W) if by_cayley else exponential(W)
    place = place[0] + time * v[0], place[1] + time * v[1]
    return place, v, normalised(product(by, turn)), omega


@njit(inline="always")
def drifted_ring(ring, time, bodies):
    """The ring after it has turned freely, with its angular momentum pi constant.

    R(t) = exp(t pi/J) R exp(t (1/J_3 - 1/J) pi_3 e_3).
    """
    turn, omega = ring
    across, axial = bodies.across, bodies.axial
    axis = third_axis(turn)
    pi = stretched(omega, axis, across, axial)
    about = (0.0, 0.0, time * (1.0 / axial - 1.0 / across) * dot(pi, axis))
    turn = product(exponential(scaled(time / across, pi)), product(turn, exponential(about)))
    turn = normalised(turn)
    return turn, stretched(pi, third_axis(turn), 1.0 / across, 1.0 / axial)


@njit(inline="always")
def euler_ball(ball, force, torque, xi, bodies, law, by_cayley):
    """The ball after a step of the variational Euler scheme."""
    h = law.timestep
    push, twist = friction_on_ball(ball, xi, bodies, law)
    impulse, turning = plus(push, h, force), plus(twist, h, torque)
    place, v, turn, omega = kicked_ball(ball, 1.0, impulse, turning, bodies)
    if by_cayley:  # by exp, the discrete momentum of an isotropic body is I omega
        axis, isotropic = third_axis(turn), (bodies.inertia, bodies.inertia)
        mu = plus(discrete_momentum(ball[3], axis, isotropic, -h, True), 1.0, turning)
        omega = angular_velocity(mu, axis, isotropic, h, True)
    return drifted_ball((place, v, turn, omega), h, by_cayley)


@njit(inline="always")
def euler_ring(ring, torque, xi, bodies, law, by_cayley):
    """The ring after a step of the variational Euler scheme."""
    h = law.timestep
    turn, omega = ring
    axis, inertia = third_axis(turn), (bodies.across, bodies.axial)
    mu = discrete_momentum(omega, axis, inertia, -h, by_cayley)
    mu = plus(plus(mu, h, torque), 1.0, friction_on_ring(ring, xi, law))
    omega = angular_velocity(mu, axis, inertia, h, by_cayley)
    W = scaled(h, omega)
    return normalised(product(cayley(W) if by_cayley else exponential(W), turn)), omega


@njit(inline="always")
def baoa_ball(ball, force, torque, xi, bodies, law):
    """The ball after the first four parts of a step of BAOAB."""
    half = 0.5 * law.timestep
    ball = kicked_ball(ball, half, force, torque, bodies)
    ball = drifted_ball(ball, half, False)
    push, twist = friction_on_ball(ball, xi, bodies, law)
    ball = kicked_ball(ball, 1.0, push, twist, bodies)
    return drifted_ball(ball, half, False)


@njit(inline="always")
def baoa_ring(ring, torque, xi, bodies, law):
    """The ring after the first four parts of a step of BAOAB."""
    half = 0.5 * law.timestep
    ring = kicked_ring(ring, scaled(half, torque), bodies)
    ring = drifted_ring(ring, half, bodies)
    ring = kicked_ring(ring, friction_on_ring(ring, xi, law), bodies)
    return drifted_ring(ring, half, bodies)


@njit(inline="always")
def booked(sums, before, after, xi, law, friction, noise, exact):
    """Running sums of heat and work with those of a step added; see `books`."""
    heat, work = sums
    h, root = law.timestep, math.sqrt(law.timestep)
    for k in range(len(before)):
        increment = root * xi[k]
        taken, given = heat_and_work(before[k], after[k], friction, noise, increment, h, exact)
        heat += taken
        work += given
    return heat, work
