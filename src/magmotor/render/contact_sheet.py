"""Contact sheets: movies of many runs side by side."""

from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Positive, integer, output
from magmotor.device.analysis import checked_run, scene_of_run
from magmotor.device.device import Scene
from magmotor.device.movie import Gauge, between
from magmotor.render.camera import Image
from magmotor.render.encoder import FORMATS, encode, frame_times, speed_in_words
from magmotor.render.trail import Trail
from magmotor.render.views import Views, check_has
from magmotor.run.in_mujoco import build

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw


SUFFIX = ".mp4"
FRAME_RATE, (WIDTH, HEIGHT), _ = FORMATS[SUFFIX]
"""Format of contact sheets; in a GIF, the tiles would be too small to see."""

CAMERA, BALL_GEOM = "top", "ball"
"""What the model of a scene must have; see `Gauge`."""

TRAIL = 0.7
"""Width of the trail in ball radii."""

REACHED, TRACK, BACKGROUND = "#a9cfe6", "#cdd3d8", 235
"""Colors of the reached and unreached parts of a bar; gray level to which stopped tiles fade."""


class Tile:
    """One run, at the times of a sheet's frames.

    Parameters
    ----------
    run : xarray.Dataset
        With orientations and without replicas.
    scene : Top or Motor
    label : str
        Commas separate its lines.
    times : ndarray, shape (T,)
        Times of the frames (s); after its end the run stands still.

    Raises
    ------
    ValueError
        The run has replicas or no orientation.
    """

    def __init__(self, run: xr.Dataset, scene: Any, label: str, times: NDArray[np.float64]):
        if run.sizes["time"] == 1:
            moment = run.time.values[0] + np.array([0.0, 1e-9])
            run = (
                run.isel(time=[0, 0]).drop_vars("step", errors="ignore").assign_coords(time=moment)
            )
        self.scene, self.label, self.gauge = scene, label.replace(", ", "\n"), _gauge(scene)
        self.end = float(run.time[-1])
        self.stopped = times > self.end + float(run.time[-1] - run.time[-2])
        self.times = np.clip(times, *run.time.values[[0, -1]])
        self.drawn = (np.nan, np.empty((0, 0, 3), np.uint8))
        self.joints = scene.device.joints(run, scene, self.times)
        self.trail = Trail(run.time.values, run.position.values, TRAIL * scene.ball_radius)
        self.value = between(run, self.gauge.values(run, scene), self.times)
        self.least = np.minimum.accumulate(np.minimum(self.value, 0))
        self.largest = np.maximum.accumulate(np.maximum(self.value, 0))

    def draw(self, views: Views, i: int) -> Image:
        """Draw frame i, faded if the run has stopped by then."""
        if self.times[i] != self.drawn[0]:
            views.scene = self.scene
            views.pose(self.joints[i], self.times[i])
            self.drawn = self.times[i], views.draw(CAMERA, self.trail, self.times[i])
        picture = self.drawn[1]
        return picture // 3 + np.uint8(2 * BACKGROUND // 3) if self.stopped[i] else picture

    def write(self, pen: "ImageDraw", box: tuple[int, int, int, int], i: int, scale: float) -> None:
        """Draw label, value and bar of frame i in a box (left, top, right, bottom)."""
        left, top, right, bottom = box
        font = style.pillow_font(13 if right - left >= 300 else 11)
        pen.text((left + 7, top + 5), self.label, style.INK, font, spacing=2)
        if self.stopped[i]:
            center = ((left + right) / 2, (top + bottom) / 2)
            pen.text(center, f"stopped at t = {self.end:.1f} s", style.INK, font, "mm")
        text = f"{self.value[i]:+z.2f} {self.gauge.unit}".replace("-", "−")
        pen.text((right - 7, bottom - 7), text, style.INK, font, "rs")
        middle, reach = (top + bottom) / 2 - 6, 0.34 * (bottom - top)
        for low, high, color in (
            (-scale, scale, TRACK),
            (self.least[i], self.largest[i], REACHED),
            (*sorted((0.0, self.value[i])), style.BLUE),
        ):
            upper, lower = (middle - reach * level / scale for level in (high, low))
            pen.rectangle((right - 15, upper, right - 9, lower), color)
        pen.line((right - 18, middle, right - 6, middle), style.INK)


HEADER = 36
"""Height of the line above the tiles, in pixels."""

BALL = (0.13, 0.16, 0.18, 1.0)
"""Color of the ball (RGBA), uniform since a pattern would be too small to see."""


class Sheet:
    """Frames of several runs side by side, drawn on demand.

    Draw them inside a `with` block, which holds the OpenGL contexts. Scenes that look alike share
    one, since opening a context takes as long as drawing a hundred tiles.

    Parameters
    ----------
    tiles : sequence of Tile
        Of scenes of one class; row by row from the upper left corner.
    times : ndarray, shape (T,)
        Times of the frames (s).
    columns : int
    note : str
        Text beside the time.
    """

    def __init__(
        self, tiles: Sequence[Tile], times: NDArray[np.float64], columns: int, note: str = ""
    ):
        self.tiles, self.times, self.note = tiles, times, note
        gauge = tiles[0].gauge
        largest = max(float(np.abs(tile.value).max()) for tile in tiles)
        self.scale = max(largest, style.NO_SPIN)
        self.legend = (
            f"bars: {gauge.name}, from −{self.scale:.3g} to {self.scale:.3g} {gauge.unit};"
            " pale: reached so far"
        )
        rows = -(-len(tiles) // columns)
        width, height = WIDTH // columns, (HEIGHT - HEADER) // rows
        self.width, self.height = min(width, 2 * height), min(height, 3 * width // 4)
        left = (WIDTH - columns * self.width) // 2
        top = (HEIGHT + HEADER - rows * self.height) // 2
        corners = [
            (left + column * self.width, top + row * self.height)
            for row in range(rows)
            for column in range(columns)
        ]
        self.boxes = [(x, y, x + self.width, y + self.height) for x, y in corners]

    def __enter__(self) -> "Sheet":
        """Open the views."""
        with ExitStack() as stack:
            self.views: dict[Any, Views] = {}
            # The camera distance suits the highest ring among the scenes that look alike.
            for tile in sorted(self.tiles, key=lambda tile: -_height(tile.scene)):
                if _appearance(tile.scene) not in self.views:
                    views = Views(tile.scene, {CAMERA: (self.height, self.width)})
                    ball = views.model.geom(BALL_GEOM)
                    ball.matid, ball.rgba = -1, BALL
                    self.views[_appearance(tile.scene)] = stack.enter_context(closing(views))
            self.opened = stack.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        """Close the views."""
        self.opened.close()
        del self.views

    def draw(self, i: int) -> NDArray[np.uint8]:
        """Frame i, shape (720, 1280, 3)."""
        from PIL import Image, ImageDraw

        sheet = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
        for tile, (left, top, right, bottom) in zip(self.tiles, self.boxes, strict=False):
            picture = tile.draw(self.views[_appearance(tile.scene)], i)
            sheet[top : bottom - 1, left : right - 1] = picture[:-1, :-1]
        image = Image.fromarray(sheet)
        pen = ImageDraw.Draw(image)
        for tile, box in zip(self.tiles, self.boxes, strict=False):
            tile.write(pen, box, i, self.scale)
        pen.text((12, 26), f"t = {self.times[i]:.1f} s", style.INK, style.pillow_font(22), "ls")
        pen.text((190, 26), self.note, style.INK, style.pillow_font(14), "ls")
        pen.text((WIDTH - 12, 26), self.legend, style.INK, style.pillow_font(14), "rs")
        return np.asarray(image)


def _gauge(scene: Scene) -> Gauge:
    if scene.device.gauge is None:
        raise ArgumentError(
            "scene", scene, f"there are no contact sheets of a {type(scene).__name__}"
        )
    return scene.device.gauge


def _check_scenes(scenes: Sequence[Any]) -> None:
    """Check that scenes have what `Gauge` requires; ValueError names what is missing."""
    for scene in scenes:
        for name in ("ball_radius", *_gauge(scene).alike):
            if not hasattr(scene, name):
                raise ArgumentError(
                    "scene", scene, f"must have {name} to be shown in a contact sheet"
                )
    for scene in {_appearance(scene): scene for scene in scenes}.values():
        model = build(scene, visual=True)
        check_has(model, scene, "geom", BALL_GEOM)
        check_has(model, scene, "camera", CAMERA)


def _appearance(scene: Any) -> tuple[Any, ...]:
    return tuple(getattr(scene, name) for name in _gauge(scene).alike)


def _height(scene: Any) -> float:
    return _gauge(scene).height(scene)


COLUMNS, ROWS = 8, 5
"""Largest numbers of columns and rows, so that tiles stay legible."""


@checked
def contact_sheet(
    runs: Sequence[xr.Dataset],
    scenes: Sequence[Scene] | None,
    labels: Sequence[str],
    path: Annotated[str | Path, output(SUFFIX)],
    *,
    columns: Annotated[int, integer(at_least=1, at_most=COLUMNS)],
    speed: Positive = 1.0,
) -> None:
    """Write a movie of recorded runs side by side, each seen from above with the ball's trail.

    A bar in each tile shows the spin J/I_3 of the top (rad/s) or the azimuth of the motor's ball
    (revolutions), on a common scale; its pale part spans the values reached so far. A run that ends
    before the others keeps showing its last frame, faded.

    Parameters
    ----------
    runs : sequence of xarray.Dataset
        From `simulate` without replicas; for the top not by scipy/dop853, which has no orientation.
        At most 40, in 5 rows of 8.
    scenes : sequence of Top or of Motor, or None
        Their scenes, of one class; None takes them from the attributes of the runs.
    labels : sequence of str
        Text in the corner of each tile; commas separate its lines.
    path : str or Path
        The .mp4 file to write: H.264, 1280 x 720, 30 frames per second.
    columns : int
        Number of tiles per row, 1 to 8.
    speed : float
        Simulated seconds per second of the movie.

    Raises
    ------
    ValueError
        There are no runs, too many for the columns, or a different number of scenes or labels; a
        run has replicas or no orientation; the scenes are not of one class, or lack what `Gauge`
        requires; columns or speed are out of bounds.
    NoOpenGL
        No OpenGL context can be created; nothing is written.
    RuntimeError
        The encoder failed; the message includes its last output.
    """
    _check_lengths(runs, scenes, labels, columns)
    given = scenes or [None] * len(runs)
    scenes = [scene_of_run(run, scene, (Scene,)) for run, scene in zip(runs, given, strict=True)]
    if len({type(scene) for scene in scenes}) > 1:
        raise ArgumentError(
            "scenes", sorted({type(s).__name__ for s in scenes}), "must all be of one class"
        )
    for i, (run, scene) in enumerate(zip(runs, scenes, strict=True)):
        needs = tuple(dict.fromkeys((*_gauge(scene).needs, "position")))
        checked_run(f"runs[{i}]", run, needs, (type(scene),), replicas=False)
    _check_scenes(scenes)
    start = min(float(run.time[0]) for run in runs)
    end = max(float(run.time[-1]) for run in runs)
    times = frame_times(start, end, speed, FRAME_RATE)
    shown = zip(runs, scenes, labels, strict=True)
    tiles = [Tile(run, scene, label, times) for run, scene, label in shown]
    with Sheet(tiles, times, columns, speed_in_words(speed)) as sheet:
        frames = map(sheet.draw, range(len(times)))
        encode(frames, len(times), Path(path), FRAME_RATE, (WIDTH, HEIGHT))


def _check_lengths(runs: Sequence, scenes: Sequence | None, labels: Sequence, columns: int) -> None:
    if not 1 <= len(runs) <= ROWS * columns:
        raise ArgumentError(
            "len(runs)", len(runs), f"must be 1 to {ROWS * columns}: {ROWS} rows of {columns}"
        )
    for name, given in (("scenes", scenes), ("labels", labels)):
        if given is not None and len(given) != len(runs):
            raise ArgumentError(
                f"len({name})", len(given), f"must be {len(runs)}, the number of runs"
            )
