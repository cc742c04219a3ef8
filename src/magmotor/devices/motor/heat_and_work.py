"""Heat and work of the motor in MuJoCo, by a compiled loop over steps."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.job import Job
from magmotor.devices.ball.rigid_forces import step_coefficients
from magmotor.devices.ball.rigid_steps import (
    exchanged_by_ball,
    exchanged_by_ring,
    heat_and_work,
)
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.variational import bodies
from magmotor.noise import normal
from magmotor.numerics.arrays import copy
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import dot, mul_quat, rot_vec_quat, scaled
from magmotor.numerics.splittings import RIGID


def heat_and_work_sums(job: Job, linear: int, before: Array, paths: Array, first: int) -> Array:
    """Compute heat of ball and ring and work on them after each step; see `MujocoAdapter.sums`.

    Parameters
    ----------
    job : Job
    linear : int
        Number of the ball's translational coordinates.
    before, paths, first
        As in `MujocoAdapter.sums`.

    Returns
    -------
    ndarray, shape (replicas, steps, 4)
        Heat of ball and ring, work on ball and ring, in J.
    """
    scene, path = job.scene, job.path
    sums = np.empty((*paths.shape[:2], 4))
    if job.scheme == "baoab":
        coefficients = step_coefficients(bodies(scene), RIGID["baoab"], job.timestep)
        _exact_sums()(sums, before, paths, bodies(scene), coefficients.exchange[FRICTION])
        return sums
    _sums()(
        sums,
        before,
        paths,
        linear,
        scene.ball_radius,
        _coefficients(scene),
        (path.seed, job.first_step + first, *path.view),
        job.timestep,
        job.scheme == "rk4",
    )
    return sums


FRICTION = RIGID["baoab"].parts.index("O")
"""Number of the part of friction and noise."""


def _coefficients(scene: Motor) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return friction, noise and channel of each velocity; only nonzero noises are counted."""
    drags, drag_noises = (scene.drag, scene.rotational_drag), scene.drag_noises
    frictions, noises = (
        np.array([*own[:2], *2 * [drag], *3 * [turning], *own[2:]])
        for own, (drag, turning) in ((scene.frictions, drags), (scene.noises, drag_noises))
    )
    driven = noises > 0
    return frictions, noises, np.where(driven, np.cumsum(driven) - 1, 0)


@subroutine(forceinline=True)
def _world(quaternion, spin):
    """Return an orientation, and a body's angular velocity in the world frame."""
    q = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    return q, rot_vec_quat(q, (spin[0], spin[1], spin[2]))


@subroutine(forceinline=True)
def _velocities(row, linear, radius):
    """Slip, velocity and spin of the ball, and spin of the ring, in the world frame."""
    v = row[linear + 8 :]
    _, (x, y, z) = _world(row[linear : linear + 4], v[linear : linear + 3])
    _, (a, b, c) = _world(row[linear + 4 : linear + 8], v[linear + 3 : linear + 6])
    return v[0] - radius * y, v[1] + radius * x, v[0], v[1], x, y, z, a, b, c


@subroutine(forceinline=True)
def _displacements(before, after, linear, radius):
    """Integrals of `_velocities` over a step, from its ends."""
    x, y, z = _turn(before[linear : linear + 4], after[linear : linear + 4])
    a, b, c = _turn(before[linear + 4 : linear + 8], after[linear + 4 : linear + 8])
    along, across = after[0] - before[0], after[1] - before[1]
    return along - radius * y, across + radius * x, along, across, x, y, z, a, b, c


@subroutine(forceinline=True)
def _turn(before, after):
    """Return the rotation vector between two orientations, less than half a turn apart."""
    back = before[0], -before[1], -before[2], -before[3]
    w, x, y, z = mul_quat((after[0], after[1], after[2], after[3]), back)
    sine = math.copysign(math.sqrt(dot((x, y, z), (x, y, z))), w)
    return scaled(2.0 * math.atan2(sine, abs(w)) / sine if sine != 0.0 else 2.0, (x, y, z))


@subroutine(forceinline=True)
def _bodies(qpos, qvel):
    """Return ball and ring as in `rigid_steps`, on a plane without a contact."""
    ball, spin = _world(qpos[2:6], qvel[2:5])
    return ((qpos[0], qpos[1]), (qvel[0], qvel[1]), ball, spin), _world(qpos[6:10], qvel[5:8])


@compiled_once(nogil=True, error_model="numpy")
def _exact_sums(checksum: int):
    """Compile the loop over replicas and steps for exact friction and noise."""

    def advance(sums, before, paths, bodies, exchange):
        _ = checksum
        none = (0.0, 0.0, 0.0)
        for replica in range(len(paths)):
            ball_heat, ring_heat, ball_work, ring_work = before[replica, -4:]
            on_ball, on_ring = (ball_heat, ball_work), (ring_heat, ring_work)
            for i in range(paths.shape[1]):
                middle = paths[replica, i, 18:]
                ball, ring = _bodies(middle, middle[10:])
                later, turned = _bodies(middle, middle[18:])
                on_ball = exchanged_by_ball(on_ball, ball, later, 0.0, none, none, bodies, exchange)
                on_ring = exchanged_by_ring(on_ring, ring, turned, 0.0, none, bodies, exchange)
                total = sums[replica, i]
                total[0], total[1], total[2], total[3] = (
                    on_ball[0], on_ring[0], on_ball[1], on_ring[1],
                )  # fmt: skip

    return advance


@compiled_once(nogil=True, error_model="numpy")
def _sums(checksum: int):
    """Compile the loop over replicas and steps for other methods."""

    def advance(sums, before, paths, linear, radius, coefficients, path, timestep, smooth):
        _ = checksum
        frictions, noises, channels = coefficients
        seed, first, factor, level = path
        total = np.empty(4)
        root = math.sqrt(timestep)
        for replica in range(len(paths)):
            row, end = before[replica], _velocities(before[replica], linear, radius)
            copy(total, before[replica, -4:])
            for i in range(paths.shape[1]):
                start, end = end, _velocities(paths[replica, i], linear, radius)
                moved = _displacements(row, paths[replica, i], linear, radius)
                row = paths[replica, i]
                for k in range(10):
                    if frictions[k] == 0.0 and noises[k] == 0.0:
                        continue
                    increment = 0.0
                    if noises[k] > 0.0:
                        xi = normal(seed, replica, first + i, channels[k], factor, level)
                        increment = root * xi
                    if smooth:  # the velocity within a step is a curve with this mean
                        mean, change = moved[k] / timestep, end[k] - start[k]
                        within = frictions[k] * change * change * timestep / 12.0
                    else:
                        mean, within = 0.5 * (start[k] + end[k]), 0.0
                    heat, work = heat_and_work(mean, frictions[k], noises[k], increment, timestep)
                    body = 0 if k < 7 else 1
                    total[body] += heat + within
                    total[2 + body] += work
                copy(sums[replica, i], total)

    return advance
