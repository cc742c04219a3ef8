"""The compiled stepping kernel of rigid bodies: a ball that rolls and slips, a ring that turns.

Two kinds of schemes:

euler, cayley
    Bou-Rabee and Owhadi's stochastic variational Euler: discrete momenta change by forces,
    friction and noise at the step's beginning, then positions and orientations drift, by the
    exponential or by the Cayley map.
splittings
    Lists of parts, each solved exactly; the ring's drift is the free rotation of an axisymmetric
    body.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from functools import cache
from typing import Any

from numba import njit

from magmotor import dipoles, eights, elementary, noise, rotations
from magmotor.code_version import code_version, specialised
from magmotor.elementary import prefer_wide_vectors
from magmotor.engines import books, vectors
from magmotor.engines.variational import rigid_forces, rigid_law, rigid_momentum, rigid_steps
from magmotor.engines.variational.rigid_forces import wrenches
from magmotor.engines.variational.rigid_steps import (
    acted_on_ball,
    acted_on_ring,
    booked,
    drifted_ball,
    drifted_ring,
    euler_ball,
    euler_ring,
    read,
    slip,
)
from magmotor.engines.variational.schemes import RIGID
from magmotor.engines.vectors import aligned, copy
from magmotor.noise import normal

SIZE = 22
"""Numbers in a state: place and velocity (2 each), orientation (4) and omega (3) of the ball;
orientation and omega of the ring; heat of ball and ring, work on ball and ring."""

COMPILED_IN = (
    dipoles,
    eights,
    elementary,
    noise,
    rotations,
    books,
    rigid_forces,
    rigid_law,
    rigid_momentum,
    rigid_steps,
    vectors,
)
"""Every module with code or types that become part of the kernel."""

CHECKSUM = code_version(*COMPILED_IN)


def kernel(scheme: str) -> Any:
    """The function advance(states, recorded, rows, steps, path, bodies, magnets, law).

    It takes the rows from `rows[0]` to before `rows[1]` of states, shape (R, SIZE), each a replica
    with the row's number, from step `steps[0]` on for `steps[1]` steps to each of `recorded`, shape
    (records, R, SIZE), along the Brownian path (seed, factor, level). The states are those of the
    last record afterwards.

    A replica's path is the same number for number with any replicas beside it, on any thread, and
    with any division of the run into calls.
    """
    return _compile(RIGID[scheme].exact, scheme == "cayley", CHECKSUM)


@njit(inline="always")
def _unpack(s):
    """Ball, ring, and the sums of both."""
    ball = (s[0], s[1]), (s[2], s[3]), (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10])
    ring = (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17])
    return ball, ring, (s[18], s[20]), (s[19], s[21])


@njit(inline="always")
def _pack(s, ball, ring, ball_sums, ring_sums):
    (s[0], s[1]), (s[2], s[3]), (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10]) = ball
    (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17]) = ring
    (s[18], s[20]), (s[19], s[21]) = ball_sums, ring_sums


@njit(inline="always")
def _normals(replica, step, path, bodies):
    """Normal numbers of the slip and of the ring; channels count those that have noise."""
    seed, factor, level = path
    push, shake, channel = (0.0, 0.0), (0.0, 0.0, 0.0), 0
    if bodies.slip_noise > 0.0:
        push = (
            normal(seed, replica, step, 0, factor, level),
            normal(seed, replica, step, 1, factor, level),
        )
        channel = 2
    if bodies.ring_noise > 0.0:
        shake = (
            normal(seed, replica, step, channel, factor, level),
            normal(seed, replica, step, channel + 1, factor, level),
            normal(seed, replica, step, channel + 2, factor, level),
        )
    return push, shake


@cache
def _compile(splits: bool, by_cayley: bool, checksum: int):
    """Compile the kernel of all splittings, or of Euler's scheme, or load it from Numba's cache.

    The closure cells are the cache's key, so they are plain numbers; see the magnetism callback.
    """

    @njit(cache=True, nogil=True, error_model="numpy")
    @specialised(splits, by_cayley)
    def advance(states, recorded, rows, steps, path, bodies, magnets, law):
        _ = checksum  # a part of the cache's key
        prefer_wide_vectors()
        first, interval = steps
        c, a = bodies.slip_friction, bodies.slip_noise
        c_ring, a_ring = bodies.ring_friction, bodies.ring_noise
        turns = magnets.frame.shape[1] > 0
        work = aligned(magnets.frame.size).reshape(magnets.frame.shape)
        copy(work[6], magnets.frame[6])
        for replica in range(rows[0], rows[1]):
            ball, ring, sums, ring_sums = _unpack(states[replica])
            force, torque, on_ring = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for n in range(law.before, recorded.shape[0] * interval):
                u, u_ring = slip(ball, bodies.radius), ring[1]
                xi, xi_ring = _normals(replica, first + n, path, bodies)
                for part in range(0 if n >= 0 else len(law.kinds) - 1, len(law.kinds)):
                    if law.kinds[part, 3]:
                        # Nowhere else: another copy of this code might round otherwise.
                        place = ball[0][0], ball[0][1], bodies.radius
                        force, torque, on_ring = wrenches(place, ball[2], ring[0], work, magnets)
                    if n < 0:
                        continue
                    drifts, kicks, rubs = law.kinds[part, 0], law.kinds[part, 1], law.kinds[part, 2]
                    if not splits:
                        ball = euler_ball(ball, force, torque, xi, bodies, law, by_cayley)
                        if turns:
                            ring = euler_ring(ring, on_ring, xi_ring, bodies, law, by_cayley)
                    elif drifts:
                        ball = drifted_ball(ball, law.numbers[part, 0], False)
                        if turns:
                            ring = drifted_ring(ring, law.numbers[part, 0], bodies)
                    else:
                        row = read(law.numbers, part)
                        ball = acted_on_ball(ball, row, kicks, rubs, force, torque, xi, bodies)
                        if turns:
                            ring = acted_on_ring(ring, row, kicks, rubs, on_ring, xi_ring, bodies)
                if n < 0:
                    continue
                after = slip(ball, bodies.radius)
                sums = booked(sums, u, after, xi, law, c, a, splits)
                if turns:
                    ring_sums = booked(
                        ring_sums, u_ring, ring[1], xi_ring, law, c_ring, a_ring, splits
                    )
                if (n + 1) % interval == 0:
                    record = recorded[(n + 1) // interval - 1, replica]
                    _pack(record, ball, ring, sums, ring_sums)
            copy(states[replica], recorded[-1, replica])

    return advance
