"""The compiled loop of the splitting BAOAB; see `magmotor.mjcf.langevin.baoab`.

It calls MuJoCo's C functions for the places (`mj_integratePos`) and for the bodies and sites there
(`mj_kinematics`). Forces are found in one place, at the loop's top, which shortens compilation.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from magmotor.mjcf import layout, memory
from magmotor.mjcf.forces.brownian import chosen, step_number
from magmotor.mjcf.langevin.model import Ball, LangevinModel
from magmotor.mjcf.magnetism import apply_forces
from magmotor.noise import normal
from magmotor.numerics.compiled import compiled_once, copy
from magmotor.numerics.reproducible import orthonormal_rows, product
from magmotor.numerics.rotations import columns, dot, mul_quat, plus, scaled
from magmotor.numerics.splittings import friction_and_noise

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BODY, PLACE, DOF, CHANNEL, ISOTROPIC, TWIST, LAST_TWIST = 0, 1, 2, 3, 4, 5, 7
"""Columns of `StepCoefficients.balls`: those of `Ball`, whether isotropic, and its twists' axes."""


class StepCoefficients(NamedTuple):
    """What acts on n velocities in the parts of a step.

    The rows of the sparse matrix (D L), as `starts`, `columns` and `values`, are what damping and
    noise add to each velocity.
    """

    timestep: float
    kick: Array
    """Half a step over the inertia of each velocity."""
    force: Array
    bodies: Integers
    wrenches: Array
    """As in `LangevinModel`, but of slides and hinges alone."""
    starts: Integers
    columns: Integers
    values: Array
    channels: int
    balls: Integers
    ratios: Array


def step_coefficients(model: LangevinModel, timestep: float) -> StepCoefficients:
    """The numbers of a model and a timestep."""
    matrix = _damping_and_noise(model, timestep)
    wrenches = model.wrenches.copy()
    for ball in model.balls:
        wrenches[ball.dof : ball.dof + 3] = 0.0
    balls = [(*ball[:4], ball.isotropic, *_twists(ball)) for ball in model.balls]
    return StepCoefficients(
        timestep,
        0.5 * timestep / model.masses,
        model.force,
        model.bodies,
        wrenches,
        matrix.indptr.astype(np.int64),
        matrix.indices.astype(np.int64),
        np.asarray(matrix.data, dtype=float),
        model.noise.shape[1],
        np.array(balls, dtype=np.int64).reshape(-1, 8),
        np.array([ball.ratios for ball in model.balls]).reshape(-1, 3),
    )


def _damping_and_noise(model: LangevinModel, timestep: float) -> csr_array:
    """The matrix (D L), group by group of velocities that damping or noise couple."""
    damping, noise = model.damping, model.noise
    n = len(damping)
    matrix = np.zeros((n, n + noise.shape[1]))
    groups, group = connected_components(csr_array(abs(damping) + abs(noise) @ abs(noise.T)))
    for number in range(groups):
        dofs = np.flatnonzero(group == number)
        channels = np.flatnonzero(noise[dofs].any(axis=0))
        driven = noise[np.ix_(dofs, channels)]
        # The root of the covariance wants Brownian motions that differ in what they drive.
        combinations = orthonormal_rows(driven)
        if len(combinations) == len(channels):
            combinations = np.eye(len(channels))
        decrement, increment = friction_and_noise(
            model.masses[dofs],
            damping[np.ix_(dofs, dofs)],
            product(driven, combinations.T),
            timestep,
            exact=True,
        )
        matrix[np.ix_(dofs, dofs)] = decrement
        matrix[np.ix_(dofs, n + channels)] = product(increment, combinations)
    return csr_array(matrix)


def _twists(ball: Ball) -> tuple[int, int, int]:
    """A palindrome of the axes whose moments of inertia differ from the median.

    That of a symmetric body is in the middle.
    """
    _, outer, middle = np.argsort(abs(ball.ratios - 1), kind="stable").tolist()
    return outer, middle, outer


BY_TIME = -(2**63)
"""Number of a step that is not known; the time of `mjData` tells it, but for 5e7 steps at most."""

_word, _number = types.int64, types.float64
_FUNCTIONS = {
    "mj_kinematics": types.void(_word, _word),
    "mj_integratePos": types.void(_word, _word, _word, _number),
}
_update_kinematics, _move_places = (
    types.ExternalFunction(name, signature) for name, signature in _FUNCTIONS.items()
)


@cache
def compiled():
    """The loop for the MuJoCo that is running, compiled once a process at the most."""
    for name in _FUNCTIONS:
        memory.bind_function(name, getattr(memory.library(), name))
    return _advance(layout.current())


@compiled_once(nogil=True, error_model="numpy")
def _advance(checksum: int, offsets: layout.Layout):
    """The loop for one layout of the structs."""

    def advance(model, data, first, count, coefficients, path, work):
        """Take steps from number `first` on, or from where the time says if it is `BY_TIME`.

        Returns the number of the step that follows, or `BY_TIME` if the state is not finite.
        """
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        coefficients, path, work = (
            _borrowed(coefficients),
            memory.borrowed(path),
            memory.borrowed(work),
        )
        n, channels = len(coefficients.kick), coefficients.channels
        qvel = memory.numbers(d[offsets.qvel // 8], 1, n)[0]
        qpos = memory.numbers(d[offsets.qpos // 8], 1, memory.UNBOUNDED)[0]
        time = memory.numbers(data + offsets.time, 1, 1)[0]
        seed, replica = chosen(d, m, offsets, 0), chosen(d, m, offsets, 1)
        factor, level = max(1, chosen(d, m, offsets, 2)), chosen(d, m, offsets, 3)
        if first == BY_TIME:
            first = chosen(d, m, offsets, 4) + step_number(model, data, offsets)
        force, change, whole = work[:n], work[n : 2 * n], work[2 * n :]
        noise = whole[n:]
        done = 0
        while True:
            _find_forces(model, data, offsets, coefficients, force)
            if done > 0:
                size = 0.0
                for i in range(n):
                    qvel[i] += coefficients.kick[i] * force[i]
                    size += abs(qvel[i])
                time[0] += coefficients.timestep
                if len(path) > 0:
                    places = path.shape[1] - n
                    copy(path[done - 1, :places], qpos)
                    copy(path[done - 1, places:], qvel)
                if not size < np.inf:
                    return BY_TIME
            if done == count:
                return first + done
            for i in range(n):
                qvel[i] += coefficients.kick[i] * force[i]
            step = first + done
            _drift(model, qpos, qvel, coefficients)
            for channel in range(channels):
                noise[channel] = normal(seed, replica, step, channel, factor, level)
            _damp_and_drive(qpos, qvel, coefficients, whole, change)
            _drift(model, qpos, qvel, coefficients)
            done += 1

    return advance


@njit(forceinline=True)
def _borrowed(coefficients):
    """The coefficients with views of its arrays, see `memory.borrowed`."""
    return StepCoefficients(
        coefficients.timestep,
        memory.borrowed(coefficients.kick),
        memory.borrowed(coefficients.force),
        memory.borrowed(coefficients.bodies),
        memory.borrowed(coefficients.wrenches),
        memory.borrowed(coefficients.starts),
        memory.borrowed(coefficients.columns),
        memory.borrowed(coefficients.values),
        coefficients.channels,
        memory.borrowed(coefficients.balls),
        memory.borrowed(coefficients.ratios),
    )


@njit(forceinline=True)
def _find_forces(model, data, offsets, coefficients, force):
    """Forces on the velocities where the bodies are now."""
    d = memory.words(data, memory.UNBOUNDED)
    _update_kinematics(model, data)
    applied = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)
    _apply_forces(model, data, offsets, applied)
    frames = memory.numbers(d[offsets.xmat // 8], memory.UNBOUNDED, 9)
    direct = memory.numbers(d[offsets.qfrc_applied // 8], 1, memory.UNBOUNDED)
    for i in range(len(force)):
        force[i] = coefficients.force[i] + direct[0, i]
        for k in range(6):
            force[i] += coefficients.wrenches[i, k] * applied[coefficients.bodies[i], k]
    for b in range(len(coefficients.balls)):
        body, dof = coefficients.balls[b, BODY], coefficients.balls[b, DOF]
        for k in range(3):
            for j in range(3):
                force[dof + k] += frames[body, 3 * j + k] * applied[body, 3 + j]


@njit(error_model="numpy")
def _apply_forces(model, data, offsets, applied):
    """Not inlined, unlike what it calls, since this shortens compilation."""
    apply_forces(model, data, offsets, applied)


@njit(forceinline=True)
def _drift(model, qpos, qvel, coefficients):
    """A: move freely for half a step.

    A body turns at a constant angular velocity if its moments of inertia are equal. Otherwise they
    are taken as their median first; what this leaves are twists about two of its own axes. A
    symmetric body has but one of them, and that is exact.
    """
    time = 0.5 * coefficients.timestep
    for b in range(len(coefficients.balls)):
        if not coefficients.balls[b, ISOTROPIC]:
            for k in range(3):
                qvel[coefficients.balls[b, DOF] + k] *= coefficients.ratios[b, k]
    _move_places(model, qpos.ctypes.data, qvel.ctypes.data, time)
    for b in range(len(coefficients.balls)):
        if not coefficients.balls[b, ISOTROPIC]:
            place, dof = coefficients.balls[b, PLACE], coefficients.balls[b, DOF]
            quaternion, momentum = qpos[place : place + 4], qvel[dof : dof + 3]
            for twist in range(TWIST, LAST_TWIST + 1):
                axis = coefficients.balls[b, twist]
                span = 0.5 * time if twist in (TWIST, LAST_TWIST) else time
                _twist(quaternion, momentum, axis, coefficients.ratios[b, axis], span)
            for k in range(3):
                momentum[k] /= coefficients.ratios[b, k]


@njit(forceinline=True)
def _twist(quaternion, momentum, axis, ratio, time):
    """Turn a body about its own axis by what its moment of inertia there, over the median, adds.

    Its angular momentum (over the median, in the body's frame) stays where it is in the world's.
    """
    if ratio != 1.0:
        half = 0.5 * time * momentum[axis] * (1.0 / ratio - 1.0)
        c, s = math.cos(half), math.sin(half)
        about = (c, s * (axis == 0), s * (axis == 1), s * (axis == 2))
        turned = mul_quat((quaternion[0], quaternion[1], quaternion[2], quaternion[3]), about)
        quaternion[0], quaternion[1], quaternion[2], quaternion[3] = turned
        i, j = (axis + 1) % 3, (axis + 2) % 3
        x, y = momentum[i], momentum[j]
        cosine, sine = c * c - s * s, 2.0 * c * s
        momentum[i], momentum[j] = cosine * x + sine * y, cosine * y - sine * x


@njit(forceinline=True)
def _damp_and_drive(qpos, qvel, coefficients, whole, change):
    """O: apply damping and noise; `whole` has room for the velocities, then the noise."""
    n = len(qvel)
    copy(whole[:n], qvel)
    for b in range(len(coefficients.balls)):
        axes = _axes(qpos, coefficients.balls[b, PLACE])
        if coefficients.balls[b, ISOTROPIC]:
            _to_reference(whole, coefficients.balls[b, DOF], axes)
        elif coefficients.balls[b, CHANNEL] >= 0:
            _to_body(whole, n + coefficients.balls[b, CHANNEL], axes)
    for i in range(n):
        change[i] = 0.0
        for k in range(coefficients.starts[i], coefficients.starts[i + 1]):
            change[i] += coefficients.values[k] * whole[coefficients.columns[k]]
    for b in range(len(coefficients.balls)):
        if coefficients.balls[b, ISOTROPIC]:
            _to_body(change, coefficients.balls[b, DOF], _axes(qpos, coefficients.balls[b, PLACE]))
    for i in range(n):
        qvel[i] += change[i]


@njit(forceinline=True)
def _axes(qpos, place):
    """The axes of a body, as it would see those of its reference attitude."""
    return columns((qpos[place], qpos[place + 1], qpos[place + 2], qpos[place + 3]))


@njit(forceinline=True)
def _to_body(array, first, axes):
    """Bring a vector in an array from the frame of the reference attitude to the body's."""
    v = array[first], array[first + 1], array[first + 2]
    seen = dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)
    array[first], array[first + 1], array[first + 2] = seen


@njit(forceinline=True)
def _to_reference(array, first, axes):
    """Bring a vector in an array from the body's frame to that of its reference attitude."""
    x, y, z = array[first], array[first + 1], array[first + 2]
    v = plus(plus(scaled(x, axes[0]), y, axes[1]), z, axes[2])
    array[first], array[first + 1], array[first + 2] = v
