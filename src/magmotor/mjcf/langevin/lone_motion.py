"""The motion of lone bodies, whose inertia, damping and noise are constant: A, and the exact O.

Of MuJoCo's functions, it needs only those that advance positions and update the frames.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from magmotor.common.arrays import Array, Integers
from magmotor.mjcf import memory
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.langevin.free_motion import move, update_kinematics
from magmotor.mjcf.langevin.friction_and_noise import standard_normal
from magmotor.mjcf.langevin.lone_model import Ball, LoneModel, read_lone_bodies
from magmotor.mjcf.langevin.position_forces import apply_forces_to, apply_own_forces
from magmotor.mjcf.langevin.tree import read_tree
from magmotor.numerics.arrays import copy
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import columns, dot, mul_quat, plus, scaled
from magmotor.numerics.splittings import friction_and_noise

BODY, QUATERNION, DOF, CHANNEL, ISOTROPIC, TWIST, LAST_TWIST = 0, 1, 2, 3, 4, 5, 7
"""Columns of `LoneBodies.balls`: the fields of `Ball`, whether isotropic, and twist axes."""


class LoneBodies(NamedTuple):
    """Coefficients of lone bodies for n velocities and k Brownian channels.

    In part O, damping and noise add (D L) (u, xi) to the velocities u, where xi are k standard
    normal numbers. The rows of the matrix (D L), shape (n, n + k), are stored in compressed sparse
    form as `starts`, `columns` and `values`.
    """

    masses: Array
    """Inertia of each velocity, shape (n,)."""
    kick: Array
    """Half a timestep, for which each part B acts, over the inertia."""
    wrenches: Array
    """Same as in `LoneModel`, but zero for ball joints, shape (n, 6)."""
    starts: Integers
    """First element of each row in `columns` and `values`, and their end, shape (n + 1,)."""
    columns: Integers
    values: Array
    channels: int
    """Number of Brownian channels, k."""
    balls: Integers
    """Integers of each ball joint, in columns `BODY` to `LAST_TWIST`."""
    ratios: Array
    """`Ball.ratios` of each ball joint, shape (balls, 3)."""
    bodies: Integers
    """Same as in `Tree`, like `weights` and `own_wrenches`."""
    weights: Array
    forces: int
    """Bits of all that acts, with noise."""
    own_wrenches: bool


class LoneRoom(NamedTuple):
    """Scratch memory of one thread."""

    force: Array
    wrenches: Array
    whole: Array
    """Velocities, and normal numbers of all channels."""
    change: Array
    exchanged: Array


def lone_bodies(model: mujoco.MjModel) -> LoneBodies:
    """Read the coefficients of a model.

    Raises
    ------
    ValueError
        As by `read_lone_bodies`.
    """
    read, tree = read_lone_bodies(model), read_tree(model, [], full=False, mujoco_steps=True)
    matrix = _damping_and_noise(read, model.opt.timestep)
    wrenches = read.wrenches.copy()
    for ball in read.balls:
        wrenches[ball.dof : ball.dof + 3] = 0.0
    balls = [(*ball[:4], ball.isotropic, *_twist_axes(ball)) for ball in read.balls]
    return LoneBodies(
        read.masses,
        0.5 * model.opt.timestep / read.masses,
        wrenches,
        matrix.indptr.astype(np.int64),
        matrix.indices.astype(np.int64),
        np.asarray(matrix.data, dtype=float),
        read.noise.shape[1],
        np.array(balls, dtype=np.int64).reshape(-1, 8),
        np.array([ball.ratios for ball in read.balls]).reshape(-1, 3),
        tree.bodies,
        tree.weights,
        acting_forces(model),
        tree.own_wrenches,
    )


def room_for_lone_bodies(lone: LoneBodies) -> LoneRoom:
    """Return scratch memory for one thread."""
    n = len(lone.masses)
    shapes = n, (len(lone.weights), 6), n + lone.channels, n, 2
    return LoneRoom(*map(np.zeros, shapes))


def _damping_and_noise(model: LoneModel, time: float) -> csr_array:
    """Compute the matrix (D L) of `LoneBodies`.

    Each group of velocities that are coupled by damping or noise is a separate block, computed by
    `magmotor.numerics.splittings.friction_and_noise`.
    """
    damping, noise = model.damping, model.noise
    n = len(damping)
    matrix = np.zeros((n, n + noise.shape[1]))
    groups, group = connected_components(csr_array(abs(damping) + abs(noise) @ abs(noise.T)))
    for number in range(groups):
        dofs = np.flatnonzero(group == number)
        channels = np.flatnonzero(noise[dofs].any(axis=0))
        decrement, increment = friction_and_noise(
            model.masses[dofs],
            damping[np.ix_(dofs, dofs)],
            noise[np.ix_(dofs, channels)],
            time,
            exact=True,
        )
        matrix[np.ix_(dofs, dofs)] = decrement
        matrix[np.ix_(dofs, n + channels)] = increment
    return csr_array(matrix)


def _twist_axes(ball: Ball) -> tuple[int, int, int]:
    """Return the axes of the twists in `move_lone_bodies`, in a symmetric sequence.

    They are the two axes other than that of the median moment of inertia. The one whose moment
    differs most from the median is in the middle; it is the symmetry axis of a symmetric body.
    """
    _, outer, middle = np.argsort(abs(ball.ratios - 1), kind="stable").tolist()
    return outer, middle, outer


@subroutine(forceinline=True)
def compute_lone_forces(model, data, offsets, lone, room, begun):
    """Update the frames, and compute the generalized forces at the current position.

    Unless the steps have `begun`, what selects the noise is checked.
    """
    force, wrenches = room.force, room.wrenches
    update_kinematics(model, data)
    d = memory.words(data, memory.UNBOUNDED)
    for i in range(len(force)):
        force[i] = 0.0
    if not begun and lone.forces & NOISE:
        # In scratch memory, since a force that the user applies to a noisy body must stay.
        apply_forces_to(wrenches, model, data, lone.forces & NOISE, force)
    apply_own_forces(model, data, offsets, lone, lone.forces & ~NOISE, wrenches, force)
    xfrc = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)
    applied = memory.numbers(d[offsets.qfrc_applied // 8], 1, memory.UNBOUNDED)[0]
    frames = memory.numbers(d[offsets.xmat // 8], memory.UNBOUNDED, 9)
    for body in range(1, len(lone.weights)):
        for k in range(3):
            wrenches[body, k] += xfrc[body, k] + lone.weights[body, k]
            wrenches[body, 3 + k] += xfrc[body, 3 + k]
    for i in range(len(force)):
        force[i] += applied[i]
        for k in range(6):
            force[i] += lone.wrenches[i, k] * wrenches[lone.bodies[i], k]
    for b in range(len(lone.balls)):
        body, dof = lone.balls[b, BODY], lone.balls[b, DOF]
        for k in range(3):
            for j in range(3):
                force[dof + k] += frames[body, 3 * j + k] * wrenches[body, 3 + j]


@subroutine(forceinline=True)
def kick_lone_bodies(qvel, lone, time, force, exchanged):
    """B: apply the force for a time, and book its work."""
    work = 0.0
    for i in range(len(qvel)):
        change = lone.kick[i] * force[i]
        work += time * force[i] * (qvel[i] + 0.5 * change)
        qvel[i] += change
    exchanged[-1] += work


@subroutine(forceinline=True)
def move_lone_bodies(model, qpos, qvel, lone, time):
    """A: move freely for a time.

    A body with equal moments of inertia rotates at a constant angular velocity. For any other body,
    the kinetic energy is split into that of a body whose moments all equal the median, and two
    corrections, which are twists about two body axes in a symmetric sequence. A symmetric body
    needs one twist, and its motion is exact.
    """
    for b in range(len(lone.balls)):
        if not lone.balls[b, ISOTROPIC]:
            for k in range(3):
                qvel[lone.balls[b, DOF] + k] *= lone.ratios[b, k]
    move(model, qpos, qvel, time)
    for b in range(len(lone.balls)):
        if not lone.balls[b, ISOTROPIC]:
            start, dof = lone.balls[b, QUATERNION], lone.balls[b, DOF]
            quaternion, momentum = qpos[start : start + 4], qvel[dof : dof + 3]
            for twist in range(TWIST, LAST_TWIST + 1):
                axis = lone.balls[b, twist]
                span = 0.5 * time if twist in (TWIST, LAST_TWIST) else time
                _twist(quaternion, momentum, axis, lone.ratios[b, axis], span)
            for k in range(3):
                momentum[k] /= lone.ratios[b, k]


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
def damp_and_drive_lone_bodies(qpos, qvel, lone, draw, room):
    """O: apply damping and noise, u += (D L) (u, xi), and book the heat.

    The angular velocities of isotropic bodies are in the frame of their reference attitude
    meanwhile, where their damping and noise are constant. For other bodies with noise, the three
    Brownian torques are rotated to the body's frame.
    """
    n, whole, change = len(qvel), room.whole, room.change
    copy(whole[:n], qvel)
    for channel in range(lone.channels):
        whole[n + channel] = standard_normal(draw, channel)
    for b in range(len(lone.balls)):
        axes = _axes(qpos, lone.balls[b, QUATERNION])
        if lone.balls[b, ISOTROPIC]:
            _to_reference(whole, lone.balls[b, DOF], axes)
        elif lone.balls[b, CHANNEL] >= 0:
            _to_body(whole, n + lone.balls[b, CHANNEL], axes)
    for i in range(n):
        change[i] = 0.0
        for k in range(lone.starts[i], lone.starts[i + 1]):
            change[i] += lone.values[k] * whole[lone.columns[k]]
    for b in range(len(lone.balls)):
        if lone.balls[b, ISOTROPIC]:
            axes = _axes(qpos, lone.balls[b, QUATERNION])
            _to_body(change, lone.balls[b, DOF], axes)
    heat = 0.0
    for i in range(n):
        heat += lone.masses[i] * change[i] * (qvel[i] + 0.5 * change[i])
        qvel[i] += change[i]
    room.exchanged[0] += heat


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
