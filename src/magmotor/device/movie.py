"""What a movie tells of a run beside its pictures."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

Array = NDArray[np.float64]


class MovieContent(Protocol):
    """What the frames must know of a run; it is made from run, scene and the frames' times.

    Attributes
    ----------
    near : str
        The camera of the smaller view.
    path : ndarray, shape (n, 3)
        Where the trail leads, at the n times of the run, in m.
    trail : float
        Width of the trail, in m.
    needs : tuple of str
        The variables that a run must have.
    value : ndarray, shape (T,)
        What the panel's curve has reached in each frame.
    """

    near: str
    needs: tuple[str, ...]
    path: Array
    trail: float
    value: Array

    def __init__(self, run: xr.Dataset, scene: Any, times: Array): ...

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the panel's curves over the whole run."""
        ...

    def lines(self, i: int) -> list[str]:
        """The numbers of frame i, as lines of text."""
        ...


class Gauge(NamedTuple):
    """What the bar of a contact sheet shows: name, unit, what it needs of a run, and its values.

    `alike` are the fields of scenes that look alike but for a pose, and `height` is that of the
    highest point that a camera must see, in m.
    """

    name: str
    unit: str
    needs: tuple[str, ...]
    values: Callable[[xr.Dataset, Any], Array]
    alike: tuple[str, ...]
    height: Callable[[Any], float]


def between(run: xr.Dataset, values: Array, times: Array) -> Array:
    """Values of a run's records at other times (s), by linear interpolation."""
    return np.interp(times, run.time.values, values)
