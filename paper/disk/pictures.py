"""Figures of the sliding disk: its four systems, superposed and one by one."""

from collections.abc import Callable, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.hints import Dpi, Picture, several
from magmotor.common.measure_panels import WRAP
from magmotor.device.provenance import numerics_of
from paper.disk import panels
from paper.disk.panels import Guide, Points
from paper.disk.system import SYSTEMS, System

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


Systems = Annotated[Sequence[System], several(System)]


class Figure(NamedTuple):
    """A figure: its panel, points, title, labels of lines, and extra content of single panels."""

    draw: "Callable[[Axes, System], None]"
    points: "Callable[[System], Points]"
    title: str
    theory: str
    guides: str = ""
    alone: "Callable[[Axes, System], None] | None" = None


FROM_REST = "theory: reduced equation of d; exact if flat; free particle"

FIGURES = {
    "mean": Figure(
        panels.draw_mean,
        panels.mean,
        "Mean of x, from rest at x = 0",
        "theory: impulse of the first push −U′(0), as long as d keeps it",
    ),
    "mean_square": Figure(
        panels.draw_mean_square,
        panels.mean_square,
        "Mean square of x, from rest",
        FROM_REST,
    ),
    "msd": Figure(
        panels.draw_msd,
        panels.msd,
        "Mean square of x, from rest, logarithmic",
        FROM_REST,
    ),
    "slope": Figure(
        panels.draw_slope,
        panels.slope,
        "Local slope of log E[x²] against log t, from rest",
        FROM_REST,
    ),
    "correlation": Figure(
        panels.draw_correlation,
        panels.correlation,
        "Correlation of x(t+2s) − x(t+s), x(t+s) − x(t), stationary",
        "theory, stationary: reduced equation of d; exact if flat (there d = 0); free particle",
        alone=panels.draw_correlation_from_rest,
    ),
    "diffusion": Figure(
        panels.draw_diffusion,
        panels.diffusion,
        "Variance of x over t, from rest",
        FROM_REST,
    ),
    "histogram": Figure(
        panels.draw_histogram,
        panels.histogram,
        "Density of x at the end, from rest",
        "Gaussian of theory's variance",
    ),
    "flights": Figure(
        panels.draw_flights,
        panels.survival,
        "Flights: probability that d keeps its sign for so long, stationary",
        "",
        "slopes −1/2 and −1.9",
    ),
}

OVERVIEW = (("mean", "msd", "slope"), ("correlation", "diffusion", "histogram"))

BARS = "bars and bands: two standard errors"

WIDEST = 8
"""Most entries of a legend in two rows."""


@checked
def disk_overview(
    systems: Systems,
    path: Picture,
    *,
    guide: Guide | None = None,
    beside: Systems = (),
    dpi: Dpi = style.DPI,
) -> None:
    """Write the overview: some of `FIGURES`, with all systems superposed.

    Parameters
    ----------
    systems : sequence of System
        The paper's four, or some of them.
    path : str or Path
        The file to write; its suffix sets the format.
    guide : Guide, optional
        Additional lines for comparison.
    beside : sequence of System
        The same systems, or some of them, by another method: white points on top.
    dpi : int
        Dots per inch of the picture.
    """
    with style.figure(11.6, 7.4) as figure:
        axes = figure.subplot_mosaic([list(row) for row in OVERVIEW])
        for name, panel in axes.items():
            _superpose(panel, name, systems, guide, beside)
            panel.set_title(fill(FIGURES[name].title, WRAP))
        theory = (
            "theory: reduced equation of d (symmetric, asymmetric), exact (flat), free particle"
        )
        _legend(figure, systems, theory, "", guide, beside)
        style.save(figure, path, dpi, shaded=True)


@checked
def disk_figure(
    systems: Systems,
    name: str,
    path: Picture,
    *,
    guide: Guide | None = None,
    beside: Systems = (),
    dpi: Dpi = style.DPI,
) -> None:
    """Write one of `FIGURES`: the systems superposed, and each in its own panel.

    Parameters
    ----------
    systems : sequence of System
        The paper's four, or some of them.
    name : str
        Key of `FIGURES`.
    path : str or Path
        The file to write; its suffix sets the format.
    guide : Guide, optional
        Additional lines for comparison.
    beside : sequence of System
        The same systems, or some of them, by another method: white points on top, in the panels of
        single systems.
    dpi : int
        Dots per inch of the picture.
    """
    check_choice("name", name, tuple(FIGURES))
    drawn = FIGURES[name]
    shown = [system for system in systems if system.has_varying_d or name != "flights"]
    with style.figure(11.6, 7.4) as figure:
        rows: list[Any] = [["all"] * len(shown), [system.name for system in shown]]
        axes = figure.subplot_mosaic(rows, height_ratios=(1.5, 1))
        _superpose(axes["all"], name, shown, guide, ())
        axes["all"].set_title(drawn.title)
        for system in shown:
            panel = axes[system.name]
            _draw(panel, name, system, guide, beside)
            panel.set_title(system.name)
            if drawn.alone:
                drawn.alone(panel, system)
        _legend(figure, shown, drawn.theory, drawn.guides, guide, beside)
        style.save(figure, path, dpi, shaded=name == "mean")


def _superpose(
    axes: "Axes",
    name: str,
    systems: Sequence[System],
    guide: Guide | None,
    beside: Sequence[System],
) -> None:
    for system in systems:
        _draw(axes, name, system, guide, beside)
    if name == "histogram":
        axes.set_yscale("log")


def _draw(
    axes: "Axes", name: str, system: System, guide: Guide | None, beside: Sequence[System]
) -> None:
    FIGURES[name].draw(axes, system)
    for other in beside:
        if other.name == system.name:
            panels.draw_beside(axes, other, FIGURES[name].points(other))
    if guide:
        guide.draw(axes, name, system)


def _legend(
    figure: Any,
    systems: Sequence[System],
    theory: str,
    guides: str,
    guide: Guide | None,
    beside: Sequence[System],
) -> None:
    """Add a legend of systems, line styles and methods below all panels."""
    from matplotlib.lines import Line2D

    def line(label: str, **style_of: Any) -> "Line2D":
        return Line2D([], [], label=label, **style_of)

    handles = []
    for system in systems:
        color, marker = SYSTEMS[system.name]
        handles.append(line(system.name, color=color, marker=marker, ms=4.5))
    if theory:
        handles.append(line(theory, **panels.THEORY))
    handles += [line(label, **panels.GUIDE) for label in (guides, guide and guide.label) if label]
    filled = "filled: " if beside else ""
    handles.append(line(f"{filled}{numerics_of(systems[0].rest)}", ls=""))
    if beside:
        points = {**panels.BESIDE, "lw": 0}
        handles.append(line(f"white: {numerics_of(beside[0].rest)}", marker="o", **points))
    handles.append(line(BARS, ls=""))
    rows = 2 if len(handles) <= WIDEST else 3
    figure.legend(handles=handles, loc="outside lower center", ncols=-(-len(handles) // rows))
