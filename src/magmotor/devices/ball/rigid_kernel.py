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

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.common.environment import thread_count
from magmotor.device.job import Job
from magmotor.devices.ball.rigid_forces import Bodies, Magnets, step_coefficients, wrenches
from magmotor.devices.ball.rigid_steps import (
    acted_on_ball,
    acted_on_ring,
    add_heat_and_work,
    drifted_ball,
    drifted_ring,
    euler_ball,
    euler_ring,
    read,
    slip,
)
from magmotor.noise import normal
from magmotor.numerics.compiled import aligned, compiled_once, copy
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.splittings import RIGID

SIZE = 22
"""Numbers in a state: place and velocity (2 each), orientation (4) and omega (3) of the ball;
orientation and omega of the ring; heat of ball and ring, work on ball and ring."""


def kernel(scheme: str) -> Any:
    """The function advance(states, recorded, rows, steps, path, bodies, magnets, coefficients).

    It takes the rows from `rows[0]` to before `rows[1]` of states, shape (R, SIZE), each a replica
    with the row's number, from step `steps[0]` on for `steps[1]` steps to each of `recorded`, shape
    (records, R, SIZE), along the Brownian path (seed, factor, level). The states are those of the
    last record afterwards.

    A replica's path is the same number for number with any replicas beside it, on any thread, and
    with any division of the run into calls.
    """
    return _advance(RIGID[scheme].exact, scheme == "cayley")


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


@compiled_once(nogil=True, error_model="numpy")
def _advance(checksum: int, splits: bool, by_cayley: bool):
    """The kernel of all splittings, or of Euler's scheme."""

    def advance(states, recorded, rows, steps, path, bodies, magnets, coefficients):
        _ = checksum
        prefer_wide_vectors()
        first, interval = steps
        kinds = coefficients.kinds
        c, a = bodies.slip_friction, bodies.slip_noise
        c_ring, a_ring = bodies.ring_friction, bodies.ring_noise
        turns = magnets.frame.shape[1] > 0
        work = aligned(magnets.frame.size).reshape(magnets.frame.shape)
        copy(work[6], magnets.frame[6])
        for replica in range(rows[0], rows[1]):
            ball, ring, sums, ring_sums = _unpack(states[replica])
            force, torque, on_ring = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for n in range(coefficients.before, recorded.shape[0] * interval):
                u, u_ring = slip(ball, bodies.radius), ring[1]
                xi, xi_ring = _normals(replica, first + n, path, bodies)
                for part in range(0 if n >= 0 else len(kinds) - 1, len(kinds)):
                    if kinds[part, 3]:
                        # Nowhere else: another copy of this code might round otherwise.
                        place = ball[0][0], ball[0][1], bodies.radius
                        force, torque, on_ring = wrenches(place, ball[2], ring[0], work, magnets)
                    if n < 0:
                        continue
                    drifts, kicks, o_part = kinds[part, 0], kinds[part, 1], kinds[part, 2]
                    if not splits:
                        ball = euler_ball(ball, force, torque, xi, bodies, coefficients, by_cayley)
                        if turns:
                            ring = euler_ring(
                                ring, on_ring, xi_ring, bodies, coefficients, by_cayley
                            )
                    elif drifts:
                        ball = drifted_ball(ball, coefficients.numbers[part, 0], False)
                        if turns:
                            ring = drifted_ring(ring, coefficients.numbers[part, 0], bodies)
                    else:
                        row = read(coefficients.numbers, part)
                        ball = acted_on_ball(ball, row, kicks, o_part, force, torque, xi, bodies)
                        if turns:
                            ring = acted_on_ring(ring, row, kicks, o_part, on_ring, xi_ring, bodies)
                if n < 0:
                    continue
                after = slip(ball, bodies.radius)
                sums = add_heat_and_work(sums, u, after, xi, coefficients, c, a, splits)
                if turns:
                    ring_sums = add_heat_and_work(
                        ring_sums, u_ring, ring[1], xi_ring, coefficients, c_ring, a_ring, splits
                    )
                if (n + 1) % interval == 0:
                    record = recorded[(n + 1) // interval - 1, replica]
                    _pack(record, ball, ring, sums, ring_sums)
            copy(states[replica], recorded[-1, replica])

    return advance


Array = NDArray[np.float64]


def recorded_chunks(
    job: Job, bodies: Bodies, magnets: Magnets, start: Array, threads: int | None = None
) -> Generator[tuple[Array, Array, Array]]:
    """Yield times, records of shape (T, R, SIZE) and the states that came last, in chunks.

    `start` are the states of the R replicas, as the kernel takes them; `threads` are
    `thread_count()` if not given.
    """
    advance = kernel(job.scheme)
    numbers = bodies, magnets, step_coefficients(bodies, RIGID[job.scheme], job.timestep)
    path = job.path.seed, job.path.factor, job.path.level
    states = (start if job.state is None else job.state).copy()
    threads = min(len(states), threads or thread_count())
    ends = [len(states) * k // threads for k in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        for step, times in job.chunks(len(states)):
            recorded = np.empty((len(times), *states.shape))
            for steps in job.pieces(step, len(times), len(states)):
                parts = [(states, recorded, rows, steps, path, *numbers) for rows in pairwise(ends)]
                if threads == 1:
                    advance(*parts[0])  # a thread takes longer to start than many a run
                else:
                    for part in [pool.submit(advance, *part) for part in parts]:
                        part.result()
            yield times, recorded, states.copy()


def on_plane(flat: Array, height: float) -> Array:
    """Vectors from their x and y and one z for all; shapes (..., 2) -> (..., 3)."""
    return np.concatenate([flat, np.full((*flat.shape[:-1], 1), height)], axis=-1)
