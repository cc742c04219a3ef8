"""Heat and work of the motor in MuJoCo, by a compiled loop over steps."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.job import Job
from magmotor.devices.ball.rigid_steps import heat_and_work
from magmotor.devices.motor.scene import Motor
from magmotor.noise import normal
from magmotor.numerics.numba_cache import compiled_once, copy
from magmotor.numerics.rotations import rot_vec_quat
from magmotor.numerics.subroutine import subroutine


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
    _sums()(
        sums,
        before,
        paths,
        linear,
        scene.ball_radius,
        _coefficients(scene),
        (path.seed, job.first_step + first, *path.view),
        job.timestep,
        job.scheme == "baoab",
    )
    return sums


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
def _velocities(row, linear, radius):
    """Slip, velocity and spin of the ball, and spin of the ring, in the world frame."""
    ball, ring = row[linear : linear + 4], row[linear + 4 : linear + 8]
    v = row[linear + 8 :]
    spin, ring_spin = v[linear : linear + 3], v[linear + 3 : linear + 6]
    x, y, z = rot_vec_quat((ball[0], ball[1], ball[2], ball[3]), (spin[0], spin[1], spin[2]))
    q = (ring[0], ring[1], ring[2], ring[3])
    a, b, c = rot_vec_quat(q, (ring_spin[0], ring_spin[1], ring_spin[2]))
    return v[0] - radius * y, v[1] + radius * x, v[0], v[1], x, y, z, a, b, c


@compiled_once(nogil=True, error_model="numpy")
def _sums(checksum: int):
    """Compile the loop over replicas and steps."""

    def advance(sums, before, paths, linear, radius, coefficients, path, timestep, exact):
        _ = checksum
        frictions, noises, channels = coefficients
        seed, first, factor, level = path
        total = np.empty(4)
        root = math.sqrt(timestep)
        for replica in range(len(paths)):
            end = _velocities(before[replica], linear, radius)
            copy(total, before[replica, -4:])
            for i in range(paths.shape[1]):
                start, end = end, _velocities(paths[replica, i], linear, radius)
                for k in range(10):
                    if frictions[k] == 0.0 and noises[k] == 0.0:
                        continue
                    increment = 0.0
                    if noises[k] > 0.0:
                        xi = normal(seed, replica, first + i, channels[k], factor, level)
                        increment = root * xi
                    heat, work = heat_and_work(
                        start[k], end[k], frictions[k], noises[k], increment, timestep, exact
                    )
                    body = 0 if k < 7 else 1
                    total[body] += heat
                    total[2 + body] += work
                copy(sums[replica, i], total)

    return advance
