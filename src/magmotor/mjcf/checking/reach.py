"""Which places the points of a model's bodies can reach."""

from collections.abc import Collection
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.lookup import disabled


class Reach(NamedTuple):
    """Bounds of where the points of a rigid body can be, seen from one of its ancestors."""

    centers: Array
    """In m, shape (n, 3)."""
    room: Array
    """How far slides move them along each axis, shape (n, 3); infinite for free bodies."""
    radii: Array
    """How far turns move them, shape (n,)."""

    def gaps(self, other: "Reach") -> Array:
        """Return how near points come to those of another body at least, (n, m); 0 or less: all."""
        apart = abs(self.centers[:, np.newaxis] - other.centers)
        apart -= self.room[:, np.newaxis] + other.room
        apart = np.linalg.norm(np.maximum(apart, 0), axis=-1)
        return apart - self.radii[:, np.newaxis] - other.radii

    def lowest(self, point: Array, normal: Array) -> Array:
        """Return lower bounds (n,) of the heights of the points above a plane."""
        along = abs(normal)
        fall = np.multiply(self.room, along, out=np.zeros_like(self.room), where=along > 1e-9)
        return (self.centers - point) @ normal - fall.sum(axis=1) - self.radii


def reach(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: int,
    ancestor: int,
    points: Array,
    walls: Collection[int] = (),
) -> Reach:
    """Return where points of a body can be, whose places at present are `points` (n, 3).

    Only those slides stop at their limits that are in `walls`; hinges and balls turn without
    limits, and bodies that a user moves (mocap) can be anywhere.
    """
    center, anchor, arm = None, np.zeros(3), 0.0
    lowest, highest = np.zeros(3), np.zeros(3)
    if (model.body_mocapid[_chain(model, body, ancestor)] >= 0).any():
        lowest, highest = np.full((2, 3), [[-np.inf], [np.inf]])
    for joint in (j for each in _chain(model, body, ancestor) for j in _joints(model, each)):
        kind = model.jnt_type[joint]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            lowest, highest = np.full((2, 3), [[-np.inf], [np.inf]])
        elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
            travel = np.array([-np.inf, np.inf])
            if joint in walls:
                travel = model.jnt_range[joint] - data.qpos[model.jnt_qposadr[joint]]
            along = np.tile(abs(travel).max(), 3)
            ends = np.array([-along, along])
            if center is None:
                way = data.xaxis[joint]
                ends = np.multiply.outer(travel, way, out=np.zeros((2, 3)), where=abs(way) > 1e-9)
            lowest, highest = lowest + ends.min(axis=0), highest + ends.max(axis=0)
        else:
            place = data.xanchor[joint].copy()
            if center is None:
                center = place
            else:
                arm += float(np.linalg.norm(place - anchor))
            anchor = place
    radii = np.zeros(len(points))
    if center is not None:
        radii = arm + np.linalg.norm(points - anchor, axis=1)
        points = np.tile(center, (len(points), 1))
    room, bounded = (highest - lowest) / 2, np.isfinite(highest - lowest)
    middle = np.add(lowest, highest, out=np.zeros(3), where=bounded) / 2
    return Reach(points + middle, np.tile(room, (len(points), 1)), radii)


def limited_slides(model: mujoco.MjModel, body: int, ancestor: int) -> list[int]:
    """Return the slides of a body, and of what it hangs on up to an ancestor, that have limits."""
    if disabled(model, "limit"):
        return []
    joints = [joint for each in _chain(model, body, ancestor) for joint in _joints(model, each)]
    slide = mujoco.mjtJoint.mjJNT_SLIDE
    return [j for j in joints if model.jnt_limited[j] and model.jnt_type[j] == slide]


def common_ancestor(model: mujoco.MjModel, one: int, other: int) -> int:
    """Return the lowest body that both bodies hang on; 0, the world, if they are separate."""
    while one != other:
        one, other = min(one, other), int(model.body_parentid[max(one, other)])
    return one


def _chain(model: mujoco.MjModel, body: int, ancestor: int) -> list[int]:
    """Return a body and what it hangs on, up to and without an ancestor, from the top."""
    chain = []
    while body != ancestor:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain[::-1]


def _joints(model: mujoco.MjModel, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))
