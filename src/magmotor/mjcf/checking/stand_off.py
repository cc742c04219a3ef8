"""How high above a plane the geoms of a magnet, and of what is joined to it, keep its dipoles.

A plane touches the convex hull of all geoms that collide with it. So in each orientation, the
height of a dipole is how much farther the hull reaches toward the plane than the dipole does. Only
those geoms of other bodies count that their joints leave where they are, like a wheel on its axle.
"""

import contextlib
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.contact_rule import SUNK
from magmotor.mjcf.checking.depth import CONVEX, tips
from magmotor.mjcf.checking.reach import joints_between
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.iron import CAPSULE, CYLINDER, ELLIPSOID, PLANE, SPHERE

ROUND = CAPSULE, CYLINDER

TRUE = 1e-6
"""Largest deviation of a wheel from its axle, over its radius."""

DIRECTIONS = 300
"""Number of directions, evenly spread, in which hulls are sampled."""

FOUND = 1e-9
"""Difference of directions that counts as none."""


class Stand(NamedTuple):
    """Orientations in which a magnet can be on a plane."""

    directions: Array
    """Toward the plane, as seen from the magnet where it is at present, shape (k, 3)."""
    heights: Array
    """Of its dipoles, in m, shape (k, n)."""


def stand(
    model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, geoms: NDArray, margin: float
) -> Stand | None:
    """Return how a magnet can be on a plane that these geoms touch; None if nothing holds it."""
    found = [geom for geom in geoms.tolist() if model.geom_type[geom] in CONVEX]
    if not found:
        return None
    frames = data.geom_xmat[found].reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 3)
    own = [frames, -frames, magnet.axes, -magnet.axes]
    outward = np.vstack([magnet.positions - data.geom_xpos[geom] for geom in found])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    directions = np.vstack([*own, outward, _evenly_spread(DIRECTIONS)])
    directions = directions[np.linalg.norm(directions, axis=1) > 0.5]
    sampled = np.vstack([tips(model, data, geom, directions) for geom in found])
    with contextlib.suppress(QhullError):  # as of geoms without volume
        directions = np.vstack([directions, ConvexHull(sampled).equations[:, :3]])
    _, first = np.unique(np.round(directions / FOUND), axis=0, return_index=True)
    directions = directions[np.sort(first)]
    farthest = [(tips(model, data, geom, directions) * directions).sum(1) for geom in found]
    heights = np.max(farthest, axis=0)[:, np.newaxis] - directions @ magnet.positions.T
    return Stand(directions, heights + margin)


def standing_rows(
    model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, plane: Magnet, rows: NDArray
) -> NDArray[np.int64]:
    """Return the rows of geoms that keep a magnet off a plane though they are not its own.

    `rows` has two geoms that may touch, and their contact pair or -1.
    """
    welds = model.body_weldid[model.geom_bodyid[rows[:, :2]]]
    flat = (model.geom_type[rows[:, :2]] == PLANE) & (welds == plane.body)
    root = model.body_rootid[magnet.body]
    near = (model.body_rootid[welds] == root) & (welds != magnet.body) & (root > 0)
    candidates = rows[(flat & near[:, ::-1]).any(axis=1)]
    held = []
    for row in candidates.tolist():
        one, other = row[:2]
        geom = other if model.geom_type[one] == PLANE else one
        body = int(model.body_weldid[model.geom_bodyid[geom]])
        joints = joints_between(model, body, magnet.body)
        held.append(all(_symmetric(model, data, geom, joint) for joint in joints))
    return candidates[np.array(held, bool)]


def _symmetric(model: mujoco.MjModel, data: mujoco.MjData, geom: int, joint: int) -> bool:
    """Return whether a joint leaves a geom where it is, since it turns it about its axis."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    offset = data.geom_xpos[geom] - data.xanchor[joint]
    small, axis = TRUE * model.geom_rbound[geom], data.xaxis[joint]
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
        return bool(kind == SPHERE and np.linalg.norm(offset) < small)
    if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
        return False
    if np.linalg.norm(np.cross(offset, axis)) > small:
        return False
    along = abs(axis @ data.geom_xmat[geom].reshape(3, 3)) > 1 - TRUE**2
    if kind == ELLIPSOID:
        across = size[~along]
        return bool(along.any() and abs(across[0] - across[-1]) < small)
    return bool(kind == SPHERE or (kind in ROUND and along[2]))


def contacts_that_share(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    direction: Array,
    heights: Array,
    depth: float,
    rows: NDArray,
) -> float:
    """Return how many contacts, if each bore the same load, would yield as those with a plane do.

    MuJoCo finds them, with the first magnet's tree turned so that `direction` points into the
    plane, and a little lower than at `heights`. It is 1 for trees that cannot turn freely.
    """
    magnet, plane = magnets
    root = int(model.body_rootid[magnet.body])
    joint = int(model.body_jntadr[root])
    if joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
        return 1.0
    frame = frame_of(data.geom_xmat[plane.elements[0] - model.nsite, 2::3])
    turn, first = frame.T @ frame_of(-direction), magnet.positions[0]
    place = plane.positions[0] + (heights[0] - SUNK * depth) * frame[0]
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    pose, start = mujoco.MjData(model), int(model.jnt_qposadr[joint])
    pose.qpos[:] = data.qpos
    pose.qpos[start : start + 3] = place + turn @ (data.xpos[root] - first)
    mujoco.mju_mulQuat(pose.qpos[start + 3 : start + 7], quaternion, data.xquat[root])
    mujoco.mj_fwdPosition(model, pose)
    pairs = {frozenset(row[:2]) for row in rows.tolist()}
    found = [each.pos for each in pose.contact if frozenset(each.geom.tolist()) in pairs]
    weights = magnet.strengths / magnet.strengths.sum()
    pull = place + turn @ (weights @ (magnet.positions - first))
    return _evenly_loaded((np.array(found).reshape(-1, 3) - pull) @ frame[1:].T)


def _evenly_loaded(offsets: Array) -> float:
    """Return how many springs below a load would yield as springs at offsets (n, 2) from it do."""
    size = abs(offsets).max(initial=1e-12)
    balance = np.vstack([np.ones(len(offsets)), offsets.T / size])
    shares = np.linalg.pinv(balance, rcond=0.01) @ [1, 0, 0]
    missed = abs(balance @ shares - [1, 0, 0]).max()
    return float(1 / (shares @ shares)) if missed < 0.01 and shares.min() > -0.01 else 1.0


def frame_of(first: Array) -> Array:
    """Return the rows of a rotation matrix whose first one is given."""
    second = np.cross(first, np.eye(3)[abs(first).argmin()])
    second /= np.linalg.norm(second)
    return np.array([first, second, np.cross(first, second)], dtype=float)


def _evenly_spread(count: int) -> Array:
    """Return points on a sphere, shape (count, 3)."""
    heights = 1 - (2 * np.arange(count) + 1) / count
    angles = np.pi * (1 + 5**0.5) * np.arange(count)
    around = np.column_stack([np.cos(angles), np.sin(angles)]) * np.sqrt(1 - heights**2)[:, None]
    return np.column_stack([around, heights])
