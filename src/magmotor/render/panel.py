"""The panel: J(t) and the spin, drawn as they happen."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from magmotor.plots import style
from magmotor.plots.momentum import draw_momentum
from magmotor.scenes import Top

DOT = 5
"""Radius in pixels of the dot at the present."""


class Panel:
    """J(t) beside theory: two pictures, drawn once and cut together at the present's column.

    Parameters
    ----------
    run : xarray.Dataset
    scene : Top
    height, width : int
        In pixels.
    """

    def __init__(self, run: xr.Dataset, scene: Top, height: int, width: int):
        with style.figure(width / 100, height / 100) as figure:
            axes = figure.add_subplot()
            lines, _ = draw_momentum(axes, run, scene)
            axes.set_xlim(run.time.values[[0, -1]])
            figure.legend(loc="outside upper center", ncols=2)
            figure.draw_without_rendering()
            for line in lines:
                line.set_clip_on(False)  # whole at the edges of the axes
            self.full = _pixels(figure)
            for line in lines:
                line.set_visible(False)
            self.empty = _pixels(figure)
            self.to_pixels = axes.transData.frozen()

    def draw(self, time: float, momentum: float) -> NDArray[np.uint8]:
        """The panel at a time (s) when J has a value (kg m^2/s), shape (height, width, 3)."""
        x, y = self.to_pixels.transform((time, momentum))
        column = round(x)
        picture = self.empty.copy()
        picture[:, :column] = self.full[:, :column]
        image = Image.fromarray(picture)
        ...


def _pixels(figure) -> NDArray[np.uint8]:
    figure.canvas.draw()
    return np.array(figure.canvas.buffer_rgba())[:, :, :3]
