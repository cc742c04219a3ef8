"""The trail: the path of the contact point, drawn on the floor behind the ball."""

import math

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

OLD, NEW = np.array([0.80, 0.85, 0.90, 1.0]), np.array([0.0, 0.45, 0.70, 1.0])
"""Colors (RGBA); old segments fade almost to the color of the floor."""

LENGTH = 400
"""Largest number of segments; older ones are not drawn."""


class Trail:
    """A path divided into segments of equal length, drawn as flat strips at almost no cost.

    Parameters
    ----------
    time : array_like, shape (T,)
        In seconds.
    position : array_like, shape (T, 2 or more)
        Positions of the ball, in meters.
    width : float
        In meters; segments are twice as long.
    """

    def __init__(self, time: ArrayLike, position: ArrayLike, width: float):
        time, path = np.asarray(time), np.asarray(position)[:, :2]
        length = np.concatenate([[0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()])
        marks = np.arange(0.0, length[-1], 2 * width)
        self.time = np.interp(marks, length, time)
        points = np.stack([np.interp(marks, length, path[:, i]) for i in range(2)], axis=1)
        self.middle = (points[1:] + points[:-1]) / 2
        self.along = np.diff(points, axis=0)
        self.width = width
        self.radius = 1.3 * width  # half of a strip's diagonal is 1.21 widths

    def add_to(self, view: mujoco.MjvScene, until: float) -> NDArray[np.float64]:
        """Add the trail up to a time to a scene; return the strips' centers (m), shape (n, 3).

        Each strip is inside a sphere of radius `radius`.
        """
        end = max(0, int(np.searchsorted(self.time, until, side="right")) - 1)
        start = max(0, end - LENGTH)
        for i in range(start, end):
            age = (end - i) / LENGTH
            self._add_strip(view, i, age)
        return np.pad(self.middle[start:end], ((0, 0), (0, 1)))

    def _add_strip(self, view: mujoco.MjvScene, i: int, age: float) -> None:
        dx, dy = self.along[i]
        length = math.hypot(dx, dy)
        cosine, sine = dx / length, dy / length
        # Newer strips lie slightly higher, so that they cover older ones without flicker.
        height = 0.02 * self.width * (2 - age)
        strip = view.geoms[view.ngeom]
        view.ngeom += 1
        mujoco.mjv_initGeom(
            strip,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=np.array([0.55 * length, 0.5 * self.width, 0.5 * height]),
            pos=np.array([*self.middle[i], 0.5 * height]),
            mat=np.array([cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0]),
            rgba=(NEW + age * (OLD - NEW)).astype(np.float32),
        )
        strip.category = mujoco.mjtCatBit.mjCAT_DECOR  # casts no shadow
