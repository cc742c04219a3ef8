"""Frames of a movie: the whole scene with text and a sketch, a second view, and a curve."""

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common import style
from magmotor.common.exceptions import ArgumentError
from magmotor.device.analysis import checked_run
from magmotor.device.device import Scene
from magmotor.device.movie import MovieContent
from magmotor.render.curves import Panel
from magmotor.render.sketch import Sketch
from magmotor.render.trail import Trail
from magmotor.render.views import Views

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

MAIN_CAMERA = "front"

MAIN_SHARE = 5 / 8
"""Width of the main view as a fraction of the frame's; the other views are beside it."""

SIZE = (1280, 720)
"""Width and height in pixels for which sizes of text are given."""

SMALL = 320
"""Height in pixels below which there is no room for caption and sketch."""


def movie_content_of(scene: Scene) -> type[MovieContent]:
    """Return the movie content of a scene's class; ValueError if it has no movies."""
    if scene.device.movie_content is None:
        raise ArgumentError("scene", scene, f"there are no movies of a {type(scene).__name__}")
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
    size : (int, int)
        Width and height in pixels.

    Raises
    ------
    ValueError
        The smaller view has the camera of the main view; or, on entering the block, the model lacks
        a camera.
    NoOpenGL
        No OpenGL context can be created on entering the block.
    """

    def __init__(
        self,
        run: xr.Dataset,
        scene: Scene,
        times: ArrayLike,
        note: str = "",
        size: tuple[int, int] = SIZE,
    ):
        content = movie_content_of(scene)
        self.scene, self.note = scene, note
        self.times = np.asarray(times, dtype=float)
        self.joints = scene.device.joints(run, scene, self.times)
        self.movie_content: MovieContent = content(run, scene, self.times)
        if self.movie_content.near == MAIN_CAMERA:
            sentence = "must be another camera than that of the main view"
            raise ArgumentError(f"{content.__name__}.near", MAIN_CAMERA, sentence)
        width, height = size
        main, half = round(MAIN_SHARE * width), height // 2
        self.main, self.near = (height, main), (half, width - main)
        whole = height / SIZE[1]
        self.scale = max(whole, math.sqrt(whole))  # text shrinks less than the picture
        self.trail = Trail(run.time.values, self.movie_content.path, self.movie_content.trail)
        span, below = run.time.values[[0, -1]], (height - half, width - main)
        self.panel = Panel(self.movie_content.plot, span, *below, dpi=100 * self.scale)
        side_view = self.movie_content.side_view
        self.caption = self.movie_content.caption if height >= SMALL else ""
        self.sketch = None
        if side_view is not None and height >= SMALL:
            self.sketch = Sketch(side_view, 1.1 * whole)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times)

    def __enter__(self) -> "Frames":
        """Open the views."""
        self.views = Views(self.scene, {MAIN_CAMERA: self.main, self.movie_content.near: self.near})
        return self

    def __exit__(self, *error: object) -> None:
        """Close the views."""
        self.views.close()
        del self.views

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        """Yield all frames; a thread composes each one while the next is rendered."""
        with ThreadPoolExecutor(1) as thread:
            composed = thread.submit(self._compose, 0, *self._render(0))
            for i in range(1, len(self)):
                views = self._render(i)
                yield composed.result()
                composed = thread.submit(self._compose, i, *views)
            yield composed.result()

    def draw(self, i: int, result: str = "") -> NDArray[np.uint8]:
        """Draw frame i, shape (height, width, 3); a result replaces the caption."""
        return self._compose(i, *self._render(i), result)

    def draw_end(self) -> NDArray[np.uint8]:
        """Draw the last frame with the result in words."""
        return self.draw(len(self) - 1, self.movie_content.result())

    def _render(self, i: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Render the main view and the other one."""
        time = float(self.times[i])
        self.views.pose(self.joints[i], time)
        main, near = (self.views.draw(camera, self.trail, time) for camera in self.views.cameras)
        return main, near

    def _compose(
        self, i: int, main: NDArray[np.uint8], near: NDArray[np.uint8], result: str = ""
    ) -> NDArray[np.uint8]:
        """Write and draw the other parts of a frame, which need no OpenGL."""
        time = float(self.times[i])
        side = np.concatenate([near, self.panel.draw(time, self.movie_content.value[i])])
        side[:, 0] = side[len(near) - 1] = 255
        return np.concatenate([self._write_on(main, i, result), side], axis=1)

    def _write_on(self, picture: NDArray[np.uint8], i: int, result: str) -> NDArray[np.uint8]:
        from PIL import Image, ImageDraw

        image = Image.fromarray(picture)
        if self.sketch is not None:
            self._add_sketch(image, i)
        self._write_title(ImageDraw.Draw(image), result)
        self._write_numbers(ImageDraw.Draw(image), i)
        return np.asarray(image)

    def _add_sketch(self, image: "Image", i: int) -> None:
        """Add the sketch in the lower right corner."""
        from PIL import Image

        assert self.sketch is not None
        sketch, gap = self.sketch.draw(i), round(16 * self.main[0] / SIZE[1])
        corner = image.width - sketch.width - gap, image.height - sketch.height - gap
        below = image.crop((*corner, corner[0] + sketch.width, corner[1] + sketch.height))
        image.paste(Image.blend(below, sketch, 0.8), corner)

    def _write_title(self, pen: "ImageDraw", result: str) -> None:
        """Write the title and below it the result or else the caption."""
        left, whole = 24 * self.scale, self.main[0] / SIZE[1]
        pen.text((left, 38 * whole), self.movie_content.title, style.INK, self._font(24), "ls")
        below, color, size = (result, style.BLUE, 20) if result else (self.caption, style.INK, 16)
        font, width = self._font(size), self.main[1] - 2 * left
        for k, line in enumerate(_wrapped(pen, below, font, width)):
            place = (left, 70 * whole + 1.3 * size * k * self.scale)
            pen.text(place, line, color, font, "ls")

    def _write_numbers(self, pen: "ImageDraw", i: int) -> None:
        """Write time and event, and below them numbers and note, in the lower left corner."""
        content = self.movie_content
        lines = content.lines(i) + [self.note] * bool(self.note)
        left, step = 24 * self.scale, 24 * self.scale
        base = self.main[0] - step * (len(lines) + 1)
        clock, font = f"t = {self.times[i]:.1f} s", self._font(26)
        pen.text((left, base), clock, style.INK, font, "ls")
        beside = left + pen.textlength(f"{clock}   ", font)
        pen.text((beside, base), content.event(i), style.BLUE, self._font(20), "ls")
        for k, line in enumerate(lines, start=1):
            place = (left, base + step * k + 4 * self.scale)
            pen.text(place, line.replace("-", "−"), style.INK, self._font(16), "ls")

    def _font(self, size: int):
        return style.pillow_font(max(9, round(size * self.scale)))


def _wrapped(pen: "ImageDraw", text: str, font, width: float) -> list[str]:
    """Divide a text into lines that are at most `width` pixels wide."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and pen.textlength(longer, font) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines
