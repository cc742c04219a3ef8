"""The elementary parts of the steps of ball and ring: drifts, kicks, friction and noise.

A ball is (position, velocity, orientation, omega), position and velocity with x and y only; a ring
is (orientation, omega).
"""

import math

from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import (
    TINY,
    cayley,
    cayley_momentum,
    dot,
    exponential,
    exponential_momentum,
    mul_quat,
    normalized,
    plus,
    scaled,
    stretched,
    third_axis,
)
from magmotor.numerics.simd import fused

ITERATIONS = 100
"""Largest number; a hoop needs 5 at h |omega| = 0.001, 10 at 0.1, and 31 at 1."""

ROUNDING = 4e-15
"""Relative change below which only rounding is left."""


@subroutine(forceinline=True)
def discrete_momentum(omega, axis, inertia, time, by_cayley):
    """Return (dtau^-1_W)* I omega for W = time omega; `inertia` is (across, about the axis)."""
    W, pi = scaled(time, omega), stretched(omega, axis, inertia[0], inertia[1])
    return cayley_momentum(W, pi) if by_cayley else exponential_momentum(W, pi)


@subroutine(forceinline=True)
def angular_velocity(mu, axis, inertia, time, by_cayley):
    """Return the angular velocity with this discrete momentum, by fixed-point iteration.

    It is NaN without convergence, which means that the step is too long for such a fast rotation.
    """
    across, axial = inertia
    omega = stretched(mu, axis, 1.0 / across, 1.0 / axial)
    for _ in range(ITERATIONS):
        missing = plus(mu, -1.0, discrete_momentum(omega, axis, inertia, time, by_cayley))
        change = stretched(missing, axis, 1.0 / across, 1.0 / axial)
        omega = plus(omega, 1.0, change)
        if dot(change, change) < ROUNDING * ROUNDING * dot(omega, omega) + TINY:
            return omega
    return math.nan, math.nan, math.nan


@subroutine(forceinline=True)
def heat_and_work(mean, friction, noise, increment, timestep):
    """Return heat c u^2 h and work alpha u dW of a step, in J, along the mean velocity u."""
    return friction * mean * mean * timestep, noise * mean * increment


@subroutine(forceinline=True)
def added(sums, taken, gained, noisy):
    """Return heat and work after an exact part in which a body has gained energy from its bath.

    `taken` is the heat by `Exchange`. Without noise, no work is done, and without friction no heat.
    """
    heat, work = sums
    if noisy:
        return heat + taken, work + gained + taken
    return heat - gained if taken != 0.0 else heat, work


@subroutine(forceinline=True)
def exchanged_by_ball(sums, before, after, time, force, torque, bodies, row):
    """Return heat and work of the ball after an exact part; see `Exchange`.

    `time` is that of force and torque, 0 if they do not act; `row` is one of `exchange`.
    """
    _, v, _, a = before
    _, w, _, b = after
    on = 1.0 if time != 0.0 else 0.0
    fx, fy = on * force[0], on * force[1]
    tx, ty, tz = on * torque[0], on * torque[1], on * torque[2]
    taken_x, gained_x = _in_plane((v[0], -a[1]), (w[0], -b[1]), (fx, -ty), bodies, row)
    taken_y, gained_y = _in_plane((v[1], a[0]), (w[1], b[0]), (fy, tx), bodies, row)
    mean = 0.5 * (a[2] + b[2])
    gained = bodies.inertia * (b[2] - a[2]) * mean - tz * (row[11] * mean + row[12] * tz)
    taken = row[10] * (a[2] * a[2] + b[2] * b[2]) + row[19]
    noise = bodies.slip_noise + bodies.drag_noise + bodies.rotational_drag_noise
    return added(sums, taken_x + taken_y + taken, gained_x + gained_y + gained, noise > 0.0)


@subroutine(forceinline=True)
def _in_plane(u, w, force, bodies, row):
    """Return the heat and the gain of energy of two velocities, u before and w after."""
    x, y = 0.5 * (u[0] + w[0]), 0.5 * (u[1] + w[1])
    moved_x = row[3] * x + row[4] * y + row[7] * force[0] + row[8] * force[1]
    moved_y = row[5] * x + row[6] * y + row[8] * force[0] + row[9] * force[1]
    gained = bodies.mass * (w[0] - u[0]) * x + bodies.inertia * (w[1] - u[1]) * y
    gained -= force[0] * moved_x + force[1] * moved_y
    taken = row[0] * (u[0] * u[0] + w[0] * w[0]) + row[2] * (u[1] * u[1] + w[1] * w[1])
    return taken + 2.0 * row[1] * (u[0] * u[1] + w[0] * w[1]), gained


@subroutine(forceinline=True)
def exchanged_by_ring(sums, before, after, time, torque, bodies, row):
    """Return heat and work of the ring after an exact part, as for the ball."""
    orientation, omega = before
    axis, mean = third_axis(orientation), scaled(0.5, plus(omega, 1.0, after[1]))
    torque = scaled(1.0 if time != 0.0 else 0.0, torque)
    change = stretched(plus(after[1], -1.0, omega), axis, bodies.across, bodies.axial)
    moved = stretched(torque, axis, row[15], row[18])
    moved = plus(stretched(mean, axis, row[14], row[17]), 1.0, moved)
    taken = dot(omega, stretched(omega, axis, row[13], row[16])) + row[20]
    taken += dot(after[1], stretched(after[1], axis, row[13], row[16]))
    return added(sums, taken, dot(change, mean) - dot(torque, moved), bodies.ring_noise > 0.0)


@subroutine(forceinline=True)
def read(numbers, part):
    """Return a row of `StepCoefficients.numbers` as a tuple, which is faster than an array."""
    return (
        numbers[part, 0],
        numbers[part, 1],
        numbers[part, 2],
        numbers[part, 3],
        numbers[part, 4],
        numbers[part, 5],
        numbers[part, 6],
        numbers[part, 7],
        numbers[part, 8],
        numbers[part, 9],
    )


@subroutine(forceinline=True)
def slip(ball, radius):
    """Return the velocity of the contact point."""
    _, v, _, omega = ball
    return fused(-radius, omega[1], v[0]), fused(radius, omega[0], v[1])


@subroutine(forceinline=True)
def kicked_ball(ball, time, force, torque, bodies):
    """Return the ball after the impulse of a force and a torque."""
    position, v, orientation, omega = ball
    scale = time / bodies.mass
    v = fused(scale, force[0], v[0]), fused(scale, force[1], v[1])
    return position, v, orientation, plus(omega, time / bodies.inertia, torque)


@subroutine(forceinline=True)
def kicked_ring(ring, impulse, bodies):
    """Return the ring after an angular impulse."""
    orientation, omega = ring
    change = stretched(impulse, third_axis(orientation), 1.0 / bodies.across, 1.0 / bodies.axial)
    return orientation, plus(omega, 1.0, change)


@subroutine(forceinline=True)
def friction_on_ball(ball, force, torque, xi, bodies, triple):
    """Return the impulse of friction and noise at the contact point, and its angular impulse.

    `triple` is (a, b, d) of the slip in `StepCoefficients`; force and torque act on the center at
    the same time.
    """
    u, r, (a, b, d) = slip(ball, bodies.radius), bodies.radius, triple
    light, arm = 1.0 / bodies.mass, r / bodies.inertia
    along = d / fused(r, arm, light)
    x = fused(along, fused(light, force[0], -arm * torque[1]), fused(a, u[0], b * xi[0]))
    y = fused(along, fused(light, force[1], arm * torque[0]), fused(a, u[1], b * xi[1]))
    return (x, y, 0.0), (r * y, -r * x, 0.0)


@subroutine(forceinline=True)
def friction_on_ring(ring, torque, xi, across, axial):
    """Return the angular impulse of friction and noise on the ring, during which a torque acts."""
    orientation, omega = ring
    axis = third_axis(orientation)
    friction = stretched(omega, axis, across[0], axial[0])
    noise = stretched(xi, axis, across[1], axial[1])
    return plus(plus(friction, 1.0, noise), 1.0, stretched(torque, axis, across[2], axial[2]))


@subroutine(forceinline=True)
def drifted_ball(ball, time, by_cayley):
    """Return the ball after free translation and rotation."""
    position, v, orientation, omega = ball
    W = scaled(time, omega)
    by = cayley(W) if by_cayley else exponential(W)
    position = fused(time, v[0], position[0]), fused(time, v[1], position[1])
    return position, v, normalized(mul_quat(by, orientation)), omega


@subroutine(forceinline=True)
def drifted_ring(ring, time, bodies):
    """Return the ring after free rotation with constant angular momentum pi.

    R(t) = exp(t pi/J) R exp(t (1/J_3 - 1/J) pi_3 e_3).
    """
    orientation, omega = ring
    across, axial = bodies.across, bodies.axial
    axis = third_axis(orientation)
    pi = stretched(omega, axis, across, axial)
    about = (0.0, 0.0, time * (1.0 / axial - 1.0 / across) * dot(pi, axis))
    orientation = mul_quat(
        exponential(scaled(time / across, pi)), mul_quat(orientation, exponential(about))
    )
    orientation = normalized(orientation)
    return orientation, stretched(pi, third_axis(orientation), 1.0 / across, 1.0 / axial)


@subroutine(forceinline=True)
def euler_ball(ball, force, torque, friction, bodies, coefficients, by_cayley):
    """Return the ball after a step of the variational Euler scheme.

    `friction` are the impulses of friction and noise.
    """
    h, (push, twist) = coefficients.timestep, friction
    impulse, angular_impulse = plus(push, h, force), plus(twist, h, torque)
    position, v, orientation, omega = kicked_ball(ball, 1.0, impulse, angular_impulse, bodies)
    if by_cayley:  # by exp, the discrete momentum of an isotropic body is I omega
        axis, isotropic = third_axis(orientation), (bodies.inertia, bodies.inertia)
        mu = plus(discrete_momentum(ball[3], axis, isotropic, -h, True), 1.0, angular_impulse)
        omega = angular_velocity(mu, axis, isotropic, h, True)
    return drifted_ball((position, v, orientation, omega), h, by_cayley)


@subroutine(forceinline=True)
def euler_ring(ring, torque, xi, bodies, coefficients, by_cayley):
    """Return the ring after a step of the variational Euler scheme."""
    h, row = coefficients.timestep, read(coefficients.numbers, 0)
    orientation, omega = ring
    axis, inertia = third_axis(orientation), (bodies.across, bodies.axial)
    mu = discrete_momentum(omega, axis, inertia, -h, by_cayley)
    across, axial = (row[4], row[5], 0.0), (row[7], row[8], 0.0)
    after_friction = friction_on_ring(ring, torque, xi, across, axial)
    mu = plus(plus(mu, h, torque), 1.0, after_friction)
    omega = angular_velocity(mu, axis, inertia, h, by_cayley)
    W = scaled(h, omega)
    return normalized(mul_quat(cayley(W) if by_cayley else exponential(W), orientation)), omega


@subroutine(forceinline=True)
def impulses(ball, row, kicks, o_part, force, torque, xi, bodies):
    """Return the impulses of friction and noise in a part of a step, if it has any."""
    push, twist = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if o_part:
        triple = row[1], row[2], row[3] if kicks else 0.0
        push, twist = friction_on_ball(ball, force, torque, xi, bodies, triple)
    return push, twist


@subroutine(forceinline=True)
def acted_on_ball(ball, row, kicks, friction, force, torque, bodies):
    """Return the ball after a part of a splitting: a kick, friction and noise, or both."""
    push, twist = friction
    if kicks:
        push, twist = plus(push, row[0], force), plus(twist, row[0], torque)
    return kicked_ball(ball, 1.0, push, twist, bodies)


@subroutine(forceinline=True)
def acted_on_ring(ring, row, kicks, o_part, torque, xi, bodies):
    """Return the ring after a part of a splitting: a kick, friction and noise, or both."""
    impulse = (0.0, 0.0, 0.0)
    if o_part:
        across = row[4], row[5], row[6] if kicks else 0.0
        axial = row[7], row[8], row[9] if kicks else 0.0
        impulse = friction_on_ring(ring, torque, xi, across, axial)
    if kicks:
        impulse = plus(impulse, row[0], torque)
    return kicked_ring(ring, impulse, bodies)


@subroutine(forceinline=True)
def add_heat_and_work(sums, before, after, xi, coefficients, friction, noise):
    """Return the running sums after a step's heat and work; see `heat_and_work`."""
    heat, work = sums
    h, root = coefficients.timestep, math.sqrt(coefficients.timestep)
    for k in range(len(before)):
        mean = 0.5 * (before[k] + after[k])
        taken, given = heat_and_work(mean, friction, noise, root * xi[k], h)
        heat += taken
        work += given
    return heat, work
