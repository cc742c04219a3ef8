"""The panel: J(t) and the spin, drawn as they happen."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.plots import style
from magmotor.plots.momentum import draw_momentum
from magmotor.scenes import Top

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOT, COLOUR = 5.0, np.frombuffer(bytes.fromhex(style.BLUE[1:]), np.uint8)
"""Radius in pixels of the dot at the present, and its colour, RGB."""


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
            axes.set_xlim(*run.time.values[[0, -1]])
            figure.legend(loc="outside upper center", ncols=2)
            self.full = _pixels(figure)
            for line in lines:
                line.set_visible(False)
            self.empty = _pixels(figure)
            self.origin, one = axes.transData.transform([[0, 0], [1, 1]])
            self.scale = one - self.origin

    def draw(self, time: float, momentum: float) -> NDArray[np.uint8]:
        """The panel at a time (s) when J has a value (kg m^2/s), shape (height, width, 3)."""
        x, y = self.origin + self.scale * (time, momentum)
        picture = self.empty.copy()
        picture[:, : round(x)] = self.full[:, : round(x)]
        _dot(picture, x, len(picture) - y)
        return picture


def _dot(picture: NDArray[np.uint8], x: float, y: float) -> None:
    """Draw a dot with a smooth edge, centred at a point in pixels from the upper left corner."""
    top, left = max(0, int(y - DOT - 1)), max(0, int(x - DOT - 1))
    patch = picture[top : int(y + DOT + 2), left : int(x + DOT + 2)]
    rows, columns = np.indices(patch.shape[:2])
    distance = np.hypot(rows + top + 0.5 - y, columns + left + 0.5 - x)
    cover = np.clip(DOT + 0.5 - distance, 0, 1)[..., np.newaxis]
    patch[:] = cover * COLOUR + (1 - cover) * patch


def _pixels(figure: "Figure") -> NDArray[np.uint8]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[:, :, :3]
