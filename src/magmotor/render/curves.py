"""The panel of a movie: curves that grow with time."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


DOT_RADIUS, DOT_COLOR = 5.0, np.frombuffer(bytes.fromhex(style.BLUE[1:]), np.uint8)
"""Radius (pixels, at 100 dots per inch) and color (RGB) of the dot that marks the current time."""


class Panel:
    """Curves up to the current time, composed of two pictures that are drawn once.

    Parameters
    ----------
    plot : callable
        Draws the curves on axes and returns their lines.
    span : array_like, shape (2,)
        First and last time, in seconds.
    height, width : int
        Size in pixels.
    dpi : float
        Dots per inch, which determine the size of text and lines.
    """

    def __init__(
        self,
        plot: Callable[["Axes"], list["Line2D"]],
        span: ArrayLike,
        height: int,
        width: int,
        dpi: float = 100.0,
    ):
        self.radius = DOT_RADIUS * dpi / 100
        with style.figure(width / dpi, height / dpi) as figure:
            figure.set_dpi(dpi)
            axes = figure.add_subplot()
            lines = plot(axes)
            axes.set_xlim(*np.asarray(span))
            legend = figure.legend(loc="outside upper center", ncols=2)
            if legend.get_window_extent().width > width:
                legend.remove()
                figure.legend(loc="outside upper center")
            self.full = _pixels(figure, height, width)
            for line in lines:
                line.set_visible(False)
            self.empty = _pixels(figure, height, width)
            self.origin, one = axes.transData.transform([[0, 0], [1, 1]])
            self.scale = one - self.origin

    def draw(self, time: float, value: float) -> NDArray[np.uint8]:
        """Draw the panel with a dot at (time (s), value), shape (height, width, 3)."""
        x, y = self.origin + self.scale * (time, value)
        picture = self.empty.copy()
        picture[:, : round(x)] = self.full[:, : round(x)]
        _dot(picture, x, len(picture) - y, self.radius)
        return picture


def _dot(picture: NDArray[np.uint8], x: float, y: float, radius: float) -> None:
    """Draw an antialiased dot, centered at pixels (x, y) from the upper left corner."""
    top, left = max(0, int(y - radius - 1)), max(0, int(x - radius - 1))
    patch = picture[top : int(y + radius + 2), left : int(x + radius + 2)]
    rows, columns = np.indices(patch.shape[:2])
    distance = np.hypot(rows + top + 0.5 - y, columns + left + 0.5 - x)
    cover = np.clip(radius + 0.5 - distance, 0, 1)[..., np.newaxis]
    patch[:] = cover * DOT_COLOR + (1 - cover) * patch


def _pixels(figure: "Figure", height: int, width: int) -> NDArray[np.uint8]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[:height, :width, :3]
