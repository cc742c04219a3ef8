"""The paper's figures of the motor, with one panel for each run."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.hints import Dpi, Picture, several
from magmotor.device.provenance import numerics_of
from magmotor.devices.motor import plot_panels
from magmotor.devices.motor.plot_panels import BINS, MotorRun, extremes, slices
from magmotor.devices.motor.plots import add_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_energy(axes: "Axes", run: MotorRun) -> None:
    """Draw total energy and energy of the inner ring, and their difference below."""
    ring = run.data.ring_energy - run.data.ring_energy[0]
    above, below = _halves(axes)
    _draw_band(above, run, run.balance.gain, style.GREEN, "total energy", lw=2.6)
    _draw_band(above, run, ring, style.INK, "inner ring's energy", lw=1.0, ls="--", band=False)
    _draw_band(below, run, run.balance.gain - ring, style.BLUE, "difference: the ball's", lw=1.2)
    above.set(ylabel="gained (J)", xlabel="")
    below.set(ylabel="gained (J)")


def draw_xy(axes: "Axes", run: MotorRun) -> None:
    """Draw x over time, and y below."""
    above, below = _halves(axes)
    for half, name, color in ((above, "x", style.GREEN), (below, "y", style.BLUE)):
        values = run.data.position.sel(space=name).values
        half.plot(*extremes(run.times, values, 4 * BINS), color=color, lw=0.5)
        half.set(ylabel=f"{name} (m)", xlim=(run.times[0], run.times[-1]))
    below.set(xlabel="t (1000 s)")


def _halves(axes: "Axes") -> "tuple[Axes, Axes]":
    """Split a panel into two, and keep its title."""
    axes.set_axis_off()
    above, below = axes.inset_axes((0, 0.57, 1, 0.43)), axes.inset_axes((0, 0, 1, 0.43))
    above.tick_params(labelbottom=False)
    return above, below


def _draw_band(
    axes: "Axes", run: MotorRun, values: Any, color: str, label: str, *, band: bool = True,
    **line_style: Any,
) -> None:  # fmt: skip
    """Draw the mean of each bin, and a band from its smallest to its largest value."""
    values = np.asarray(values)
    bins = slices(len(values), BINS)
    times = np.array([run.times[part].mean() for part in bins])
    mean, low, high = (
        np.array([f(values[part]) for part in bins]) for f in (np.mean, np.min, np.max)
    )
    if band:
        axes.fill_between(times, low, high, color=color, alpha=0.25, lw=0)
    axes.plot(times, mean, color=color, label=label, **line_style)
    axes.set(xlabel="t (1000 s)", xlim=(run.times[0], run.times[-1]))


class Figure(NamedTuple):
    """Drawing function of the panels, and title."""

    draw: "Callable[[Axes, MotorRun], None]"
    title: str


FIGURES = {
    "energy": Figure(
        draw_energy,
        "Total energy and the inner ring's, from the start; below, their difference",
    ),
    "injected": Figure(plot_panels.draw_injected, "Energy injected by the noise and dissipated"),
    "path": Figure(plot_panels.draw_path, "Path of the ball from above"),
    "xy": Figure(draw_xy, "Position of the ball: x above, y below"),
    "theta": Figure(plot_panels.draw_theta, "Azimuth of the ball, and its flights"),
}

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
        add_legend(figure, figure.axes, loc="outside lower center", ncols=5)
        style.save(figure, path, dpi)
