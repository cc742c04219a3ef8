"""What `advise` found."""

import math
from dataclasses import dataclass, field
from pathlib import Path

from magmotor.advice.detail import Detail
from magmotor.advice.path_errors import Order
from magmotor.advice.points import Point
from magmotor.advice.stability import Limit
from magmotor.advice.statistics_errors import Certain, Statistic
from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Dpi, Picture


@dataclass
class Advice:
    """Errors and costs of MuJoCo's integrators for one motion of a model, and a recommendation.

    Attributes
    ----------
    quantity : str
        What the errors refer to.
    error : float
        The error asked for, relative to ranges.
    every_element : bool
        Whether that of each element over its own range counts, or only that of the whole.
    ranges : dict of str to float
        Range of each element, or of the quantity if it has only one; infinite if it is at rest
        beside the others, and not judged.
    duration : float
        Duration of the paths in s.
    integrator : str or None
        What is recommended, or None if nothing reaches the error; `reason` says why.
    timestep : float
        In s; NaN without a recommendation.
    promised : float
        The largest error that the recommendation should have; infinite without one.
    settings : dict of str to float
        Settings of the solver that the recommendation needs besides.
    own : Point or None
        The model's own integrator and timestep.
    points, front : tuple of Point
        All measurements, and those that no other one beats in both error and cost.
    orders : dict of str to Order
        Observed orders.
    limits : dict of str to Limit
        Stability limits at rest.
    constraints : int
        Number of constraints at rest, such as contacts. With any, there are no limits by theory.
    reference : str
        How the reference was computed.
    doubt : float
        Relative error that the reference may have at the horizon.
    horizon : float
        Time in s up to which errors along the path are measured.
    growth : float or None
        Factor by which a perturbation grew, if that was measured.
    statistics : tuple of Statistic
        Errors of means over time, if the motion is chaotic or noisy, or at a temperature.
    for_statistics : Certain or None
        The cheapest integrator and timestep whose statistics are certain to reach the error.
    details : tuple of Detail
        What each feature of the model costs and changes, if that was asked for.
    reason : str
        Why there is no recommendation.
    notes : tuple of str
        What else a user should know.
    """

    quantity: str
    error: float
    duration: float
    every_element: bool = True
    ranges: dict[str, float] = field(default_factory=dict)
    integrator: str | None = None
    timestep: float = math.nan
    promised: float = math.inf
    settings: dict[str, float] = field(default_factory=dict)
    own: Point | None = None
    points: tuple[Point, ...] = ()
    front: tuple[Point, ...] = ()
    orders: dict[str, Order] = field(default_factory=dict)
    limits: dict[str, Limit] = field(default_factory=dict)
    constraints: int = 0
    reference: str = ""
    doubt: float = math.inf
    horizon: float = 0.0
    growth: float | None = None
    statistics: tuple[Statistic, ...] = ()
    for_statistics: Certain | None = None
    details: tuple[Detail, ...] = ()
    reason: str = ""
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return tables of what was measured, and the recommendation."""
        from magmotor.advice.report import report

        return report(self)

    @checked
    def draw(self, path: Picture, dpi: Dpi = style.DPI) -> None:
        """Draw error against cost, and write the picture to a file.

        Parameters
        ----------
        path : str or Path
            The file to write; its suffix sets the format, such as .png, .pdf or .svg.
        dpi : int
            Dots per inch of the picture.

        Raises
        ------
        ValueError
            Nothing was measured.
        """
        from magmotor.advice.picture import draw

        if not self.points:
            raise ArgumentError("points", self.points, "must be measured before they are drawn")
        draw(self, Path(path), dpi)
