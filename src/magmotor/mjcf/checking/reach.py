"""Which places the points of a model's bodies can reach, and how near points come to each other.

From one point to another, the joints between them make a chain of links: from the first point to an
anchor, from anchor to anchor, and to the second point. Slides change the vectors of links, and
turns leave their lengths as they are. So the points are at least as far from each other as one link
is longer than all others together. What all hinges leave along a common axis stays as it is, too.
"""

from collections.abc import Collection
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array

STRAIGHT = 1e-12
"""Sine of the angle below which two axes are parallel, and part of an axis that counts as none."""


class Link(NamedTuple):
    """Vectors within a rigid body, and how far slides change them along each axis, in m."""

    vector: Array
    """Shape (..., 3)."""
    room: Array
    """Shape (3,); infinite for free bodies."""

    def lengths(self, axis: Array | None = None) -> tuple[Array, Array]:
        """Return the smallest and the largest lengths, those across an axis if there is one."""
        vector, room = self.vector, self.room
        if axis is not None:
            across = np.eye(3) - np.multiply.outer(axis, axis)
            vector, room = vector @ across, _along(room, abs(across)).sum(axis=1)
        size = abs(vector)
        return (
            np.linalg.norm(np.maximum(size - room, 0), axis=-1),
            np.linalg.norm(size + room, axis=-1),
        )


class Reach(NamedTuple):
    """Bounds of where the points of a rigid body can be, seen from one of its ancestors."""

    links: tuple[Link, ...]
    """The first one begins at the world's origin, and the last one ends at the points (n, 3)."""
    axes: Array
    """The axes about which the joints between links turn, shape (k, 3)."""

    @property
    def centers(self) -> Array:
        """Where the first link ends, in m, shape (n, 3)."""
        return np.broadcast_to(self.links[0].vector, self._points().shape)

    @property
    def radii(self) -> Array:
        """How far turns move the points from there, shape (n,)."""
        return sum((each.lengths()[1] for each in self.links[1:]), np.zeros(len(self._points())))

    def _points(self) -> Array:
        return sum((each.vector for each in self.links), np.zeros((1, 3)))

    def gaps(self, other: "Reach") -> Array:
        """Return lower bounds (n, m) of the distances of the points from those of another body."""
        axis = _common_axis(np.vstack([self.axes, other.axes]))
        first, second = self.links[0], other.links[0]
        between = Link(
            np.atleast_2d(first.vector)[:, np.newaxis] - second.vector, first.room + second.room
        )
        chain = [each._replace(vector=np.atleast_2d(each.vector)[:, np.newaxis])
                 for each in self.links[1:]]  # fmt: skip
        chain += [between, *other.links[1:]]
        across = _longer_than_the_others([link.lengths(axis) for link in chain])
        if axis is None:
            return across
        along = self._points()[:, np.newaxis] @ axis - other._points() @ axis
        room = sum(float(_along(link.room, abs(axis)).sum()) for link in (*chain,))
        return np.hypot(across, np.maximum(abs(along) - room, 0))

    def lowest(self, point: Array, normal: Array) -> Array:
        """Return lower bounds (n,) of the heights of the points above a plane."""
        axis = _common_axis(self.axes)
        first, others = self.links[0], self.links[1:]
        height = (self.centers - point) @ normal - _along(first.room, abs(normal)).sum()
        if axis is None:
            return height - self.radii
        rise = float(axis @ normal)
        for link in others:
            room = float(_along(link.room, abs(axis)).sum()) if rise else 0.0
            height = height + rise * link.vector @ axis - abs(rise) * room
            if abs(rise) < 1:
                height = height - np.sqrt(1 - rise**2) * link.lengths(axis)[1]
        return height


def _along(room: Array, part: Array) -> Array:
    """Return how far slides move something along directions, of which parts may be 0."""
    part = np.where(part > STRAIGHT, part, 0)
    return np.multiply(room, part, out=np.zeros_like(part), where=part > 0)


def _common_axis(axes: Array) -> Array | None:
    """Return the axis to which all are parallel, if there is one."""
    if not len(axes) or np.linalg.norm(np.cross(axes, axes[0]), axis=1).max() > STRAIGHT:
        return None
    return axes[0]


def _longer_than_the_others(lengths: list[tuple[Array, Array]]) -> Array:
    """Return by how much one link is longer than all others together, at least; 0 or more."""
    endless = sum(np.isinf(longest).astype(int) for _, longest in lengths)
    finite = [np.where(np.isinf(longest), 0, longest) for _, longest in lengths]
    total, found = sum(finite), 0.0
    for (shortest, longest), own in zip(lengths, finite, strict=True):
        bounded = endless - np.isinf(longest) == 0
        found = np.maximum(found, np.where(bounded, shortest - (total - own), 0))
    return np.asarray(found)


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
    limits here (see `swept_gaps`), and bodies that a user moves (mocap) can be anywhere.
    """
    links, axes, anchor, travels = [], [np.zeros((0, 3))], np.zeros(3), []
    anywhere = np.full((3, 2), [-np.inf, np.inf])
    if (model.body_mocapid[_chain(model, body, ancestor)] >= 0).any():
        travels.append(anywhere)
    for joint in (j for each in _chain(model, body, ancestor) for j in _joints(model, each)):
        kind = model.jnt_type[joint]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            travels.append(anywhere)
        elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
            travel = np.array([-np.inf, np.inf])
            if joint in walls:
                travel = model.jnt_range[joint] - data.qpos[model.jnt_qposadr[joint]]
                travel = np.array([min(0.0, travel[0]), max(0.0, travel[1])])  # it may be outside
            way = data.xaxis[joint][:, np.newaxis]
            ends = np.multiply(way, travel, out=np.zeros((3, 2)), where=abs(way) > STRAIGHT)
            travels.append(np.sort(ends, axis=1))
        else:
            links.append(_link(data.xanchor[joint] - anchor, travels))
            anchor, travels = data.xanchor[joint].copy(), []
            ball = kind == mujoco.mjtJoint.mjJNT_BALL
            axes.append(np.eye(3) if ball else data.xaxis[[joint]])
    return Reach((*links, _link(points - anchor, travels)), np.vstack(axes))


def _link(vector: Array, travels: list[Array]) -> Link:
    """Return a link along which slides move something from a lowest to a highest vector."""
    lowest, highest = sum(travels, np.zeros((3, 2))).T
    bounded = np.isfinite(highest - lowest)
    middle = np.add(lowest, highest, out=np.zeros(3), where=bounded) / 2
    return Link(vector + middle, (highest - lowest) / 2)


def equality_is_between(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Return whether an active equality constraint acts on what is between two bodies, or on it."""
    joints = {*joints_between(model, one, other)}
    bodies = {*bodies_between(model, one, other)}
    for k in np.flatnonzero(model.eq_active0).tolist():
        kind, ends = model.eq_objtype[k], {int(model.eq_obj1id[k]), int(model.eq_obj2id[k])}
        if kind == mujoco.mjtObj.mjOBJ_SITE:
            kind, ends = mujoco.mjtObj.mjOBJ_BODY, {int(model.site_bodyid[end]) for end in ends}
        if kind == mujoco.mjtObj.mjOBJ_BODY and bodies & ends:
            return True
        if kind == mujoco.mjtObj.mjOBJ_JOINT and joints & ends:
            return True
    return False


def common_ancestor(model: mujoco.MjModel, one: int, other: int) -> int:
    """Return the lowest body that both bodies hang on; 0, the world, if they are separate."""
    while one != other:
        one, other = min(one, other), int(model.body_parentid[max(one, other)])
    return one


def joints_between(model: mujoco.MjModel, one: int, other: int) -> list[int]:
    """Return the joints that move one body as seen from another."""
    return [joint for each in bodies_between(model, one, other) for joint in _joints(model, each)]


def bodies_between(model: mujoco.MjModel, one: int, other: int) -> list[int]:
    """Return two bodies and what they hang on, up to and without what both hang on."""
    ancestor = common_ancestor(model, one, other)
    return _chain(model, one, ancestor) + _chain(model, other, ancestor)


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
