"""Frames of a movie: the whole scene, a second view, and a curve, side by side."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common import style
from magmotor.common.checks import reject
from magmotor.device.analysis import checked_run
from magmotor.device.device import Scene
from magmotor.device.movie import MovieContent
from magmotor.render.trail import Trail
from magmotor.render.views import Views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


DOT_RADIUS, DOT_COLOR = 5.0, np.frombuffer(bytes.fromhex(style.BLUE[1:]), np.uint8)
"""Radius (pixels) and color (RGB) of the dot that marks the current time."""


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
        """Draw the panel with a dot at (time (s), value), shape (height, width, 3)."""
        x, y = self.origin + self.scale * (time, value)
        picture = self.empty.copy()
        picture[:, : round(x)] = self.full[:, : round(x)]
        _dot(picture, x, len(picture) - y)
        return picture


def _dot(picture: NDArray[np.uint8], x: float, y: float) -> None:
    """Draw an antialiased dot, centered at pixels (x, y) from the upper left corner."""
    top, left = max(0, int(y - DOT_RADIUS - 1)), max(0, int(x - DOT_RADIUS - 1))
    patch = picture[top : int(y + DOT_RADIUS + 2), left : int(x + DOT_RADIUS + 2)]
    rows, columns = np.indices(patch.shape[:2])
    distance = np.hypot(rows + top + 0.5 - y, columns + left + 0.5 - x)
    cover = np.clip(DOT_RADIUS + 0.5 - distance, 0, 1)[..., np.newaxis]
    patch[:] = cover * DOT_COLOR + (1 - cover) * patch


def _pixels(figure: "Figure") -> NDArray[np.uint8]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[:, :, :3]


MAIN_CAMERA = "front"

HEIGHT, WIDTH = 720, 1280
MAIN, SIDE = (HEIGHT, 800), (HEIGHT // 2, 480)
"""Height and width (pixels) of the main view, and of the near view and the panel below it."""


def movie_content_of(scene: Scene) -> type[MovieContent]:
    """Return the movie content of a scene's class; ValueError if it has no movies."""
    if scene.device.movie_content is None:
        raise reject("scene", scene, f"there are no movies of a {type(scene).__name__}")
    return scene.device.movie_content


def checked_movie_run(run: xr.Dataset, scene: Scene) -> xr.Dataset:
    """Return the run if it has what its movie needs; ValueError names what is missing."""
    needs = movie_content_of(scene).needs
    return checked_run("run", run, needs, (type(scene),), records=2, replicas=False)


class Frames:
    """The frames of a run's movie, drawn on demand inside a `with` block.

    The block holds the OpenGL contexts.

    Parameters
    ----------
    run : xarray.Dataset
        As returned by `checked_movie_run`.
    scene : Scene
    times : array_like, shape (T,)
        Times of the frames (s).
    note : str
        Text below the numbers.

    Raises
    ------
    ValueError
        The smaller view has the camera of the main view; or, on entering the block, the model lacks
        a camera.
    NoOpenGL
        No OpenGL context can be created on entering the block.
    """

    def __init__(self, run: xr.Dataset, scene: Scene, times: ArrayLike, note: str = ""):
        content = movie_content_of(scene)
        self.scene, self.note = scene, note
        self.times = np.asarray(times, dtype=float)
        self.joints = scene.device.joints(run, scene, self.times)
        self.movie_content: MovieContent = content(run, scene, self.times)
        if self.movie_content.near == MAIN_CAMERA:
            sentence = "must be another camera than that of the main view"
            raise reject(f"{content.__name__}.near", MAIN_CAMERA, sentence)
        self.trail = Trail(run.time.values, self.movie_content.path, self.movie_content.trail)
        self.panel = Panel(self.movie_content.plot, run.time.values[[0, -1]], *SIDE)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times)

    def __enter__(self) -> "Frames":
        """Open the views."""
        self.views = Views(self.scene, {MAIN_CAMERA: MAIN, self.movie_content.near: SIDE})
        return self

    def __exit__(self, *error: object) -> None:
        """Close the views."""
        self.views.close()
        del self.views

    def draw(self, i: int) -> NDArray[np.uint8]:
        """Draw frame i, shape (720, 1280, 3)."""
        time = float(self.times[i])
        self.views.pose(self.joints[i], time)
        main, near = (self.views.draw(camera, self.trail, time) for camera in self.views.renderers)
        side = np.concatenate([near, self.panel.draw(time, self.movie_content.value[i])])
        side[:, 0] = side[len(near) - 1] = 255
        return np.concatenate([self._write_on(main, i), side], axis=1)

    def _write_on(self, picture: NDArray[np.uint8], i: int) -> NDArray[np.uint8]:
        from PIL import Image, ImageDraw

        lines = self.movie_content.lines(i) + [self.note] * bool(self.note)
        image = Image.fromarray(picture)
        pen = ImageDraw.Draw(image)
        top = HEIGHT - 24 - 24 * len(lines)
        pen.text((24, top), f"t = {self.times[i]:.1f} s", style.INK, style.pillow_font(26), "ls")
        for k, line in enumerate(lines, start=1):
            corner = (24, top + 24 * k + 4)
            pen.text(corner, line.replace("-", "−"), style.INK, style.pillow_font(16), "ls")
        return np.asarray(image)
