"""The poses of two magnets, as seen from each other, that their joints allow.

Where a joint lets magnets turn in all ways, each face of one can be on each face of the other.
Hinges that are all parallel, or of two directions, leave fewer orientations; in each of them, a
face of one or the other is turned toward the partner. Slides, too, leave some directions out.
"""

import itertools
from collections.abc import Collection, Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.checking.dipole_depth import Side
from magmotor.mjcf.checking.reach import STRAIGHT, bodies_between, common_ancestor, joints_between
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.user_numbers import HINGE, SLIDE

MOST = 200
"""Largest number of pairs of faces, of those whose dipoles come nearest to each other."""

ANGLES = {1: 24, 2: 12}
"""Number of angles of each hinge, by the number of their directions."""

SAME = 1e-9
"""Difference of directions that counts as none."""

ASIDE = 0.7
"""How far aside of a face, over its half width, another one is moved off what is in the way."""


class Pose(NamedTuple):
    """A point x of the second magnet is at `turn` x + `shift`, and farther along `normal`."""

    turn: Array
    shift: Array
    normal: Array
    """From the first magnet to the second one."""
    aside: float = 0.0
    """How far aside of each other dipoles are at least, in m."""
    center: Array = np.zeros(3)
    """A point on the line of the dipoles."""

    def starts(self, least: float) -> list[float]:
        """Return how far along to begin so that dipoles are `least` or more from each other."""
        start = max(least**2 - self.aside**2, 0.0) ** 0.5
        return [start, max(start, self.aside / 2)] if self.aside else [start]


def any_poses(sides: tuple[Side, Side], acts: NDArray[np.bool_]) -> Iterator[Pose]:
    """Yield poses with faces toward each other, dipole on dipole.

    `acts` (n, m) says which dipoles act on which.
    """
    one, other = sides
    pairs = np.stack(np.meshgrid(one.distinct, other.distinct), axis=-1).reshape(-1, 2)
    apart = np.where(acts, one.depth[:, np.newaxis] + other.depth, np.inf)
    near = apart[one.dipole[pairs[:, 0]], other.dipole[pairs[:, 1]]]
    chosen = np.argsort(near, kind="stable")[: min(MOST, (near < np.inf).sum())]
    onto = np.diag([1.0, -1.0, -1.0])
    for i, j in pairs[chosen].tolist():
        upright = one.frame(i)
        turn = upright.T @ onto @ other.frame(j)
        second = turn @ other.magnet.positions[other.dipole[j]]
        center = one.magnet.positions[one.dipole[i]]
        yield Pose(turn, center - second, upright[2], center=center)


def quarters(pose: Pose) -> Iterator[Pose]:
    """Yield the same pose with the second magnet turned by quarters about the normal."""
    x, y, z = pose.normal
    quarter = np.outer(pose.normal, pose.normal) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn, shift, center = pose.turn, pose.shift, pose.center
    for _ in range(3):
        turn, shift = quarter @ turn, quarter @ (shift - center) + center
        yield pose._replace(turn=turn, shift=shift)


def beside(sides: tuple[Side, Side], pose: Pose) -> Iterator[Pose]:
    """Yield the same pose with the second magnet moved aside in eight directions."""
    frame = np.linalg.svd(pose.normal[np.newaxis])[2][1:]
    widths = np.zeros(2)
    for side, axes in zip(sides, (frame, frame @ pose.turn), strict=True):
        widths = np.maximum(widths, side.widths(axes))
    for u, v in itertools.product((-1, 0, 1), repeat=2):
        if u or v:
            yield pose._replace(shift=pose.shift + ASIDE * (np.array([u, v]) * widths) @ frame)


class Freedom:
    """The orientations that joints allow two magnets, if they do not allow all.

    `walls` are the joints that stop at their limits.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        magnets: tuple[Magnet, Magnet],
        walls: Collection[int],
    ) -> None:
        self._model, self._data, self._walls = model, data, walls
        bodies = [magnet.body for magnet in magnets]
        ancestor = common_ancestor(model, *bodies)
        own, others = (joints_between(model, ancestor, body) for body in bodies)
        self._own, self._chain = own, own[::-1] + others  # from the first magnet to the second one
        kinds = {*model.jnt_type[self._chain].tolist()}
        by_user = (model.body_mocapid[bodies_between(model, *bodies)] >= 0).any()
        self._groups: list[list[int]] = []
        """The hinges, those together that follow each other and are parallel."""
        for joint in (j for j in self._chain if model.jnt_type[j] == HINGE):
            axis = data.xaxis[joint]
            last = data.xaxis[self._groups[-1][-1]] if self._groups else np.zeros(3)
            if np.linalg.norm(np.cross(axis, last)) <= STRAIGHT and last.any():
                self._groups[-1].append(joint)
            else:
                self._groups.append([joint])
        self.whole = bool(kinds - {HINGE, SLIDE} or by_user or len(self._groups) > max(ANGLES))
        """Whether they can have any orientation."""

    def poses(self, sides: tuple[Side, Side]) -> Iterator[Pose]:
        """Yield the present pose, and others that the joints allow."""
        one, other = sides
        nearest = np.linalg.norm(
            one.magnet.positions[:, np.newaxis] - other.magnet.positions, axis=2
        )
        i, j = np.unravel_index(nearest.argmin(), nearest.shape)
        between = other.magnet.positions[j] - one.magnet.positions[i]
        if np.linalg.norm(between) > COINCIDENCE:
            away = float(np.linalg.norm(between))
            yield Pose(np.eye(3), np.zeros(3), between / away, away)
        for angles in itertools.product(*map(self._angles, self._groups)):
            turn, shift, span = self._moved(angles)
            _, sizes, rows = np.linalg.svd(span.reshape(-1, 3), full_matrices=False)
            axes = rows[sizes > 1e-6]
            project = axes.T @ axes if len(axes) else np.eye(3)
            normals = np.vstack([one.normals, -other.normals @ turn.T]) @ project
            lengths = np.linalg.norm(normals, axis=1)
            normals = normals[lengths > 0.1] / lengths[lengths > 0.1, np.newaxis]
            for normal in np.unique(normals.round(9), axis=0):
                places = other.magnet.positions @ turn.T
                first = one.magnet.positions[(one.magnet.positions @ normal).argmax()]
                second = places[(places @ normal).argmin()]
                left = first - second - shift
                level = project @ left
                yield Pose(turn, shift + level, normal, float(np.linalg.norm(left - level)))

    def turned(self, direction: Array) -> Array:
        """Return a direction (k, 3) of the second magnet, as joints can turn it."""
        every = itertools.product(*map(self._angles, self._groups))
        return np.array([self._moved(angles)[0] @ direction for angles in every], float)

    def allows(self, directions: Array, direction: Array) -> NDArray[np.bool_]:
        """Return which directions (k, 3) joints can give to one of the second magnet.

        A hinge leaves the angle of each direction with its axis as it is.
        """
        axes = [self._data.xaxis[group[0]] for group in self._groups]
        if not axes:
            return np.linalg.norm(directions - direction, axis=1) < SAME
        along, kept = directions @ axes[0], float(axes[-1] @ direction)
        if len(axes) == 1:
            return abs(along - kept) < SAME
        rise = float(axes[0] @ axes[1])
        most = np.sqrt(np.maximum((1 - along**2) * (1 - rise**2), 0)) + SAME
        return abs(along * rise - kept) <= most

    def _angles(self, group: list[int]) -> Array:
        """Return angles of parallel hinges, from the present one."""
        count = ANGLES[len(self._groups)]
        if len(group) == 1 and group[0] in self._walls:
            now = self._data.qpos[self._model.jnt_qposadr[group[0]]]
            low, high = self._model.jnt_range[group[0]] - now
            angles = np.array([0.0, *np.linspace(min(low, 0), max(high, 0), count).tolist()])
            return -angles if group[0] in self._own else angles
        return np.linspace(0.0, 2 * np.pi, count, endpoint=False).astype(float)

    def _moved(self, angles: tuple[float, ...]) -> tuple[Array, Array, Array]:
        """Return how hinges turn and shift the second magnet, and what slides allow in addition."""
        turn, shift, span, begun = np.eye(3), np.zeros(3), [], 0
        for joint in self._chain:
            axis = self._data.xaxis[joint]
            if self._model.jnt_type[joint] == SLIDE:
                span.append(turn @ axis)
                continue
            group = self._groups[begun]
            if joint == group[0]:
                own, matrix = np.empty(4), np.empty(9)
                mujoco.mju_axisAngle2Quat(own, axis, angles[begun])
                mujoco.mju_quat2Mat(matrix, own)
                anchor, own = self._data.xanchor[joint], matrix.reshape(3, 3)
                turn, shift = turn @ own, shift + turn @ (anchor - own @ anchor)
            if len(group) > 1:  # other angles of parallel hinges move magnets across their axis
                across = np.linalg.svd(axis[np.newaxis])[2][1:]
                span.extend(across @ turn.T)
            begun += joint == group[-1]
        return turn, shift, np.array(span)
