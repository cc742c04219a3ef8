"""How near points of two bodies come to each other within the limits of the joints between them.

The limits of slides and hinges span a box, which is halved along all joints, again and again. Cells
are left out in which even the largest motion of the points from their places at the center of the
cell brings no pair nearer to each other than it is somewhere else.
"""

from collections.abc import Collection, Sequence

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.checking.reach import bodies_between, joints_between
from magmotor.mjcf.declarations.user_numbers import HINGE, SLIDE
from magmotor.mjcf.lookup import disabled

MOST_JOINTS = 4
"""Largest number of joints whose limits are considered."""

FIRST = {1: 16, 2: 8, 3: 4, 4: 4}
"""Number of cells along each joint at first, by the number of joints."""

MOST_DISTANCES, HALVINGS = 60_000, 30
"""Largest number of distances that are computed at a time, and of halvings of cells."""

PRECISION = 0.02
"""Part of the smallest distance to which it is found, unless there are too many cells."""


def limited_joints(model: mujoco.MjModel, one: int, other: int) -> list[int]:
    """Return the slides between two bodies that have limits; and hinges, if these can be judged.

    They can be if the limits bound all motion of the bodies against each other, by a few joints.
    """
    if disabled(model, "limit"):
        return []
    joints = joints_between(model, one, other)
    limited = [j for j in joints if model.jnt_limited[j] and model.jnt_type[j] in (SLIDE, HINGE)]
    slides = [j for j in limited if model.jnt_type[j] == SLIDE]
    return limited if swept_joints(model, one, other, limited) else slides


def swept_joints(model: mujoco.MjModel, one: int, other: int, walls: Collection[int]) -> list[int]:
    """Return the joints between two bodies if limits of hinges help to bound all motion; else none.

    `walls` are the joints that stop at their limits.
    """
    joints = joints_between(model, one, other)
    kinds = dict(zip(joints, model.jnt_type[joints].tolist(), strict=True))
    helps = any(kinds[j] == HINGE for j in joints if j in walls)
    bounded = all(kind == HINGE or (kind == SLIDE and j in walls) for j, kind in kinds.items())
    by_user = (model.body_mocapid[bodies_between(model, one, other)] >= 0).any()
    return joints if helps and bounded and not by_user and len(joints) <= MOST_JOINTS else []


def turns_left_out(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Return whether limits of hinges or balls between two bodies are not considered."""
    if disabled(model, "limit"):
        return False
    considered = limited_joints(model, one, other)
    joints = [j for j in joints_between(model, one, other) if j not in considered]
    return any(model.jnt_limited[j] and model.jnt_type[j] != SLIDE for j in joints)


def swept_gaps(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    joints: list[int],
    walls: Collection[int],
    bodies: tuple[int, int],
    points: Sequence[Array],
    normal: Array | None = None,
) -> Array:
    """Return lower bounds (n, m) of the distances of points (n, 3) and (m, 3) of two bodies.

    With a normal, they are those along it, of the first points above the second. Of many points,
    the bounds are those of spheres around all points of a body.
    """
    if len(points[0]) * len(points[1]) * FIRST[len(joints)] ** len(joints) > MOST_DISTANCES:
        centers = [own.mean(axis=0, keepdims=True) for own in points]
        least = swept_gaps(model, data, joints, walls, bodies, centers, normal)
        radii = [np.linalg.norm(own - center, axis=1).max()
                 for own, center in zip(points, centers, strict=True)]  # fmt: skip
        return np.full((len(points[0]), len(points[1])), least[0, 0] - sum(radii))
    ranges = np.array([_range(model, data, j, j in walls) for j in joints])
    above = [joints_between(model, 0, body) for body in bodies]
    sides = [[k for k, joint in enumerate(joints) if joint in own] for own in above]
    width = (ranges[:, 1] - ranges[:, 0]) / FIRST[len(joints)]
    steps = np.indices([FIRST[len(joints)]] * len(joints)).reshape(len(joints), -1).T
    cells, reach = ranges[:, 0] + (steps + 0.5) * width, np.zeros(len(joints))
    least = best = np.full((len(points[0]), len(points[1])), np.inf)
    most = max(1, MOST_DISTANCES // (len(points[0]) * len(points[1])))
    for _ in range(HALVINGS):
        moved = []
        for side, own in zip(sides, points, strict=True):
            places = np.broadcast_to(own, (len(cells), *own.shape))
            for k in reversed(side):
                places, radius = _moved(model, data, joints[k], cells[:, k], places)
                reach[k] = max(reach[k], radius)
            moved.append(places)
        between = moved[0][:, :, np.newaxis] - moved[1][:, np.newaxis]
        found = np.linalg.norm(between, axis=-1) if normal is None else between @ normal
        slack = float(reach @ width / 2)
        best = np.minimum(best, found.min(axis=0))
        enough = best - PRECISION * abs(best)
        within = found - slack < enough
        kept = within.any(axis=(1, 2))
        children = np.count_nonzero(kept) << len(joints)
        least = np.minimum(enough, (found - slack).min(axis=0, where=within, initial=np.inf))
        if not children or children > most:
            break
        corners = np.indices([2] * len(joints)).reshape(len(joints), -1).T - 0.5
        cells = (cells[kept][:, np.newaxis] + corners * width / 2).reshape(-1, len(joints))
        width = width / 2
    return least - COINCIDENCE  # which is more than rounding


def _range(
    model: mujoco.MjModel, data: mujoco.MjData, joint: int, stops: bool
) -> tuple[float, float]:
    """Return how far a joint can move from its present position, downward and upward."""
    if not stops:
        return -np.pi, np.pi
    low, high = model.jnt_range[joint] - data.qpos[model.jnt_qposadr[joint]]
    return min(0.0, float(low)), max(0.0, float(high))  # it may be outside of its range


def _moved(
    model: mujoco.MjModel, data: mujoco.MjData, joint: int, moves: Array, places: Array
) -> tuple[Array, float]:
    """Return points (k, n, 3) after moves (k,) of a joint, and the largest motion per move."""
    axis = data.xaxis[joint]
    if model.jnt_type[joint] == SLIDE:
        return places + moves[:, np.newaxis, np.newaxis] * axis, 1.0
    arms = places - data.xanchor[joint]
    along = (arms @ axis)[..., np.newaxis] * axis
    across, sine, cosine = np.cross(axis, arms), np.sin(moves), np.cos(moves)
    turned = along + cosine[:, None, None] * (arms - along) + sine[:, None, None] * across
    return data.xanchor[joint] + turned, float(np.linalg.norm(across, axis=-1).max())
