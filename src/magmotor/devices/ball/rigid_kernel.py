"""The compiled stepping kernel for rigid bodies: a ball that rolls and slips, and a rotating ring.

There are two classes of schemes:

euler, cayley
    Bou-Rabee and Owhadi's stochastic variational Euler: forces, friction and noise at the beginning
    of the step change the discrete momenta; then positions and orientations drift, by the
    exponential or the Cayley map.
splittings
    Lists of parts, each solved exactly; the ring's drift is the free rotation of an axisymmetric
    body.
"""

# Numbers of the surroundings are read only where there are surroundings:
# pyright: reportPossiblyUnboundVariable=false

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from magmotor.common.arrays import Array
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
    exchanged_by_ball,
    exchanged_by_ring,
    impulses,
    read,
    slip,
)
from magmotor.devices.ball.rigid_surroundings import (
    drag_coefficients,
    drag_normals,
    drag_on_ball,
    has_surroundings,
    with_background,
)
from magmotor.noise import normal
from magmotor.numerics.arrays import aligned, copy
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.splittings import RIGID

SIZE = 22
"""Length of a state: position and velocity (2 each), orientation (4) and omega (3) of the ball;
orientation and omega of the ring; heat of ball and ring, work on ball and ring."""


def kernel(scheme: str, surrounded: bool = False) -> Any:
    """Return advance(states, recorded, rows, steps, path, bodies, magnets, coefficients, drag).

    From step number `steps[0]`, it advances the states, shape (R, SIZE), by `steps[1]` steps to
    each record, shape (records, R, SIZE), along the Brownian path (seed, factor, level), and leaves
    the last record in `states`. It advances replicas number `rows[0]` to `rows[1] - 1` only.
    `drag` is None unless the ball is `surrounded`; see `rigid_surroundings`.

    A replica's path is the same bit for bit for any number of other replicas, on any thread, and
    for any division of the run into calls.
    """
    return _advance(RIGID[scheme].exact, scheme == "cayley", surrounded)


@subroutine(forceinline=True)
def _unpack(s):
    """Return ball, ring, and the sums of both."""
    ball = (s[0], s[1]), (s[2], s[3]), (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10])
    ring = (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17])
    return ball, ring, (s[18], s[20]), (s[19], s[21])


@subroutine(forceinline=True)
def _pack(s, ball, ring, ball_sums, ring_sums):
    (s[0], s[1]), (s[2], s[3]), (s[4], s[5], s[6], s[7]), (s[8], s[9], s[10]) = ball
    (s[11], s[12], s[13], s[14]), (s[15], s[16], s[17]) = ring
    (s[18], s[20]), (s[19], s[21]) = ball_sums, ring_sums


@subroutine(forceinline=True)
def _normals(replica, step, path, bodies):
    """Return normal numbers for slip and ring; channels are numbered over those with noise."""
    seed, factor, level = path
    slip_normals, ring_normals, channel = (0.0, 0.0), (0.0, 0.0, 0.0), 0
    if bodies.slip_noise > 0.0:
        slip_normals = (
            normal(seed, replica, step, 0, factor, level),
            normal(seed, replica, step, 1, factor, level),
        )
        channel = 2
    # `drag_normals` draws from these channels.
    if bodies.drag_noise > 0.0:
        channel += 2
    if bodies.rotational_drag_noise > 0.0:
        channel += 3
    if bodies.ring_noise > 0.0:
        ring_normals = (
            normal(seed, replica, step, channel, factor, level),
            normal(seed, replica, step, channel + 1, factor, level),
            normal(seed, replica, step, channel + 2, factor, level),
        )
    return slip_normals, ring_normals


@compiled_once(nogil=True, error_model="numpy")
def _advance(checksum: int, splits: bool, by_cayley: bool, surrounded: bool):
    """Return the kernel for all splittings, or for Euler's scheme, with or without surroundings."""

    def advance(states, recorded, rows, steps, path, bodies, magnets, coefficients, drag):
        _ = checksum
        prefer_wide_vectors()
        first, interval = steps
        flags = coefficients.flags
        c, a = bodies.slip_friction, bodies.slip_noise
        c_ring, a_ring = bodies.ring_friction, bodies.ring_noise
        has_ring = magnets.frame.shape[1] > 0
        work = aligned(magnets.frame.size).reshape(magnets.frame.shape)
        copy(work[6], magnets.frame[6])
        for replica in range(rows[0], rows[1]):
            ball, ring, sums, ring_sums = _unpack(states[replica])
            force, torque, on_ring = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            # Step -1 moves nothing: it finds the force that the first kick needs.
            for n in range(coefficients.before, recorded.shape[0] * interval):
                start, u, u_ring = ball, slip(ball, bodies.radius), ring[1]
                # Once a step: only schemes in which a single part is noisy take noise.
                xi, xi_ring = _normals(replica, first + n, path, bodies)
                if surrounded:
                    others = drag_normals(replica, first + n, path, bodies, drag)
                for part in range(len(flags)):
                    if flags[part, 3]:
                        # Only here: a second copy of this code might round differently.
                        position = ball[0][0], ball[0][1], bodies.radius
                        force, torque, on_ring = wrenches(position, ball[2], ring[0], work, magnets)
                        if surrounded:
                            force, torque = with_background(
                                force, torque, position, ball[2], bodies, magnets
                            )
                    if n < 0:
                        continue
                    drifts, kicks, o_part = flags[part, 0], flags[part, 1], flags[part, 2]
                    row = read(coefficients.numbers, part)
                    if surrounded and (o_part or not splits):
                        friction = drag_on_ball(
                            ball, force, torque, xi + others, drag, part, splits and kicks
                        )
                    else:
                        friction = impulses(
                            ball, row, splits and kicks, o_part or not splits, force, torque, xi,
                            bodies,
                        )  # fmt: skip
                    if not splits:
                        ball = euler_ball(
                            ball, force, torque, friction, bodies, coefficients, by_cayley
                        )
                        if has_ring:
                            ring = euler_ring(
                                ring, on_ring, xi_ring, bodies, coefficients, by_cayley
                            )
                        continue
                    if drifts:
                        ball = drifted_ball(ball, coefficients.numbers[part, 0], False)
                        if has_ring:
                            ring = drifted_ring(ring, coefficients.numbers[part, 0], bodies)
                        continue
                    # Heat and work follow from the velocities at both ends of O, which is exact.
                    earlier, turned = ball, ring
                    ball = acted_on_ball(ball, row, kicks, friction, force, torque, bodies)
                    if has_ring:
                        ring = acted_on_ring(ring, row, kicks, o_part, on_ring, xi_ring, bodies)
                    if o_part:
                        time, exchange = row[0] if kicks else 0.0, coefficients.exchange[part]
                        sums = exchanged_by_ball(
                            sums, earlier, ball, time, force, torque, bodies, exchange
                        )
                        if has_ring:
                            ring_sums = exchanged_by_ring(
                                ring_sums, turned, ring, time, on_ring, bodies, exchange
                            )
                if n < 0:
                    continue
                if not splits:
                    after = slip(ball, bodies.radius)
                    sums = add_heat_and_work(sums, u, after, xi, coefficients, c, a)
                    if surrounded:
                        sums = add_heat_and_work(
                            sums, start[1], ball[1], others[:2], coefficients, bodies.drag,
                            bodies.drag_noise,
                        )  # fmt: skip
                        sums = add_heat_and_work(
                            sums, start[3], ball[3], others[2:], coefficients,
                            bodies.rotational_drag, bodies.rotational_drag_noise,
                        )  # fmt: skip
                    if has_ring:
                        ring_sums = add_heat_and_work(
                            ring_sums, u_ring, ring[1], xi_ring, coefficients, c_ring, a_ring
                        )
                if (n + 1) % interval == 0:
                    record = recorded[(n + 1) // interval - 1, replica]
                    _pack(record, ball, ring, sums, ring_sums)
            copy(states[replica], recorded[-1, replica])

    return advance


def recorded_chunks(
    job: Job, bodies: Bodies, magnets: Magnets, start: Array, threads: int | None = None
) -> Generator[tuple[Array, Array, Array]]:
    """Yield times, records of shape (T, R, SIZE) and the last states, in chunks.

    `start` has the initial states of the R replicas, shape (R, SIZE); `threads` is
    `thread_count()` by default.
    """
    surrounded, scheme = has_surroundings(bodies, magnets), RIGID[job.scheme]
    advance = kernel(job.scheme, surrounded)
    drag = drag_coefficients(bodies, scheme, job.timestep) if surrounded else None
    numbers = bodies, magnets, step_coefficients(bodies, scheme, job.timestep), drag
    path = job.path.seed, *job.path.view
    states = (start if job.state is None else job.state).copy()
    threads = min(len(states), threads or thread_count())
    ends = [len(states) * k // threads for k in range(threads + 1)]
    recorded, rows = np.empty((0, *states.shape)), (0, 0)
    advance.compile_for(states, recorded, rows, (0, 1), path, *numbers)
    with ThreadPoolExecutor(threads) as pool:
        for step, times in job.chunks(len(states)):
            recorded = np.empty((len(times), *states.shape))
            for steps in job.pieces(step, len(times), len(states)):
                parts = [(states, recorded, rows, steps, path, *numbers) for rows in pairwise(ends)]
                if threads == 1:
                    advance(*parts[0])  # starting a thread takes longer than many runs
                else:
                    for part in [pool.submit(advance, *part) for part in parts]:
                        part.result()
            yield times, recorded, states.copy()


def on_plane(flat: Array, height: float) -> Array:
    """Append a common z to vectors; shapes (..., 2) -> (..., 3)."""
    return np.concatenate([flat, np.full((*flat.shape[:-1], 1), height)], axis=-1)
