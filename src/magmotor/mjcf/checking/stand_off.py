"""How high above a plane the geoms of a magnet, and of what is joined to it, keep its dipoles.

A plane touches the convex hull of all geoms that collide with it. So in each orientation, the
height of a dipole is how much farther the hull reaches toward the plane than the dipole does.
"""

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.contact_rule import SUNK
from magmotor.mjcf.checking.covers import Covers
from magmotor.mjcf.checking.depth import CONVEX, hull_directions, tips
from magmotor.mjcf.checking.poses import Freedom
from magmotor.mjcf.checking.strengths import Magnet

FOUND = 1e-9
"""Difference of directions that counts as none."""


class Stand(NamedTuple):
    """Orientations in which a magnet can be on a plane."""

    directions: Array
    """Toward the plane, as seen from the magnet where it is at present, shape (k, 3)."""
    heights: Array
    """Of its dipoles, in m, shape (k, n)."""


def stand(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    geoms: NDArray,
    margin: float,
    covers: Covers,
    freedom: Freedom,
) -> Stand | None:
    """Return how a magnet can be on a plane that these geoms touch; None if nothing holds it.

    `covers` knows the geoms of other bodies, and `freedom` the orientations that joints allow.
    """
    magnet, plane = magnets
    found = [geom for geom in geoms.tolist() if model.geom_type[geom] in CONVEX]
    if not found:
        return None
    outward = np.vstack([magnet.positions - data.geom_xpos[geom] for geom in found])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    more = [magnet.axes, -magnet.axes, outward]
    directions = hull_directions(model, data, found, np.vstack(more))
    if not freedom.whole:
        down = -data.geom_xmat[plane.elements[0] - model.nsite, 2::3]
        directions = np.vstack([freedom.turned(down), directions[freedom.allows(directions, down)]])
    _, first = np.unique(np.round(directions / FOUND), axis=0, return_index=True)
    directions = directions[np.sort(first)]
    farthest = [(tips(model, data, geom, directions) * directions).sum(1)
                + (directions @ np.transpose(covers.places(magnet, geom))).min(axis=1)
                for geom in found]  # fmt: skip
    heights = np.max(farthest, axis=0)[:, np.newaxis] - directions @ magnet.positions.T
    return Stand(directions, heights + margin)


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
