"""The trail: the path of the contact point, drawn on the floor as the ball leaves it."""

import math

import mujoco
import numpy as np
from numpy.typing import ArrayLike

OLD, NEW = np.array([0.80, 0.85, 0.90, 1.0]), np.array([0.0, 0.45, 0.70, 1.0])
"""Colors, RGBA: it fades to nearly the floor's."""

LENGTH = 400
"""Segments at most; older ones are no longer drawn."""


class Trail:
    """A path cut into segments of equal length, as flat strips that cost next to nothing to draw.

    Parameters
    ----------
    time : array_like, shape (T,)
        In seconds.
    position : array_like, shape (T, 2 or more)
        Of the ball, in meters.
    width : float
        In meters; a segment is twice as long.
    """

    def __init__(self, time: ArrayLike, position: ArrayLike, width: float):
        time, path = np.asarray(time), np.asarray(position)[:, :2]
        run = np.concatenate([[0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()])
        marks = np.arange(0.0, run[-1], 2 * width)
        self.time = np.interp(marks, run, time)
        points = np.stack([np.interp(marks, run, path[:, i]) for i in range(2)], axis=1)
        self.middle = (points[1:] + points[:-1]) / 2
        self.along = np.diff(points, axis=0)
        self.width = width

    def add_to(self, view: mujoco.MjvScene, until: float) -> None:
        """Add what was left behind up to a time to a scene that is about to be rendered."""
        end = max(0, int(np.searchsorted(self.time, until, side="right")) - 1)
        start = max(0, end - LENGTH)
        for i in range(start, end):
            age = (end - i) / LENGTH
            self._add_strip(view, i, age)

    def _add_strip(self, view: mujoco.MjvScene, i: int, age: float) -> None:
        dx, dy = self.along[i]
        length = math.hypot(dx, dy)
        cosine, sine = dx / length, dy / length
        # Newer strips lie a hair higher, so that they cover older ones without flicker.
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
