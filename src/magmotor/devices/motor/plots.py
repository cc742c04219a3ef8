"""Figures of the motor: the paper's figures with one panel for each run, and an overview."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.hints import Dpi, Picture, several
from magmotor.device.provenance import numerics_of
from magmotor.devices.motor import plot_panels
from magmotor.devices.motor.plot_panels import MotorRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Figure(NamedTuple):
    """Drawing function of the panels, and title."""

    draw: "Callable[[Axes, MotorRun], None]"
    title: str


FIGURES = {
    "energy": Figure(
        plot_panels.draw_energy,
        "Total energy and the inner ring's, from the start; below, their difference",
    ),
    "injected": Figure(plot_panels.draw_injected, "Energy injected by the noise and dissipated"),
    "path": Figure(plot_panels.draw_path, "Path of the ball from above"),
    "xy": Figure(plot_panels.draw_xy, "Position of the ball: x above, y below"),
    "theta": Figure(plot_panels.draw_theta, "Azimuth of the ball, and its flights"),
}

LEGENDS = {
    "theta": {"loc": "best"},
    "onset": {"loc": "best"},
    "path": {"loc": "center left", "bbox_to_anchor": (1.03, 0.5)},
    "injected": {"loc": "upper left"},
    "temperatures": {"loc": "lower left"},
}
"""Locations of the legends in or beside the panels of the overview."""

TEMPERATURES = ("nonuniform", "uniform")
"""Order of the rows of a figure."""


@checked
def motor_figure(
    runs: Annotated[Sequence[MotorRun], several(MotorRun)],
    name: str,
    path: Picture,
    dpi: Dpi = style.DPI,
) -> None:
    """Draw one of `FIGURES`, with a panel for each run and a row for each value of `temperature`.

    Parameters
    ----------
    runs : sequence of MotorRun
        The paper's seven runs, or some of them.
    name : str
        A key of `FIGURES`.
    path : str or Path
        The file to write; its suffix sets the format, such as .png, .pdf or .svg.
    dpi : int
        Dots per inch of the picture.
    """
    check_choice("name", name, tuple(FIGURES))
    by_temperature = [[r for r in runs if r.scene.temperature == t] for t in TEMPERATURES]
    rows = [row for row in by_temperature if row]
    width = max(len(row) for row in rows)
    with style.figure(max(10.0, 2.9 * width), 1.0 + 2.7 * len(rows)) as figure:
        grid = figure.subplots(len(rows), width, squeeze=False)
        for line, row in zip(grid, rows, strict=True):
            for axes, run in zip(line, row, strict=False):
                FIGURES[name].draw(axes, run)
                axes.set_title(run.title.replace(", ", "\n"))
            for axes in line[len(row) :]:
                axes.remove()
        numerics = sorted({numerics_of(run.data) for run in runs})
        figure.suptitle(f"{FIGURES[name].title} ({'; '.join(numerics)})")
        _legend(figure, figure.axes, loc="outside lower center", ncols=5)
        style.save(figure, path, dpi)


@checked
def motor_overview(
    run: MotorRun, path: Picture, others: Sequence[MotorRun] = (), dpi: Dpi = style.DPI
) -> None:
    """Draw an overview of a run: flights, the longest flight's beginning, energy, temperatures.

    Parameters
    ----------
    run : MotorRun
    path : str or Path
        The file to write; its suffix sets the format.
    others : sequence of MotorRun
        Runs whose temperatures are also shown if they have the same `temperature`.
    dpi : int
        Dots per inch of the picture.
    """
    layout: list[Any] = [["theta"] * 2, ["onset", "path"], ["injected", "temperatures"]]
    with style.figure(12.0, 10.5) as figure:
        axes = figure.subplot_mosaic(layout)
        plot_panels.draw_theta(axes["theta"], run)
        axes["theta"].set_title(f"{run.title}; {run.flights_in_words} ({numerics_of(run.data)})")
        plot_panels.draw_onset(axes["onset"], run)
        axes["onset"].set_title("Where the longest flight begins")
        plot_panels.draw_path(axes["path"], run)
        axes["path"].set_title("Path of the ball from above")
        plot_panels.draw_injected(axes["injected"], run)
        axes["injected"].set_title(f"Energy: residual {run.residual:.0e} of what is injected")
        plot_panels.draw_temperatures(axes["temperatures"], run, others)
        axes["temperatures"].set_title("Temperature of each mode, second half")
        for name, location in LEGENDS.items():
            _legend(axes[name], [axes[name]], **location)
        style.save(figure, path, dpi)


def _legend(parent: Any, axes: "Iterable[Axes]", **location: Any) -> None:
    """Add a legend with each label of the panels once and with thick lines."""
    handles: dict[str, Any] = {}
    panels: list[Any] = [part for each in axes for part in (each, *each.child_axes)]
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if not handles:
        return
    legend = parent.legend([*handles.values()], [*handles], **location)
    for line in legend.get_lines():
        line.set_linewidth(max(1.6, line.get_linewidth()))
