"""Brownian wrenches on bodies; see `magmotor.mjcf.forces.brownian_wrenches`.

There, the number of a step is the time over the timestep. In single precision, this quotient is
wrong after some hours, and so steps are counted: a step has the next number if exactly a timestep
has passed. Any other time, as after a reset, has the number of that time, which is exact for the
first 2^22 steps.
"""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.noise import BrownianPath
from magmotor.warp.per_world import PerWorld
from magmotor.warp.random_numbers import normal

wp.set_module_options({"enable_backward": False})

SEED, REPLICA, FACTOR, LEVEL, FIRST = (wp.constant(k) for k in range(5))


@wp.kernel
def _count_steps(
    timestep: wp.array[float],
    now: wp.array[float],
    before: wp.array[float],
    number: wp.array[wp.int64],
):
    world = wp.tid()
    h = timestep[world % timestep.shape[0]]
    t = now[world]
    if t == before[world]:  # a later stage of RK4, or the same step again
        return
    if t == before[world] + h:
        number[world] += wp.int64(1)
    else:
        number[world] = wp.int64(wp.floor(wp.float64(t) / wp.float64(h) + wp.float64(0.5)))
    before[world] = t


@wp.kernel
def _set_brownian_wrenches(
    slot: wp.array[int],
    first: wp.array[int],
    rows: wp.array2d[wp.spatial_vector],
    paths: wp.array2d[wp.int64],
    timestep: wp.array[float],
    now: wp.array[float],
    number: wp.array[wp.int64],
    wrench: wp.array2d[wp.spatial_vector],
):
    world, k = wp.tid()
    path = world % paths.shape[0]
    replica = paths[path, REPLICA]
    if paths.shape[0] == 1:
        replica += wp.int64(world)
    step = number[world] + paths[path, FIRST]
    total = wp.spatial_vector()
    for channel in range(first[k], first[k + 1]):
        xi = normal(
            paths[path, SEED], replica, step, wp.int64(channel), paths[path, FACTOR],
            paths[path, LEVEL],
        )  # fmt: skip
        total += float(xi) * rows[world % rows.shape[0], channel]
    h = timestep[world % timestep.shape[0]]
    # Where the time stands still, the noise would, too.
    rate = wp.where(now[world] + h == now[world], wp.NAN, 1.0 / wp.sqrt(h))
    wrench[world, slot[k]] = rate * total


class Noise:
    """The Brownian wrenches of a model.

    Parameters
    ----------
    model : mujoco.MjModel
    path : BrownianPath

    Attributes
    ----------
    bodies : ndarray of int, shape (n,)
    slot : wp.array, shape (n,)
        The places of their wrenches.
    rows : wp.array of spatial vectors, shape (1 or nworld, channels)
        Force in N sqrt(s) and torque in N m sqrt(s) of each channel, in the order of the bodies.
    paths : wp.array of int64, shape (1 or nworld, 5)
        Seed, replica, factor, level and first step, as in `mjData.userdata` of MuJoCo. If there is
        one row, it is that of world 0, and the replicas of the other worlds follow.
    """

    rows, paths, slot = PerWorld(), PerWorld(), None

    def __init__(self, model: mujoco.MjModel, path: BrownianPath):
        rows = model.body_user[:, : model.nuser_body // 6 * 6].reshape(model.nbody, -1, 6)
        acts = np.any(rows, axis=2)
        self.bodies = np.flatnonzero(acts.any(axis=1)).astype(np.int32)
        first = np.concatenate([[0], np.cumsum(acts[self.bodies].sum(axis=1))])
        self._first = wp.array(first, dtype=int)
        self.rows = wp.array(rows[acts][None], dtype=wp.spatial_vector, ndim=2)
        self.paths = wp.array([[path.seed, 0, *path.view, 0]], dtype=wp.int64, ndim=2)

    def set_wrenches(self, m: Any, d: Any) -> None:
        """Write the wrenches of this step."""
        room, timestep = d.magmotor, m.opt.timestep
        wp.launch(
            _count_steps, dim=d.nworld, inputs=[timestep, d.time], outputs=[room.time, room.step]
        )
        wp.launch(
            _set_brownian_wrenches,
            dim=(d.nworld, len(self.bodies)),
            inputs=[self.slot, self._first, self.rows, self.paths, timestep, d.time, room.step],
            outputs=[room.wrench],
        )
