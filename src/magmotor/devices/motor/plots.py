"""The paper's figures of the motor, one panel a run, and one run at a glance."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.hints import Picture, several
from magmotor.common.style import save_small
from magmotor.devices.motor import plot_panels
from magmotor.devices.motor.plot_panels import MotorRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Figure(NamedTuple):
    """What a figure draws in each panel, and what it is called."""

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

PLACES = {
    "theta": "best",
    "onset": "best",
    "path": "center",
    "injected": "upper left",
    "temperatures": "lower left",
}
"""The panels of the overview, and where they have room for a legend."""

TEMPERATURES = ("nonuniform", "uniform")
"""The rows of a figure, if there are runs of both."""


@checked
def motor_figure(
    runs: Annotated[Sequence[MotorRun], several(MotorRun)], name: str, path: Picture
) -> None:
    """Write one of `FIGURES`, with a panel for each run and a row for each kind of temperature.

    Parameters
    ----------
    runs : sequence of MotorRun
        The paper's seven, or some of them.
    name : str
        Of `FIGURES`.
    path : str or Path
        The .png to write.
    """
    check_choice("name", name, tuple(FIGURES))
    kinds = [[run for run in runs if run.scene.temperature == kind] for kind in TEMPERATURES]
    rows = [row for row in kinds if row]
    width = max(len(row) for row in rows)
    with style.figure(max(7.0, 4.2 * width), 1.0 + 3.4 * len(rows)) as figure:
        grid = figure.subplots(len(rows), width, squeeze=False)
        for line, row in zip(grid, rows, strict=True):
            for axes, run in zip(line, row, strict=False):
                FIGURES[name].draw(axes, run)
                axes.set_title(run.title)
            for axes in line[len(row) :]:
                axes.remove()
        figure.suptitle(FIGURES[name].title)
        _legend(figure, figure.axes, loc="outside lower center", ncols=5)
        save_small(figure, path, dpi=90)


@checked
def motor_overview(run: MotorRun, path: Picture, others: Sequence[MotorRun] = ()) -> None:
    """Write one picture of a run: its flights, where the longest begins, energy, temperatures.

    Parameters
    ----------
    run : MotorRun
    path : str or Path
        The .png to write.
    others : sequence of MotorRun
        Runs whose temperatures are shown, too, if they are of the same kind.
    """
    layout: list[Any] = [["theta"] * 4, ["onset", "path", "injected", "temperatures"]]
    with style.figure(18.0, 9.0) as figure:
        axes = figure.subplot_mosaic(layout, width_ratios=(1.1, 1, 1, 1))
        plot_panels.draw_theta(axes["theta"], run)
        axes["theta"].set_title(f"{run.title}; {run.flights_in_words}")
        plot_panels.draw_onset(axes["onset"], run)
        axes["onset"].set_title("Where the longest flight begins")
        plot_panels.draw_path(axes["path"], run)
        axes["path"].set_title("Path of the ball from above")
        plot_panels.draw_injected(axes["injected"], run)
        axes["injected"].set_title(f"Energy: residual {run.residual:.0e} of what is injected")
        plot_panels.draw_temperatures(axes["temperatures"], run, others)
        axes["temperatures"].set_title("Temperature of each mode, second half")
        for name, place in PLACES.items():
            _legend(axes[name], [axes[name]], loc=place, fontsize=8)
        save_small(figure, path, dpi=90)


def _legend(where: Any, axes: "Iterable[Axes]", **place: Any) -> None:
    """A legend of what is drawn in the panels, each label once, its lines thick enough to see."""
    handles: dict[str, Any] = {}
    drawn: list[Any] = [part for each in axes for part in (each, *each.child_axes)]
    for panel in drawn:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if not handles:
        return
    legend = where.legend([*handles.values()], [*handles], **place)
    for line in legend.get_lines():
        line.set_linewidth(max(1.6, line.get_linewidth()))
