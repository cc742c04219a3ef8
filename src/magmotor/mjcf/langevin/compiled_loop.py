"""The compiled loop of the BAOAB splitting; see `magmotor.mjcf.langevin.baoab`.

It calls MuJoCo's C functions `mj_integratePos`, which advances positions, and `mj_kinematics`,
which updates the frames of bodies and sites. Only the top of the loop computes forces, which
shortens compilation.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math
from functools import cache

from numba import types

from magmotor.mjcf import binding, layout, memory
from magmotor.mjcf.declarations.reader import acting_kinds, table_of
from magmotor.mjcf.errors import WORDS
from magmotor.mjcf.forces.all_forces import apply_forces
from magmotor.mjcf.forces.brownian_wrenches import chosen, step_number
from magmotor.mjcf.langevin.step_coefficients import (
    BODY,
    CHANNEL,
    DOF,
    ISOTROPIC,
    LAST_TWIST,
    QUATERNION,
    TWIST,
)
from magmotor.mjcf.langevin.thermostat import BY_TIME, LOST
from magmotor.mjcf.reports import report
from magmotor.noise import normal
from magmotor.numerics.numba_cache import compiled_once, copy
from magmotor.numerics.rotations import columns, dot, mul_quat, plus, scaled
from magmotor.numerics.subroutine import subroutine

_word, _number = types.int64, types.float64
_FUNCTIONS = {
    "mj_kinematics": types.void(_word, _word),
    "mj_integratePos": types.void(_word, _word, _word, _number),
}
_update_kinematics, _integrate_positions = (
    types.ExternalFunction(name, signature) for name, signature in _FUNCTIONS.items()
)


@cache
def compiled():
    """Return the loop for the running MuJoCo, compiled at most once per process."""
    memory.bind_mujoco(*_FUNCTIONS)
    binding.bind()
    return _advance(layout.current())


@compiled_once(nogil=True, error_model="numpy")
def _advance(checksum: int, offsets: layout.Layout):
    """Define the loop for one layout of the structs."""

    def advance(model, data, first, count, coefficients, path, work):
        """Take steps, and return the number of the next one; `BY_TIME` if the state is lost.

        Parameters
        ----------
        model, data : int
            Addresses of mjModel and mjData.
        first : int
            Number of the first step on the Brownian path, or `BY_TIME`.
        count : int
            Number of steps.
        coefficients : StepCoefficients
        path : ndarray, shape (count, nq + nv), (count, 2 nq + 3 nv) or (0, 0)
            Receives `qpos` and `qvel` after each step, if it has rows, and in the wider form `qpos`
            at part O, and `qvel` before and after it.
        work : ndarray, shape (3 nv + channels,)
            Scratch memory.
        """
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        coefficients, path, work = memory.borrowed((coefficients, path, work))
        n, nq, channels = len(coefficients.kick), int(m[offsets.nq // 8]), coefficients.channels
        qvel = memory.numbers(d[offsets.qvel // 8], 1, n)[0]
        qpos = memory.numbers(d[offsets.qpos // 8], 1, memory.UNBOUNDED)[0]
        time = memory.numbers(data + offsets.time, 1, 1)[0]
        seed, replica = chosen(d, m, offsets, 0), chosen(d, m, offsets, 1)
        factor, level = max(1, chosen(d, m, offsets, 2)), chosen(d, m, offsets, 3)
        if first == BY_TIME:
            first = chosen(d, m, offsets, 4) + step_number(model, data, offsets)
        force, change, whole = work[:n], work[n : 2 * n], work[2 * n :]
        noise = whole[n:]
        wide, done = path.shape[1] > nq + n, 0
        while True:
            _compute_forces(model, data, offsets, coefficients, force)
            if done > 0:
                kept = True
                for i in range(n):
                    qvel[i] += coefficients.kick[i] * force[i]
                    kept = kept and abs(qvel[i]) < LOST
                time[0] += coefficients.timestep
                if not kept:
                    return BY_TIME
                if len(path) > 0:
                    copy(path[done - 1, :nq], qpos)
                    copy(path[done - 1, nq : nq + n], qvel)
            if done == count:
                return first + done
            for i in range(n):
                qvel[i] += coefficients.kick[i] * force[i]
            step = first + done
            _drift(model, qpos, qvel, coefficients)
            for channel in range(channels):
                noise[channel] = normal(seed, replica, step, channel, factor, level)
            if wide:
                copy(path[done, nq + n : 2 * nq + n], qpos)
                copy(path[done, 2 * nq + n : 2 * (nq + n)], qvel)
            _damp_and_drive(qpos, qvel, coefficients, whole, change)
            if wide:
                copy(path[done, 2 * (nq + n) :], qvel)
            _drift(model, qpos, qvel, coefficients)
            done += 1

    return advance


@subroutine(forceinline=True)
def _compute_forces(model, data, offsets, coefficients, force):
    """Compute the generalized forces at the current configuration, without damping and noise.

    This updates the frames of bodies and sites, and `xfrc_applied` by the forces of dipoles.
    `force` receives the sum of the constant forces, `qfrc_applied`, the forces of potentials, and
    the wrenches `xfrc_applied` on the bodies.
    """
    d = memory.words(data, memory.UNBOUNDED)
    _update_kinematics(model, data)
    wrenches = d[offsets.xfrc_applied // 8]
    applied = memory.numbers(wrenches, memory.UNBOUNDED, 6)
    for i in range(len(force)):
        force[i] = 0.0
    place, table = memory.error_on_stack(), table_of(model, False)
    kinds = acting_kinds(table, memory.words(model, memory.UNBOUNDED), offsets)
    apply_forces(model, data, table, kinds, wrenches, force.ctypes.data, False, place)
    report(memory.words(place, WORDS), model, data)
    frames = memory.numbers(d[offsets.xmat // 8], memory.UNBOUNDED, 9)
    direct = memory.numbers(d[offsets.qfrc_applied // 8], 1, memory.UNBOUNDED)
    for i in range(len(force)):
        force[i] += coefficients.force[i] + direct[0, i]
        for k in range(6):
            force[i] += coefficients.wrenches[i, k] * applied[coefficients.bodies[i], k]
    for b in range(len(coefficients.balls)):
        body, dof = coefficients.balls[b, BODY], coefficients.balls[b, DOF]
        for k in range(3):
            for j in range(3):
                force[dof + k] += frames[body, 3 * j + k] * applied[body, 3 + j]


@subroutine(forceinline=True)
def _drift(model, qpos, qvel, coefficients):
    """A: move freely for half a timestep.

    A body with equal moments of inertia rotates at a constant angular velocity. For any other body,
    the kinetic energy is split into that of a body whose moments all equal the median, and two
    corrections, which are twists about two body axes in a symmetric sequence. A symmetric body
    needs one twist, and its motion is exact.
    """
    time = 0.5 * coefficients.timestep
    for b in range(len(coefficients.balls)):
        if not coefficients.balls[b, ISOTROPIC]:
            for k in range(3):
                qvel[coefficients.balls[b, DOF] + k] *= coefficients.ratios[b, k]
    _integrate_positions(model, qpos.ctypes.data, qvel.ctypes.data, time)
    for b in range(len(coefficients.balls)):
        if not coefficients.balls[b, ISOTROPIC]:
            start, dof = coefficients.balls[b, QUATERNION], coefficients.balls[b, DOF]
            quaternion, momentum = qpos[start : start + 4], qvel[dof : dof + 3]
            for twist in range(TWIST, LAST_TWIST + 1):
                axis = coefficients.balls[b, twist]
                span = 0.5 * time if twist in (TWIST, LAST_TWIST) else time
                _twist(quaternion, momentum, axis, coefficients.ratios[b, axis], span)
            for k in range(3):
                momentum[k] /= coefficients.ratios[b, k]


@subroutine(forceinline=True)
def _twist(quaternion, momentum, axis, ratio, time):
    """Rotate a body about its own axis by the flow of L^2/(2 I) - L^2/(2 I0) for `time`.

    L is the angular momentum about the axis, I the moment of inertia, I0 the median moment, and
    `ratio` I/I0. `momentum` is the angular momentum over I0 in the body's frame; it changes such
    that it stays constant in the world frame.
    """
    if ratio != 1.0:
        half = 0.5 * time * momentum[axis] * (1.0 / ratio - 1.0)
        c, s = math.cos(half), math.sin(half)
        twist = (c, s * (axis == 0), s * (axis == 1), s * (axis == 2))
        rotated = mul_quat((quaternion[0], quaternion[1], quaternion[2], quaternion[3]), twist)
        quaternion[0], quaternion[1], quaternion[2], quaternion[3] = rotated
        i, j = (axis + 1) % 3, (axis + 2) % 3
        x, y = momentum[i], momentum[j]
        cosine, sine = c * c - s * s, 2.0 * c * s
        momentum[i], momentum[j] = cosine * x + sine * y, cosine * y - sine * x


@subroutine(forceinline=True)
def _damp_and_drive(qpos, qvel, coefficients, whole, change):
    """O: apply damping and noise for a timestep, u += (D L) (u, xi).

    `whole` is memory for the velocities u, followed by the noise xi; `change` is memory for the
    change of u. The angular velocities of isotropic bodies are in the frame of their reference
    attitude meanwhile, where their damping and noise are constant. For other bodies with noise, the
    three Brownian torques are rotated to the body's frame.
    """
    n = len(qvel)
    copy(whole[:n], qvel)
    for b in range(len(coefficients.balls)):
        axes = _axes(qpos, coefficients.balls[b, QUATERNION])
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
            axes = _axes(qpos, coefficients.balls[b, QUATERNION])
            _to_body(change, coefficients.balls[b, DOF], axes)
    for i in range(n):
        qvel[i] += change[i]


@subroutine(forceinline=True)
def _axes(qpos, start):
    """Return the axes of a body in the frame of its reference attitude, from its quaternion."""
    return columns((qpos[start], qpos[start + 1], qpos[start + 2], qpos[start + 3]))


@subroutine(forceinline=True)
def _to_body(array, first, axes):
    """Transform a vector in an array from the frame of the reference attitude to the body's."""
    v = array[first], array[first + 1], array[first + 2]
    rotated = dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)
    array[first], array[first + 1], array[first + 2] = rotated


@subroutine(forceinline=True)
def _to_reference(array, first, axes):
    """Transform a vector in an array from the body's frame to that of its reference attitude."""
    x, y, z = array[first], array[first + 1], array[first + 2]
    v = plus(plus(scaled(x, axes[0]), y, axes[1]), z, axes[2])
    array[first], array[first + 1], array[first + 2] = v
