"""A sketch of a tilted ring from the side, in which a small tilt is exaggerated to be seen."""

import math
from typing import TYPE_CHECKING

import numpy as np

from magmotor.common import style
from magmotor.device.movie import SideView

if TYPE_CHECKING:
    from PIL.Image import Image

FACTORS = (20, 10, 5, 2, 1)
LARGEST = math.radians(20)
"""Factors by which tilts can be exaggerated, and the largest tilt drawn unless it is a true one."""

WIDTH, HEIGHT, MARGIN = 210, 120, 10
"""Size of the sketch and of its margins in pixels, at full size of text."""

FINE = 3
"""Pixels that are drawn for each one shown."""

RED = "#c83a1c"
"""Color of the ring's arrows."""


class Sketch:
    """The ring as a line above the floor, with the angle to a level line, and the ball.

    Parameters
    ----------
    view : SideView
    scale : float
        Size of text and sketch; 1 in a movie of 1280 x 720 pixels.
    """

    def __init__(self, view: SideView, scale: float):
        self.view, self.scale = view, scale
        largest = float(np.abs(view.tilt).max())
        fitting = (factor for factor in FACTORS if factor * largest <= LARGEST)
        self.factor = next(fitting, 1) if largest > 0 else 1
        self.size = round(WIDTH * scale), round(HEIGHT * scale)
        text = 34  # pixels for the words above
        rise = view.radius * math.sin(self.factor * largest)
        high = float(view.height.max()) + rise
        wide = (WIDTH - 2 * MARGIN) / (2.4 * view.radius)
        self.zoom = min(wide, (HEIGHT - 2 * MARGIN - text) / high)

    def draw(self, i: int) -> "Image":
        """Draw the sketch of frame i, on white that is to be blended with the picture below."""
        from PIL import Image, ImageDraw

        view, unit = self.view, FINE * self.scale
        canvas = Image.new("RGB", (FINE * self.size[0], FINE * self.size[1]), "white")
        pen = ImageDraw.Draw(canvas)
        tilt, height = float(view.tilt[i]), float(view.height[i])
        shown = self.factor * tilt

        def at(x: float, z: float) -> tuple[float, float]:
            """Return the pixel of a point at x (m) from the center and z (m) above the floor."""
            right, up = WIDTH / 2 + self.zoom * x, HEIGHT - MARGIN - self.zoom * z
            return unit * right, unit * up

        def line(start: tuple[float, float], end: tuple[float, float], color: str, width: float):
            pen.line([start, end], color, round(unit * width))

        reach, length = 1.2 * view.radius, view.radius
        line(at(-reach, 0), at(reach, 0), style.GRAY, 1.5)
        for k in range(-8, 8):  # a dashed level line
            line(at(k * length / 8, height), at((k + 0.5) * length / 8, height), style.GRAY, 1)
        x, z = length * math.cos(shown), length * math.sin(shown)
        line(at(-x, height + z), at(x, height - z), style.INK, 3)
        for side in (-1, 1):
            self._arrow(pen, at(side * x, height - side * z), side, shown, unit)
        if tilt:
            (left, top), (right, bottom) = (
                at(-0.8 * x, height + 0.8 * x),
                at(0.8 * x, height - 0.8 * x),
            )
            degrees = math.degrees(shown)
            pen.arc((left, top, right, bottom), 0, degrees, style.ORANGE, round(2 * unit))
        (x, y), r = at(float(view.ball[i]), view.ball_radius), max(self.zoom * view.ball_radius, 3)
        r *= unit
        pen.ellipse((x - r, y - r, x + r, y + r), style.BLUE)
        small = canvas.reduce(FINE)
        self._label(small, tilt)
        return small

    def _arrow(self, pen, tip: tuple[float, float], side: int, tilt: float, unit: float) -> None:
        """Draw the head of a dipole's arrow, which points outward from one end of the ring."""
        along = np.array([side * math.cos(tilt), side * math.sin(tilt)])
        across = np.array([-along[1], along[0]])
        corners = [(0, 5), (0, -5), (12, 0)]
        points = [np.array(tip) + unit * (a * along + b * across) for a, b in corners]
        pen.polygon([tuple(point) for point in points], RED)

    def _label(self, picture: "Image", tilt: float) -> None:
        from PIL import ImageDraw

        pen, size = ImageDraw.Draw(picture), max(9, round(13 * self.scale))
        factor = f", drawn × {self.factor}" if self.factor > 1 else ""
        level = math.degrees(tilt) < 0.05
        words = "level" if level else f"tilt {math.degrees(tilt):.1f}°{factor}"
        place = (picture.width / 2, MARGIN * self.scale * 0.7)
        pen.text(place, words, style.INK, style.pillow_font(size), "ma")
