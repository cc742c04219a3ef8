"""The compiled stepping kernel: many replicas at once, as lanes of the processor's vectors.

All schemes and potentials come from this one kernel, specialized by the list of parts and the
number of Fourier coefficients. A replica's path is the same number for number with any
number of replicas beside it, on any thread, and with any division of the run into calls.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.device.job import Job
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.noise import box_muller, normal, threefry
from magmotor.numerics.compiled import aligned, compiled_once, copy
from magmotor.numerics.eights import COUNT, fused
from magmotor.numerics.elementary import cosine, prefer_wide_vectors, sine
from magmotor.numerics.reproducible import product
from magmotor.numerics.splittings import DISK, friction_and_noise, kicks_that_evaluate, response

LANES = 128
"""Replicas that are stepped together: their states stay in the first-level cache."""

TURN = 2 * np.pi


class Part(NamedTuple):
    """What a part of a step does to (v, omega): u -> u + D u + L xi + p F.

    `friction` is the matrix D by rows, `noise` the columns of L (two for two channels), `push` the
    vector p of a force F on the disk.
    """

    turns: float
    """How long it acts over 2 pi, which takes v to turns."""
    angle: float
    """How long it acts."""
    friction: tuple[float, ...]
    noise: tuple[tuple[float, ...], ...]
    push: tuple[float, float]


class StepCoefficients(NamedTuple):
    """What the kernel applies in each part of a step.

    `force` are the coefficients (-k a_k, k b_k) of -U' = sum -k a_k cos kx + k b_k sin kx from the
    highest k down.
    """

    parts: tuple[Part, ...]
    force: tuple[tuple[float, float], ...]


def step_coefficients(
    scene: Disk | LangevinParticle, scheme: str, timestep: float
) -> StepCoefficients:
    """The numbers of a scene, a scheme and a timestep."""
    found = DISK[scheme]
    parts = zip(found.parts, found.fractions, strict=True)
    waves = [(-k * a, k * b) for k, (a, b) in enumerate(scene.coefficients, start=1)]
    return StepCoefficients(
        tuple(_part(scene, code, fraction * timestep, found.exact) for code, fraction in parts),
        tuple(reversed(waves or [(0.0, 0.0)])),
    )


def _part(scene: Disk | LangevinParticle, code: str, time: float, exact: bool) -> Part:
    n, wrenches = len(scene.masses), scene.slip_directions.T
    decrement, increment = np.zeros((2, 2)), np.zeros((2, scene.slip_directions.shape[0]))
    push = np.array([time, 0.0])
    matrices = scene.masses, scene.friction * product(wrenches, wrenches.T)
    if code in "OK":
        decrement[:n, :n], increment[:n] = friction_and_noise(
            *matrices, scene.noise * wrenches, time, exact=exact
        )
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
    """The compiled function that advances many replicas at once.

    Its parameters are (states, recorded, first, interval, seed, replica, factor, level,
    coefficients). It takes the states, shape (4, R) with rows x in turns, theta, v and omega and
    with R a multiple of eight, from step `first` through `interval` steps to each of `recorded`,
    shape (records, 4, R); column 0 is replica number `replica`. Afterwards the states are those of
    the last record.
    """
    sines = all(b == 0 for _, b in scene.coefficients)
    parts = DISK[scheme].parts
    codes = tuple("ABOK".index(part) for part in parts)
    shape = len(scene.coefficients), len(scene.slip_directions)
    return _advance(codes, kicks_that_evaluate(parts), sines, shape)


@njit(inline="always")
def _force(turns, force, sines):
    """Clenshaw's sum of the Fourier series of -U'; `sines`: the potential has no cosines."""
    c = cosine(turns)
    a1, a2, b1, b2 = 0.0, 0.0, 0.0, 0.0
    for k in range(len(force)):
        a1, a2 = fused(2 * c, a1, force[k][0] - a2), a1
        if not sines:
            b1, b2 = fused(2 * c, b1, force[k][1] - b2), b1
    even = fused(c, a1, -a2)
    return even if sines else fused(sine(turns), b1, even)


@compiled_once(nogil=True, error_model="numpy")
def _advance(
    checksum: int,
    parts: tuple[int, ...],
    anew: tuple[bool, ...],
    sines: bool,
    shape: tuple[int, int],
):
    """The kernel for a list of parts.

    `shape` are the lengths of the tuples of `StepCoefficients`, part of the kernel's signature.
    """
    count = len(parts)
    kicks = tuple(part in (1, 3) for part in parts)
    o_part = tuple(part in (2, 3) for part in parts)
    carried = not all(anew[i] for i in range(count) if kicks[i])
    draws = sum(o_part)

    def advance(states, recorded, first, interval, seed, replica, factor, level, coefficients):
        _ = checksum
        prefer_wide_vectors()
        rules, force = coefficients
        channels = len(rules[0].noise)
        work = aligned((7 + 2 * channels * draws) * LANES).reshape(-1, LANES)
        x, theta, v, omega, forces = work[0], work[1], work[2], work[3], work[4]
        words, normals = work[5:7].view(np.uint64), work[7:]
        for group in range(0, states.shape[1], LANES):
            lanes = min(LANES, states.shape[1] - group)
            for row in range(4):
                copy(work[row, :lanes], states[row, group:])
            if carried:
                for i in range(lanes):
                    forces[i] = _force(x[i], force, sines)
            step = first
            for record in range(recorded.shape[0]):
                for _ in range(interval):
                    if factor == 1 and level == 0:
                        if step & 1 == 0 or step == first:
                            for draw in range(channels * draws):
                                # Two short loops: of a long one, the processor overlaps less.
                                for i in range(lanes):
                                    words[0, i], words[1, i] = threefry(
                                        np.uint64(step >> 1),
                                        np.uint64(draw),
                                        np.uint64(seed),
                                        np.uint64(replica + group + i),
                                    )
                                for i in range(lanes):
                                    normals[2 * draw, i], normals[2 * draw + 1, i] = box_muller(
                                        words[0, i], words[1, i]
                                    )
                    else:
                        for draw in range(channels * draws):
                            for i in range(lanes):
                                normals[2 * draw + (step & 1), i] = normal(
                                    seed, replica + group + i, step, draw, factor, level
                                )
                    for i in range(lanes):
                        x_i, theta_i, v_i, omega_i = x[i], theta[i], v[i], omega[i]
                        force_i, row = forces[i], step & 1
                        for part in range(count):
                            rule = rules[part]
                            if parts[part] == 0:
                                x_i = fused(rule.turns, v_i, x_i)
                                theta_i = fused(rule.angle, omega_i, theta_i)
                            if anew[part]:
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
    """The state that a run begins with; see `Job`."""
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
            advance(lanes, recorded, first, interval, path.seed, 0, path.factor, path.level, rule)
        yield unpack(times, recorded[..., :replicas], job.initial.theta is not None), lanes.copy()


def pack(states: DiskStates) -> NDArray[np.float64]:
    """The last of the states as the kernel takes it: padded, and x in turns."""
    replicas = states.x.shape[1]
    lanes = np.zeros((4, -(-replicas // COUNT) * COUNT))
    lanes[0, :replicas], lanes[2, :replicas] = states.x[-1] / TURN, states.v[-1]
    if states.theta is not None and states.omega is not None:
        lanes[1, :replicas], lanes[3, :replicas] = states.theta[-1], states.omega[-1]
    return lanes


def unpack(time: NDArray, states: NDArray[np.float64], turns: bool) -> DiskStates:
    """Recorded states from the kernel's, shape (T, 4, replicas)."""
    x, theta, v, omega = states.transpose(1, 0, 2)
    return DiskStates(time, TURN * x, v, theta if turns else None, omega if turns else None)
