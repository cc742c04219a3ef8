"""The compiled loop of the splitting BAOAB; see `magmotor.engines.mujoco.baoab`.

It calls MuJoCo's C functions for the places (`mj_integratePos`) and for the bodies and sites there
(`mj_kinematics`). Forces are found in one place, at the loop's top, which shortens compilation.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math
from functools import cache

import numpy as np
from numba import njit, types

from magmotor import rotations
from magmotor.code_version import code_version, specialised
from magmotor.engines import vectors
from magmotor.engines.mujoco import callback, langevin_law, layout, memory
from magmotor.engines.mujoco.brownian import chosen
from magmotor.engines.mujoco.forces import apply_forces
from magmotor.engines.mujoco.langevin_law import (
    BODY,
    CHANNEL,
    DOF,
    ISOTROPIC,
    LAST_TWIST,
    PLACE,
    TWIST,
    Law,
)
from magmotor.engines.mujoco.step_number import step_number
from magmotor.engines.vectors import copy
from magmotor.noise import normal
from magmotor.rotations import columns, dot, plus, product, scaled

BY_TIME = -(2**63)
"""Number of a step that is not known; the time of `mjData` tells it, but for 5e7 steps at most."""

COMPILED_IN = (*callback.COMPILED_IN, callback, rotations, langevin_law, vectors)
"""Every module with code that becomes part of the loop."""

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
    return _compile(layout.current(), code_version(*COMPILED_IN))


@njit(forceinline=True)
def _borrowed(law):
    """The law with views of its arrays, see `memory.borrowed`."""
    return Law(
        law.timestep,
        memory.borrowed(law.kick),
        memory.borrowed(law.force),
        memory.borrowed(law.bodies),
        memory.borrowed(law.wrenches),
        memory.borrowed(law.starts),
        memory.borrowed(law.columns),
        memory.borrowed(law.values),
        law.channels,
        memory.borrowed(law.balls),
        memory.borrowed(law.ratios),
    )


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


@njit(error_model="numpy")
def _apply_forces(model, data, offsets):
    """Not inlined, unlike what it calls, since this shortens compilation."""
    apply_forces(model, data, offsets)


@njit(forceinline=True)
def _find_forces(model, data, offsets, law, force):
    """Forces on the velocities where the bodies are now."""
    d = memory.words(data, memory.UNBOUNDED)
    _update_kinematics(model, data)
    _apply_forces(model, data, offsets)
    applied = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)
    frames = memory.numbers(d[offsets.xmat // 8], memory.UNBOUNDED, 9)
    direct = memory.numbers(d[offsets.qfrc_applied // 8], 1, memory.UNBOUNDED)
    for i in range(len(force)):
        force[i] = law.force[i] + direct[0, i]
        for k in range(6):
            force[i] += law.wrenches[i, k] * applied[law.bodies[i], k]
    for b in range(len(law.balls)):
        body, dof = law.balls[b, BODY], law.balls[b, DOF]
        for k in range(3):
            for j in range(3):
                force[dof + k] += frames[body, 3 * j + k] * applied[body, 3 + j]


@njit(forceinline=True)
def _drift(model, qpos, qvel, law):
    """A: move freely for half a step.

    A body turns at a constant angular velocity if its moments of inertia are equal. Otherwise they
    are taken as their median first; what this leaves are twists about two of its own axes. A
    symmetric body has but one of them, and that is exact.
    """
    time = 0.5 * law.timestep
    for b in range(len(law.balls)):
        if not law.balls[b, ISOTROPIC]:
            for k in range(3):
                qvel[law.balls[b, DOF] + k] *= law.ratios[b, k]
    _move_places(model, qpos.ctypes.data, qvel.ctypes.data, time)
    for b in range(len(law.balls)):
        if not law.balls[b, ISOTROPIC]:
            place, dof = law.balls[b, PLACE], law.balls[b, DOF]
            quaternion, momentum = qpos[place : place + 4], qvel[dof : dof + 3]
            for twist in range(TWIST, LAST_TWIST + 1):
                axis = law.balls[b, twist]
                span = 0.5 * time if twist in (TWIST, LAST_TWIST) else time
                _twist(quaternion, momentum, axis, law.ratios[b, axis], span)
            for k in range(3):
                momentum[k] /= law.ratios[b, k]


@njit(forceinline=True)
def _twist(quaternion, momentum, axis, ratio, time):
    """Turn a body about its own axis by what its moment of inertia there, over the median, adds.

    Its angular momentum (over the median, in the body's frame) stays where it is in the world's.
    """
    if ratio != 1.0:
        half = 0.5 * time * momentum[axis] * (1.0 / ratio - 1.0)
        c, s = math.cos(half), math.sin(half)
        about = (c, s * (axis == 0), s * (axis == 1), s * (axis == 2))
        turned = product((quaternion[0], quaternion[1], quaternion[2], quaternion[3]), about)
        quaternion[0], quaternion[1], quaternion[2], quaternion[3] = turned
        i, j = (axis + 1) % 3, (axis + 2) % 3
        x, y = momentum[i], momentum[j]
        cosine, sine = c * c - s * s, 2.0 * c * s
        momentum[i], momentum[j] = cosine * x + sine * y, cosine * y - sine * x


@njit(forceinline=True)
def _damp_and_drive(qpos, qvel, law, whole, change):
    """O: apply friction and noise; `whole` has room for the velocities, then the noise."""
    n = len(qvel)
    copy(whole[:n], qvel)
    for b in range(len(law.balls)):
        axes = _axes(qpos, law.balls[b, PLACE])
        if law.balls[b, ISOTROPIC]:
            _to_reference(whole, law.balls[b, DOF], axes)
        elif law.balls[b, CHANNEL] >= 0:
            _to_body(whole, n + law.balls[b, CHANNEL], axes)
    for i in range(n):
        change[i] = 0.0
        for k in range(law.starts[i], law.starts[i + 1]):
            change[i] += law.values[k] * whole[law.columns[k]]
    for b in range(len(law.balls)):
        if law.balls[b, ISOTROPIC]:
            _to_body(change, law.balls[b, DOF], _axes(qpos, law.balls[b, PLACE]))
    for i in range(n):
        qvel[i] += change[i]


def _compile(offsets: layout.Layout, checksum: int):
    """Compile the loop, or load it from Numba's disk cache; see `callback.compile_callback`."""

    @njit(cache=True, nogil=True, error_model="numpy")
    @specialised(offsets)
    def advance(model, data, first, count, law, path, work):
        """Take steps from number `first` on, or from where the time says if it is `BY_TIME`.

        Returns the number of the step that follows, or `BY_TIME` if the state is not finite.
        """
        _ = checksum  # a part of the cache's key
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        law, path, work = _borrowed(law), memory.borrowed(path), memory.borrowed(work)
        n, channels = len(law.kick), law.channels
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
            _find_forces(model, data, offsets, law, force)
            if done > 0:
                size = 0.0
                for i in range(n):
                    qvel[i] += law.kick[i] * force[i]
                    size += abs(qvel[i])
                time[0] += law.timestep
                if len(path) > 0:
                    places = path.shape[1] - n
                    copy(path[done - 1, :places], qpos)
                    copy(path[done - 1, places:], qvel)
                if not size < np.inf:
                    return BY_TIME
            if done == count:
                return first + done
            for i in range(n):
                qvel[i] += law.kick[i] * force[i]
            step = first + done
            _drift(model, qpos, qvel, law)
            for channel in range(channels):
                noise[channel] = normal(seed, replica, step, channel, factor, level)
            _damp_and_drive(qpos, qvel, law, whole, change)
            _drift(model, qpos, qvel, law)
            done += 1

    return advance
