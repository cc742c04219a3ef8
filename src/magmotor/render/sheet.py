"""The frames of a contact sheet: tiles on a grid, below one time for all."""

from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.plots import style
from magmotor.render.frames import HEIGHT, WIDTH
from magmotor.render.tile import CAMERA, Tile
from magmotor.render.views import Views
from magmotor.scenes import Motor, Top

HEADER = 36
"""Height in pixels of the line above the tiles."""

BALL = (0.13, 0.16, 0.18, 1.0)
"""Its colour, RGBA: a pattern would be too small to be seen."""

SEEN = (
    *("ball_radius", "surface", "ring_dipoles", "ring_radius"),
    *("inner_dipoles", "inner_radius", "inner_height"),
    *("outer_dipoles", "outer_radius", "outer_height"),
)
"""Fields of tops and motors without which two scenes are drawn alike, but for a pose."""


class Sheet:
    """Frames of several runs, each drawn when it is asked for.

    They are drawn inside a `with` block, which holds OpenGL contexts: one for all scenes that look
    alike, since opening one takes as long as drawing a hundred tiles.

    Parameters
    ----------
    tiles : sequence of Tile
        Of one kind of scene; row by row from the upper left corner.
    times : ndarray, shape (T,)
        Of the frames, in seconds.
    columns : int
    note : str
        Said beside the time.
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
            # The camera is as far away as the highest ring of those that look alike needs.
            for tile in sorted(self.tiles, key=lambda tile: -_height(tile.scene)):
                if _look(tile.scene) not in self.views:
                    views = Views(tile.scene, {CAMERA: (self.height, self.width)})
                    ball = views.model.geom("ball")
                    ball.matid, ball.rgba = -1, BALL
                    self.views[_look(tile.scene)] = stack.enter_context(closing(views))
                    # From above shadows tell nothing, and cost more than all the rest.
                    views.renderers[CAMERA].scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
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
            picture = tile.draw(self.views[_look(tile.scene)], i)
            sheet[top : bottom - 1, left : right - 1] = picture[:-1, :-1]
        image = Image.fromarray(sheet)
        pen = ImageDraw.Draw(image)
        for tile, box in zip(self.tiles, self.boxes, strict=False):
            tile.write(pen, box, i, self.scale)
        pen.text((12, 26), f"t = {self.times[i]:.1f} s", style.INK, style.pillow_font(22), "ls")
        pen.text((190, 26), self.note, style.INK, style.pillow_font(14), "ls")
        pen.text((WIDTH - 12, 26), self.legend, style.INK, style.pillow_font(14), "rs")
        return np.asarray(image)


def _look(scene: Top | Motor) -> tuple[Any, ...]:
    return tuple(getattr(scene, name, None) for name in SEEN)


def _height(scene: Top | Motor) -> float:
    """Height in m of the top's ring where it is highest; the motor's rings have their own look."""
    if isinstance(scene, Motor):
        return 0.0
    return max([height for _, height, _ in scene.ring_script] or [scene.ring_height])
