"""The trail: the path of the contact point, drawn on the floor behind the ball."""

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
        along = np.diff(points, axis=0)
        self.length = np.hypot(*along.T)
        cosine, sine, zero = *(along.T / self.length), np.zeros(len(along))
        rows = cosine, -sine, zero, sine, cosine, zero, zero, zero, zero + 1
        self.frames = np.stack(rows, axis=1)
        self.width = width
        self.radius = 1.3 * width  # half of a strip's diagonal is 1.21 widths

    def add_to(self, view: mujoco.MjvScene, until: float) -> NDArray[np.float64]:
        """Add the trail up to a time to a scene; return the strips' centers (m), shape (n, 3).

        Each strip is inside a sphere of radius `radius`.
        """
        end = max(0, int(np.searchsorted(self.time, until, side="right")) - 1)
        shown = slice(max(0, end - LENGTH), end)
        age = np.arange(end - shown.start, 0, -1)[:, None] / LENGTH
        # Newer strips lie slightly higher, so that they cover older ones without flicker.
        half = 0.01 * self.width * (2 - age)
        sides = np.hstack(
            [0.55 * self.length[shown, None], np.full_like(half, 0.5 * self.width), half]
        )
        centers = np.hstack([self.middle[shown], half])
        colors = (NEW + age * (OLD - NEW)).astype(np.float32)
        strips = view.geoms[view.ngeom : view.ngeom + len(age)]
        parts = zip(strips, sides, centers, self.frames[shown], colors, strict=True)
        for strip, side, center, frame, color in parts:
            mujoco.mjv_initGeom(strip, mujoco.mjtGeom.mjGEOM_BOX, side, center, frame, color)
            strip.category = mujoco.mjtCatBit.mjCAT_DECOR  # casts no shadow
        view.ngeom += len(age)
        return centers
