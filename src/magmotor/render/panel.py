"""The panel: curves over time, drawn as they happen."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

DOT, COLOUR = 5.0, np.frombuffer(bytes.fromhex(style.BLUE[1:]), np.uint8)
"""Radius in pixels of the dot at the present, and its colour, RGB."""


class Panel:
    """Curves so far: two pictures, drawn once and cut together at the present's column.

    Parameters
    ----------
    plot : callable
        Draws the curves on axes and returns their lines.
    span : array_like, shape (2,)
        First and last time, in seconds.
    height, width : int
        In pixels.
    """

    def __init__(
        self,
        plot: Callable[["Axes"], list["Line2D"]],
        span: ArrayLike,
        height: int,
        width: int,
    ):
        with style.figure(width / 100, height / 100) as figure:
            axes = figure.add_subplot()
            lines = plot(axes)
            axes.set_xlim(*np.asarray(span))
            figure.legend(loc="outside upper center", ncols=2)
            self.full = _pixels(figure)
            for line in lines:
                line.set_visible(False)
            self.empty = _pixels(figure)
            self.origin, one = axes.transData.transform([[0, 0], [1, 1]])
            self.scale = one - self.origin

    def draw(self, time: float, value: float) -> NDArray[np.uint8]:
        """The panel at a time (s) when a curve has a value, shape (height, width, 3)."""
        x, y = self.origin + self.scale * (time, value)
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
