"""The compiled stepping kernel: many replicas at once, in the lanes of vector registers.

This one kernel serves all schemes and potentials; it is specialized by the list of parts and the
number of Fourier coefficients. A replica's path is the same bit for bit for any number of other
replicas, on any thread, and for any division of the run into calls.
"""

from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.device.job import Job
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.noise import box_muller, normal, threefry
from magmotor.numerics.arrays import aligned, copy
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import cosine, prefer_wide_vectors, sine
from magmotor.numerics.simd import fused
from magmotor.numerics.splittings import (
    DISK,
    carries_force,
    friction_and_noise,
    kicks_that_evaluate,
    response,
)

LANES = 128
"""Number of replicas that are stepped together, so that their states stay in the L1 cache."""

TURN = 2 * np.pi


class Part(NamedTuple):
    """A part of a step, which acts on u = (v, omega) as u -> u + D u + L xi + p F.

    `friction` is the matrix D by rows, `noise` the columns of L (two for two channels), `push` the
    vector p, and F the force on x.
    """

    turns: float
    """Duration over 2 pi: the change of x in turns per velocity."""
    angle: float
    """Duration."""
    friction: tuple[float, ...]
    noise: tuple[tuple[float, ...], ...]
    push: tuple[float, float]


class StepCoefficients(NamedTuple):
    """The parts of a step, and the force.

    `force` has the coefficients (-k a_k, k b_k) of -U' = sum -k a_k cos kx + k b_k sin kx, from the
    highest k down.
    """

    parts: tuple[Part, ...]
    force: tuple[tuple[float, float], ...]


def step_coefficients(
    scene: Disk | LangevinParticle, scheme: str, timestep: float
) -> StepCoefficients:
    """Return the coefficients for a scene, a scheme and a timestep."""
    splitting = DISK[scheme]
    parts = zip(splitting.parts, splitting.fractions, strict=True)
    waves = [(-k * a, k * b) for k, (a, b) in enumerate(scene.coefficients, start=1)]
    return StepCoefficients(
        tuple(_part(scene, code, fraction * timestep, splitting.exact) for code, fraction in parts),
        tuple(reversed(waves or [(0.0, 0.0)])),
    )


def _part(scene: Disk | LangevinParticle, code: str, time: float, exact: bool) -> Part:
    n, noise = len(scene.masses), scene.noise_matrix
    decrement, increment = np.zeros((2, 2)), np.zeros((2, noise.shape[1]))
    push = np.array([time, 0.0])
    matrices = scene.masses, scene.friction_matrix
    if code in "OK":
        decrement[:n, :n], increment[:n] = friction_and_noise(*matrices, noise, time, exact=exact)
    if code == "K":
        push[:n] = response(*matrices, time)[:, 0]
    return Part(
        turns=time / TURN,
        angle=time,
        friction=tuple(decrement.ravel().tolist()),
        noise=tuple(tuple(column) for column in increment.T.tolist()),
        push=(float(push[0]), float(push[1])),
    )


def kernel(scene: Disk | LangevinParticle, scheme: str) -> Any:
    """Return the compiled function that advances many replicas at once.

    Its parameters are (states, recorded, first, interval, seed, replica, factor, level,
    coefficients). From step number `first`, it advances the states, shape (4, R), by `interval`
    steps to each record, shape (records, 4, R), and leaves the last record in `states`. The rows
    are x in turns, theta, v and omega; R is a multiple of eight, and column 0 is replica number
    `replica`.
    """
    sines = all(b == 0 for _, b in scene.coefficients)
    parts = DISK[scheme].parts
    codes = tuple("ABOK".index(part) for part in parts)
    shape = len(scene.coefficients), scene.noise_matrix.shape[1]
    return _advance(codes, kicks_that_evaluate(parts), sines, shape)


@subroutine(forceinline=True)
def _force(turns, force, sines):
    """Sum the Fourier series of -U' by Clenshaw's method; `sines`: the potential has no cosines."""
    # x is in turns, whose reduction to one period is exact however far a flight has gone.
    c = cosine(turns)
    a1, a2, b1, b2 = 0.0, 0.0, 0.0, 0.0
    for k in range(len(force)):
        a1, a2 = fused(2 * c, a1, force[k][0] - a2), a1
        if not sines:
            b1, b2 = fused(2 * c, b1, force[k][1] - b2), b1
    even = fused(c, a1, -a2)
    return even if sines else fused(sine(turns), b1, even)


@subroutine(forceinline=True)
def _draw_two_steps(normals, words, lanes, draws, step, seed, replica):
    """Draw the normal numbers of an even step and of the next one, whose block of words is one."""
    for draw in range(draws):
        # Two short loops, since the processor overlaps less of a long one.
        for i in range(lanes):
            words[0, i], words[1, i] = threefry(
                np.uint64(step >> 1), np.uint64(draw), np.uint64(seed), np.uint64(replica + i)
            )
        for i in range(lanes):
            normals[2 * draw, i], normals[2 * draw + 1, i] = box_muller(words[0, i], words[1, i])


@subroutine(forceinline=True)
def _draw_of_view(normals, lanes, draws, step, seed, replica, factor, level):
    """Draw the normal numbers of a step of a coarsened, refined or held path."""
    for draw in range(draws):
        for i in range(lanes):
            normals[2 * draw + (step & 1), i] = normal(seed, replica + i, step, draw, factor, level)


@compiled_once(nogil=True, error_model="numpy")
def _advance(
    checksum: int,
    parts: tuple[int, ...],
    needs_force: tuple[bool, ...],
    sines: bool,
    shape: tuple[int, int],
):
    """Return the kernel for a list of parts.

    `shape` has the lengths of the tuples in `StepCoefficients`, which are part of the signature.
    """
    count = len(parts)
    kicks = tuple(part in (1, 3) for part in parts)
    o_part = tuple(part in (2, 3) for part in parts)
    carried = carries_force(kicks, needs_force)
    draws = shape[1] * sum(o_part)

    def advance(states, recorded, first, interval, seed, replica, factor, level, coefficients):
        _ = checksum
        prefer_wide_vectors()
        rules, force = coefficients
        channels = len(rules[0].noise)
        work = aligned((7 + 2 * draws) * LANES).reshape(-1, LANES)
        x, theta, v, omega, forces = work[0], work[1], work[2], work[3], work[4]
        words, normals = work[5:7].view(np.uint64), work[7:]
        for group in range(0, states.shape[1], LANES):
            lanes = min(LANES, states.shape[1] - group)
            for row in range(4):
                copy(work[row, :lanes], states[row, group:])
            # The first step of a call has no earlier one whose last force it could use.
            if carried:
                for i in range(lanes):
                    forces[i] = _force(x[i], force, sines)
            step = first
            for record in range(recorded.shape[0]):
                for _ in range(interval):
                    if factor > 1 or level > 0:
                        _draw_of_view(
                            normals, lanes, draws, step, seed, replica + group, factor, level
                        )
                    elif step & 1 == 0 or step == first:
                        _draw_two_steps(normals, words, lanes, draws, step, seed, replica + group)
                    for i in range(lanes):
                        x_i, theta_i, v_i, omega_i = x[i], theta[i], v[i], omega[i]
                        force_i, row = forces[i], step & 1
                        for part in range(count):
                            rule = rules[part]
                            if parts[part] == 0:
                                x_i = fused(rule.turns, v_i, x_i)
                                theta_i = fused(rule.angle, omega_i, theta_i)
                            # Constants of this kernel: parts are unrolled, and no branch is left.
                            if needs_force[part]:
                                force_i = _force(x_i, force, sines)
                            if o_part[part]:
                                dv = fused(rule.friction[0], v_i, rule.friction[1] * omega_i)
                                domega = fused(rule.friction[2], v_i, rule.friction[3] * omega_i)
                                for column in range(channels):
                                    dv = fused(rule.noise[column][0], normals[row, i], dv)
                                    domega = fused(rule.noise[column][1], normals[row, i], domega)
                                    row += 2
                                v_i, omega_i = v_i + dv, omega_i + domega
                            if kicks[part]:
                                v_i = fused(rule.push[0], force_i, v_i)
                                omega_i = fused(rule.push[1], force_i, omega_i)
                        x[i], theta[i], v[i], omega[i] = x_i, theta_i, v_i, omega_i
                        if carried:
                            forces[i] = force_i
                    step += 1
                for row in range(4):
                    copy(recorded[record, row, group : group + lanes], work[row])
            for row in range(4):
                copy(states[row, group : group + lanes], work[row])

    return advance


def start(job: Job) -> NDArray[np.float64]:
    """Return the kernel's state at the beginning of a run; see `Job`."""
    return pack(job.initial)


def run(job: Job) -> Generator[tuple[DiskStates, NDArray[np.float64]]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    scene, path = job.scene, job.path
    advance, rule = kernel(scene, job.scheme), step_coefficients(scene, job.scheme, job.timestep)
    lanes = pack(job.initial) if job.state is None else job.state.copy()
    replicas = job.initial.x.shape[1]
    for step, times in job.chunks(replicas):
        recorded = np.empty((len(times), *lanes.shape))
        for first, interval in job.pieces(step, len(times), replicas):
            advance(lanes, recorded, first, interval, path.seed, 0, *path.view, rule)
        yield unpack(times, recorded[..., :replicas], job.initial.theta is not None), lanes.copy()


def pack(states: DiskStates) -> NDArray[np.float64]:
    """Convert the last row to the kernel's state: padded, and x in turns."""
    replicas = states.x.shape[1]
    lanes = np.zeros((4, -(-replicas // COUNT) * COUNT))
    lanes[0, :replicas], lanes[2, :replicas] = states.x[-1] / TURN, states.v[-1]
    if states.theta is not None and states.omega is not None:
        lanes[1, :replicas], lanes[3, :replicas] = states.theta[-1], states.omega[-1]
    return lanes


def unpack(time: NDArray, states: NDArray[np.float64], has_rotation: bool) -> DiskStates:
    """Convert the kernel's states, shape (T, 4, replicas), to recorded states."""
    x, theta, v, omega = states.transpose(1, 0, 2)
    rotation = (theta, omega) if has_rotation else (None, None)
    return DiskStates(time, TURN * x, v, *rotation)
