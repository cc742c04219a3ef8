"""Geoms of other bodies that move along with a magnet, such as a housing or the wheels of a robot.

They do if each joint in between leaves them where they are as seen from the magnet, like a wheel on
its axle; or leaves the magnet where it is; or is a slide, which moves them within its limits.
"""

import itertools
from collections.abc import Collection

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.reach import STRAIGHT, joints_between
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.iron import CAPSULE, CYLINDER, ELLIPSOID, PLANE, SPHERE
from magmotor.mjcf.declarations.user_numbers import HINGE, SLIDE
from magmotor.mjcf.lookup import disabled

ROUND = CAPSULE, CYLINDER

TRUE = 1e-6
"""Largest deviation of a wheel from its axle, over its radius."""


class Covers:
    """What moves along with the magnets of a model.

    `soft` are slides whose limits are too soft to count.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, soft: Collection[int] = ()
    ) -> None:
        self._model, self._data = model, data
        self._stops = np.zeros(model.njnt, bool)
        if not disabled(model, "limit"):
            self._stops[:] = model.jnt_limited.astype(bool) & (model.jnt_type == SLIDE)
        self._stops[[*soft]] = False
        self._welds, self._found = model.body_weldid[model.geom_bodyid], {}

    def rows(self, one: Magnet, other: Magnet, rows: NDArray) -> NDArray[np.int64]:
        """Return the rows of geoms that keep two magnets apart, but are not those of both.

        `rows` has two geoms that may touch, and their contact pair or -1.
        """
        own = [self._welds == magnet.body for magnet in (one, other)]
        if other.images:
            own[1] = own[1] & (self._model.geom_type == PLANE)
        along = [self._along(one), own[1] if other.images else self._along(other)]
        both = along[0] & along[1]
        along = [near & ~both | mine for near, mine in zip(along, own, strict=True)]
        along = [along[0] & ~own[1], along[1] & ~own[0]]

        def between(sides: list[NDArray]) -> NDArray:
            first, second = rows[:, 0], rows[:, 1]
            return sides[0][first] & sides[1][second] | sides[1][first] & sides[0][second]

        return rows[between(along) & ~between(own)]

    def slides(self, magnet: Magnet) -> set[int]:
        """Return the slides within whose limits geoms move along with a magnet."""
        model, found = self._model, set()
        for body in np.unique(self._welds[self._along(magnet)]).tolist():
            found |= {*joints_between(model, body, magnet.body)}
        return {joint for joint in found if self._stops[joint]}

    def around(self, magnet: Magnet, rows: NDArray) -> NDArray[np.int64]:
        """Return the geoms of these rows that are a magnet's own or move along with it."""
        both = np.unique(rows[:, :2])
        return both[self._along(magnet)[both]]

    def _along(self, magnet: Magnet) -> NDArray[np.bool_]:
        """Return which geoms move along with a magnet, or are its own."""
        if magnet.body not in self._found:
            model, root = self._model, self._model.body_rootid[magnet.body]
            near = (model.body_rootid[self._welds] == root) & (root > 0)
            near |= self._welds == magnet.body
            for geom in np.flatnonzero(near).tolist():
                near[geom] = len(self.places(magnet, geom)) > 0
            self._found[magnet.body] = near
        return self._found[magnet.body]

    def places(self, magnet: Magnet, geom: int) -> Array:
        """Return where a geom can be as seen from a magnet, less where it is, in m, shape (k, 3).

        Between these extreme places, it can be anywhere. There are none if it does not move along.
        """
        model, data = self._model, self._data
        body = int(model.body_weldid[model.geom_bodyid[geom]])
        joints = joints_between(model, body, magnet.body)
        own = {*joints_between(model, 0, magnet.body)}
        slides, hinges = [], []
        for joint in joints:
            if self._stops[joint]:
                travel = model.jnt_range[joint] - data.qpos[model.jnt_qposadr[joint]]
                way = -data.xaxis[joint] if joint in own else data.xaxis[joint]
                slides.append([min(0.0, travel[0]) * way, max(0.0, travel[1]) * way])
            elif self._leaves(joint, [geom]) or self._leaves_magnet(joint, magnet):
                hinges.append(joint)
            else:
                return np.zeros((0, 3))
        for end, joint in itertools.product(slides, hinges):
            way = end[1] - end[0]
            if np.linalg.norm(np.cross(way, data.xaxis[joint])) > STRAIGHT:
                return np.zeros((0, 3))  # at other places of the slide, the hinge moves something
        return np.array([sum(ends, np.zeros(3)) for ends in itertools.product(*slides)], float)

    def _leaves(self, joint: int, geoms: list[int]) -> bool:
        return all(_symmetric(self._model, self._data, geom, joint) for geom in geoms)

    def _leaves_magnet(self, joint: int, magnet: Magnet) -> bool:
        """Return whether a hinge turns a whole magnet about its own axis."""
        model, data = self._model, self._data
        if model.jnt_type[joint] != HINGE:
            return False
        geoms = np.flatnonzero(model.body_weldid[model.geom_bodyid] == magnet.body)
        off = np.cross(magnet.positions - data.xanchor[joint], data.xaxis[joint])
        small = TRUE * model.geom_rbound[geoms].max(initial=0.0)
        askew = np.linalg.norm(np.cross(magnet.axes, data.xaxis[joint]), axis=1).max() > TRUE
        return (
            not askew
            and bool(np.linalg.norm(off, axis=1).max() <= small)
            and self._leaves(joint, geoms.tolist())
        )


def _symmetric(model: mujoco.MjModel, data: mujoco.MjData, geom: int, joint: int) -> bool:
    """Return whether a joint leaves a geom where it is, since it turns it about its axis."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    offset = data.geom_xpos[geom] - data.xanchor[joint]
    small, axis = TRUE * model.geom_rbound[geom], data.xaxis[joint]
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
        return bool(kind == SPHERE and np.linalg.norm(offset) < small)
    if model.jnt_type[joint] != HINGE:
        return False
    if np.linalg.norm(np.cross(offset, axis)) > small:
        return False
    along = abs(axis @ data.geom_xmat[geom].reshape(3, 3)) > 1 - TRUE**2
    if kind == ELLIPSOID:
        across = size[~along]
        return bool(along.any() and abs(across[0] - across[-1]) < small)
    return bool(kind == SPHERE or (kind in ROUND and along[2]))
