"""Regions of pictures: where something moves, and a camera that sees no more than that."""

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

MARGIN = 2
"""Pixels around what moves, for rounding and smooth edges."""

Numbers = NDArray[np.float64]


class Region(NamedTuple):
    """A rectangle of pixels, counted from the lower left corner of the whole picture."""

    left: int
    bottom: int
    width: int
    height: int

    def around(self, centers: Numbers, radii: Numbers, camera: mujoco.MjvGLCamera) -> "Region":
        """Return the part of this whole picture in which spheres are seen.

        Parameters
        ----------
        centers : ndarray, shape (n, 3)
            In meters.
        radii : ndarray, shape (n,)
            In meters; 0 is that of an infinite plane, as in `mjModel.geom_rbound`.
        camera : mujoco.MjvGLCamera
            A perspective camera that sees the whole picture.

        Returns
        -------
        Region
            This whole picture if a sphere is infinite or reaches the camera; without width or
            height if no sphere is in the picture.
        """
        if len(radii) == 0:
            return Region(0, 0, 0, 0)
        forward, up = np.array(camera.forward, float), np.array(camera.up, float)
        axes = np.stack([np.cross(forward, up), up, forward])
        x, y, depth = axes @ (centers - np.array(camera.pos, float)).T
        if (radii == 0).any() or (depth - radii <= camera.frustum_near).any():
            return self
        left, bottom, across, along = self._frustum(camera)
        near = camera.frustum_near
        x0, x1 = _interval(x, radii, depth, left / near, across / near, self.width)
        y0, y1 = _interval(y, radii, depth, bottom / near, along / near, self.height)
        return Region(x0, y0, x1 - x0, y1 - y0)

    def narrow(self, camera: mujoco.MjvGLCamera, part: "Region") -> None:
        """Restrict a camera that sees this whole picture to a part of it."""
        left, bottom, across, along = self._frustum(camera)
        camera.frustum_center = left + across * (part.left + part.width / 2) / self.width
        camera.frustum_width = across * part.width / self.width / 2
        camera.frustum_bottom = bottom + along * part.bottom / self.height
        camera.frustum_top = bottom + along * (part.bottom + part.height) / self.height

    def rows_and_columns(self, height: int) -> tuple[slice, slice]:
        """Return what selects the region in an array of this height, whose first row is on top."""
        top = height - self.bottom
        return slice(top - self.height, top), slice(self.left, self.left + self.width)

    def _frustum(self, camera: mujoco.MjvGLCamera) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of what a camera sees in its near plane (m)."""
        bottom, along = camera.frustum_bottom, camera.frustum_top - camera.frustum_bottom
        half = camera.frustum_width or along * self.width / self.height / 2  # MuJoCo stores half
        return camera.frustum_center - half, bottom, 2 * half, along


def _interval(
    x: Numbers, radii: Numbers, depth: Numbers, start: float, length: float, size: int
) -> tuple[int, int]:
    """Return the first pixel and the one after the last, along an axis, in which spheres are seen.

    The picture shows slopes x/depth from `start`, over a `length`, in `size` pixels.
    """
    slopes = [(x + side * radii) / (depth + end * radii) for side in (-1, 1) for end in (-1, 1)]
    pixels = (np.array(slopes) - start) / length * size
    low, high = np.floor(pixels.min()) - MARGIN, np.ceil(pixels.max()) + MARGIN
    return int(np.clip(low, 0, size)), int(np.clip(high, 0, size))
