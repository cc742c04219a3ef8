"""A tile of a contact sheet: one run seen from above, its label, and a bar of its spin."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.observables import azimuth
from magmotor.plots import style
from magmotor.render.moments import between, joints
from magmotor.render.trail import Trail
from magmotor.render.views import Image, Views
from magmotor.scenes import Motor, Top

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

CAMERA = "top"

TRAIL = 0.7
"""Width of the trail in radii of the ball."""

REACHED, TRACK, BACKGROUND = "#a9cfe6", "#cdd3d8", 235
"""Colours of what a bar has reached so far and of the rest of it; what stopped tiles fade to."""


class Gauge(NamedTuple):
    """What the bar shows: name, unit, what it needs of a run, and its values at the records."""

    name: str
    unit: str
    needs: tuple[str, ...]
    values: Callable[[xr.Dataset, Top | Motor], NDArray[np.float64]]


GAUGES = {
    Top: Gauge(
        "spin J/I₃",
        "rad/s",
        ("position", "momentum_map"),
        lambda run, scene: run.momentum_map.values / scene.inertia[2],
    ),
    Motor: Gauge(
        "azimuth",
        "revolutions",
        ("position",),
        lambda run, scene: azimuth(run).values / (2 * np.pi),
    ),
}


class Tile:
    """One run, at the times of a sheet's frames.

    Parameters
    ----------
    run : xarray.Dataset
        With orientations, and without replicas.
    scene : Top or Motor
    label : str
        A line for each part between commas.
    times : ndarray, shape (T,)
        In seconds; from its end on the run stands still.

    Raises
    ------
    ValueError
        The run has replicas or no orientation.
    """

    def __init__(self, run: xr.Dataset, scene: Top | Motor, label: str, times: NDArray[np.float64]):
        if run.sizes["time"] == 1:
            moment = run.time.values[0] + np.array([0.0, 1e-9])
            run = (
                run.isel(time=[0, 0]).drop_vars("step", errors="ignore").assign_coords(time=moment)
            )
        self.scene, self.label, self.gauge = scene, label.replace(", ", "\n"), GAUGES[type(scene)]
        self.end = float(run.time[-1])
        self.stopped = times > self.end + float(run.time[-1] - run.time[-2])
        self.times = np.clip(times, *run.time.values[[0, -1]])
        self.drawn = (np.nan, np.empty((0, 0, 3), np.uint8))
        self.joints = joints(run, scene, self.times)
        self.trail = Trail(run.time.values, run.position.values, TRAIL * scene.ball_radius)
        self.value = between(run, self.gauge.values(run, scene), self.times)
        self.least = np.minimum.accumulate(np.minimum(self.value, 0))
        self.largest = np.maximum.accumulate(np.maximum(self.value, 0))

    def draw(self, views: Views, i: int) -> Image:
        """The picture of frame i, faded if the run has stopped by then."""
        if self.times[i] != self.drawn[0]:
            views.scene = self.scene
            views.pose(self.joints[i], self.times[i])
            self.drawn = self.times[i], views.draw(CAMERA, self.trail, self.times[i])
        picture = self.drawn[1]
        return picture // 3 + np.uint8(2 * BACKGROUND // 3) if self.stopped[i] else picture

    def write(self, pen: "ImageDraw", box: tuple[int, int, int, int], i: int, scale: float) -> None:
        """Write label, value and bar of frame i into a box of left, top, right, bottom."""
        left, top, right, bottom = box
        font = style.pillow_font(13 if right - left >= 300 else 11)
        pen.text((left + 7, top + 5), self.label, style.INK, font, spacing=2)
        if self.stopped[i]:
            place = ((left + right) / 2, (top + bottom) / 2)
            pen.text(place, f"stopped at t = {self.end:.1f} s", style.INK, font, "mm")
        told = f"{self.value[i]:+z.2f} {self.gauge.unit}".replace("-", "−")
        pen.text((right - 7, bottom - 7), told, style.INK, font, "rs")
        middle, reach = (top + bottom) / 2 - 6, 0.34 * (bottom - top)
        for low, high, colour in (
            (-scale, scale, TRACK),
            (self.least[i], self.largest[i], REACHED),
            (*sorted((0.0, self.value[i])), style.BLUE),
        ):
            upper, lower = (middle - reach * level / scale for level in (high, low))
            pen.rectangle((right - 15, upper, right - 9, lower), colour)
        pen.line((right - 18, middle, right - 6, middle), style.INK)
