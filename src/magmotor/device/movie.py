"""Text, curves and cameras that a movie or a contact sheet adds to a recorded run."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import xarray as xr

from magmotor.common.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


class SideView(NamedTuple):
    """A ring above a ball on the floor, for a sketch that shows the ring's tilt from the side.

    The sketch looks horizontally, at right angles to the direction in which the ring's normal
    leans. Arrays have one element for each frame.
    """

    radius: float
    """Radius of the ring (m)."""
    height: Array
    """Height of the ring's center above the floor (m)."""
    tilt: Array
    """Angle between the ring's normal and the vertical (rad)."""
    ball_radius: float
    """Radius of the ball (m)."""
    ball: Array
    """Coordinate of the ball in the direction in which the normal leans (m)."""


class MovieContent(Protocol):
    """Content of a movie beside its main view; made once from run, scene and frame times (s).

    The scene's model, with its visual elements, must have the camera `front` of the main view, and
    the camera that `near` names. Derived classes inherit what a movie can do without: title,
    caption, side view, event and result are then missing in the picture.

    Attributes
    ----------
    near : str
        Name of the MJCF camera of the smaller view; any but `front`.
    path : ndarray, shape (n, 3)
        Points of the trail in m, at the n recorded times.
    trail : float
        Width of the trail, in m.
    needs : tuple of str
        Variables that the run must have; read from the class, before it is called.
    value : ndarray, shape (T,)
        Height of the marker on the panel's curve in each of the T frames.
    title, caption : str
        What the movie shows: its name, and one sentence.
    side_view : SideView or None
        A ring and a ball, sketched from the side.
    """

    near: str
    needs: tuple[str, ...]
    path: Array
    trail: float
    value: Array
    title: str = ""
    caption: str = ""
    side_view: SideView | None = None

    def __init__(self, run: xr.Dataset, scene: Any, times: Array): ...

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the panel's curves over the whole run, and return them; called once."""
        ...

    def lines(self, i: int) -> list[str]:
        """Return the lines of text in frame i."""
        ...

    def event(self, i: int) -> str:
        """Return a few words on what happens in frame i, shown large."""
        return ""

    def result(self) -> str:
        """Return the result in one sentence, shown at the end."""
        return ""


class Gauge(NamedTuple):
    """The quantity that the bars of a contact sheet show.

    A contact sheet shows a ball from above. It requires

    - of the run: `position` (m), the path of the ball's center, which leaves the trail;
    - of the scene: `ball_radius` (m), to which the trail's width is proportional;
    - of the scene's model, with its visual elements: the geom `ball`, which gets a uniform color,
      and the camera `top`, from which it is seen;
    - of the device: `joints`.
    """

    name: str
    unit: str
    needs: tuple[str, ...]
    """Variables that the run must have."""
    values: Callable[[xr.Dataset, Any], Array]
    """Returns the quantity at each recorded time, from a run and its scene."""
    alike: tuple[str, ...]
    """Fields in which scenes that share one compiled model must agree."""
    height: Callable[[Any], float]
    """Returns the height of a scene's highest visible point, in m."""


def between(run: xr.Dataset, values: Array, times: Array) -> Array:
    """Interpolate values at a run's recorded times linearly to other times (s)."""
    return np.interp(times, run.time.values, values)
