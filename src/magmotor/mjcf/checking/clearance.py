"""How near two magnets come to each other along a line before geoms touch.

MuJoCo's distances of geoms say where those that collide stop each other. Geoms that have magnets or
iron never overlap, even if they do not collide, since forces mean nothing there.
"""

import copy
import itertools

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.covers import Covers
from magmotor.mjcf.checking.geoms import bounding_radii, contact_margin
from magmotor.mjcf.checking.strengths import Magnet

CLOSE, PRESSED, GRAZING = 1e-7, 1e-3, 0.01
"""Gap that counts as none, and depth to which geoms are pressed, over the smaller radius; and the
least part of this depth by which they then overlap, unless they only graze each other."""

STEPS = 100
"""Most steps toward a touch."""


class Clearance:
    """What keeps two magnets apart: `rows` of two geoms, the first one on the side of the first."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        magnets: tuple[Magnet, Magnet],
        touching: NDArray,
        covers: Covers,
    ) -> None:
        self._model, self._data = model, copy.copy(data)
        one, other = magnets
        solid = [m.elements[m.elements >= model.nsite] - model.nsite for m in magnets]
        self._rows, self._margins, self._shifts = [], [], []
        for row in touching.tolist():
            first, second = row[:2] if _is_of(model, data, covers, one, row) else row[1::-1]
            ways = covers.places(one, first), covers.places(other, second)
            self._add(first, second, contact_margin(model, *row), ways)
        for first, second in itertools.product(*(own.tolist() for own in solid)):
            self._add(first, second, 0.0, (np.zeros((1, 3)), np.zeros((1, 3))))
        self._first, self._second = np.array(self._rows, int).reshape(-1, 2).T
        self._solid = np.isin(self._first, solid[0]) & np.isin(self._second, solid[1])
        self._places = data.geom_xpos[self._second], data.geom_xmat[self._second].reshape(-1, 3, 3)
        radii = [bounding_radii(model, own) for own in (self._first, self._second)]
        moved = [max(np.linalg.norm(way, axis=1).max() for way in ways) for ways in self._shifts]
        self._size = np.minimum(*radii)
        self._reach = sum(radii) + np.array(self._margins) + 2 * np.array(moved)
        self.touched = np.zeros(len(touching), bool)
        """Which rows have stopped the magnets so far."""

    def _add(self, first: int, second: int, margin: float, ways: tuple[Array, Array]) -> None:
        self._rows.append((first, second))
        self._margins.append(margin)
        self._shifts.append(ways)

    def least(self, turn: Array, shift: Array, normal: Array, start: float) -> tuple[float, bool]:
        """Return how far the second magnet must be along a normal, and whether others cover it.

        It begins where `Duo.force` has it, and is `start` or more from there, in m.
        """
        places = self._places[0] @ turn.T + shift
        frames = turn @ self._places[1]
        between = places - self._data.geom_xpos[self._first]
        along = between @ normal
        square = (between**2).sum(axis=1) - along**2
        half = np.sqrt(np.maximum(self._reach**2 - square, 0))
        near = np.flatnonzero((square < self._reach**2) & (half - along > start))
        near = near[np.argsort(along[near] - half[near], kind="stable")].tolist()  # farthest first
        ends, found, stopped, last = {}, start, True, -1
        while stopped:
            stopped = False
            for k in near:
                if half[k] - along[k] <= found:
                    break
                way = k, places[k], frames[k], turn
                if k not in ends:
                    ends[k] = self._end_of(*way, normal, half[k])
                beyond = ends[k] - CLOSE * self._size[k]
                if found < beyond and -self._end_of(*way, -normal, half[k]) < found:
                    found, stopped, last = ends[k], True, k
        if 0 <= last < len(self.touched) and found < np.inf:
            self.touched[last] = True
        return found, last >= 0 and not self._solid[last]

    def _end_of(
        self, k: int, place: Array, frame: Array, turn: Array, normal: Array, half: float
    ) -> float:
        """Return how far along a normal two geoms overlap at most, wherever slides have them."""
        self._data.geom_xmat[self._second[k]] = frame.ravel()
        found = np.inf
        for first, second in itertools.product(*self._shifts[k]):
            if found > -np.inf:
                there = place + turn @ second - first
                found = min(found, self._end(k, there, normal, half))
        return found

    def _end(self, k: int, place: Array, normal: Array, half: float) -> float:
        """Return how far along a normal two geoms overlap at most; minus infinity if nowhere."""
        one, other, size = int(self._first[k]), int(self._second[k]), float(self._size[k])
        away = float((self._data.geom_xpos[one] - place) @ normal)
        if not np.isfinite(half):  # of planes
            size = min(size, self._model.stat.extent)
            half = 10 * self._model.stat.extent
        end, lowest, ends = away + half, away - half, np.empty(6)

        def gap() -> float:
            self._data.geom_xpos[other] = place + end * normal
            found = mujoco.mj_geomDistance(self._model, self._data, one, other, 1e10, ends)
            return found - self._margins[k]

        for _ in range(STEPS):
            apart = gap()
            if apart <= CLOSE * size:
                break
            across = ends[3:] - ends[:3]
            closing = abs(float(across @ normal)) / float(np.linalg.norm(across))
            # From one to the other, whichever of the two MuJoCo has put first:
            if (across @ normal) * (
                across @ (place + end * normal - self._data.geom_xpos[one])
            ) < 0:
                return -np.inf
            if closing < CLOSE or end < lowest:
                return -np.inf
            end -= apart / closing
        else:
            return -np.inf
        if end == away + half:
            return np.inf  # nothing parts them, such as from a plane
        found, end = end, end - PRESSED * size
        return found if gap() < -GRAZING * PRESSED * size else -np.inf


def _is_of(
    model: mujoco.MjModel, data: mujoco.MjData, covers: Covers, magnet: Magnet, row: list[int]
) -> bool:
    """Return whether the first geom of a row belongs to a magnet or moves along with it."""
    weld = [int(model.body_weldid[model.geom_bodyid[geom]]) for geom in row[:2]]
    if magnet.body in weld:
        return weld[0] == magnet.body
    return len(covers.places(magnet, row[0])) > 0
