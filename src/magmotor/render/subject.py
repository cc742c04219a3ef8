"""Subjects: what a movie tells of a scene beside its pictures, one class a kind of scene."""

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


class Subject(Protocol):
    """What the frames must know of a scene; it is made from run, scene and the frames' times.

    Attributes
    ----------
    near : str
        The camera of the smaller view.
    trail : float
        Width of the trail in radii of the ball.
    needs : tuple of str
        The variables that a run must have.
    value : ndarray, shape (T,)
        What the panel's curve has reached in each frame.
    """

    near: str
    trail: float
    needs: tuple[str, ...]
    value: NDArray[np.float64]

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the panel's curves over the whole run."""
        ...

    def lines(self, i: int) -> list[str]:
        """The numbers of frame i, as lines of text."""
        ...
