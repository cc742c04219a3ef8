"""An overview of a run of the motor."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.hints import Dpi, Picture
from magmotor.device.provenance import numerics_of
from magmotor.devices.motor import plot_panels
from magmotor.devices.motor.plot_panels import MotorRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LEGENDS = {
    "theta": {"loc": "best"},
    "onset": {"loc": "best"},
    "path": {"loc": "center left", "bbox_to_anchor": (1.03, 0.5)},
    "injected": {"loc": "upper left"},
    "temperatures": {"loc": "lower left"},
}
"""Locations of the legends in or beside the panels of the overview."""


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
            add_legend(axes[name], [axes[name]], **location)
        style.save(figure, path, dpi)


def add_legend(parent: Any, axes: "Iterable[Axes]", **location: Any) -> None:
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
