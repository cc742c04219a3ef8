"""The picture of the study of the motor's geometry."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from magmotor.common import style
from magmotor.common.measure_panels import averaged, draw_map, label_of, meaning_of
from magmotor.devices.motor.scene import Motor

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BARRIERS = (0, 0.1, 0.3, 1, 3)
"""Barriers in kT of the contour lines."""

FARTHEST = 5
"""Largest thermal lean, in degrees, that is drawn."""

COLORS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.INK)


def geometry_map(
    rings: xr.Dataset,
    dipoles: xr.Dataset,
    static: Mapping[str, xr.Dataset],
    scene: Motor,
    path: str | Path,
    dpi: int = style.DPI,
) -> None:
    """Draw the study of the motor's geometry.

    Parameters
    ----------
    rings : xarray.Dataset
        A combined sweep over `outer_radius` and `inner_height`, with the measures `flying` and
        `longest_flight`.
    dipoles : xarray.Dataset
        The same over `inner_dipoles` and `outer_dipoles`.
    static : mapping
        Results of `statics`: "rings" over the same fields as `rings`, "offset" over `outer_radius`
        and `outer_height`, and "dipoles" over the numbers of dipoles.
    scene : Motor
        The scene that was varied; it is marked by a star.
    path : str or Path
        The file to write; its suffix sets the format.
    dpi : int
        Dots per inch of the picture.
    """
    with style.figure(11.6, 6.8) as figure:
        above, below = figure.subplots(2, 3)
        barrier = static["rings"].barrier
        _map(above[0], barrier, "outer_radius", "inner_height", scene)
        lines = above[0].contour(
            barrier.outer_radius, barrier.inner_height, barrier.transpose("inner_height", ...),
            BARRIERS, colors=style.INK, linewidths=0.8, linestyles="-",
        )  # fmt: skip
        above[0].clabel(lines, fontsize=8)
        lean = static["offset"].lean
        _map(above[1], lean.where(lean < FARTHEST), "outer_radius", "outer_height", scene)
        title = f"Hatched: a lean above {FARTHEST}°, or unstable"
        above[1].set_title(title)
        _lines(above[2], static["dipoles"].barrier)
        _map(below[0], rings.longest_flight, "outer_radius", "inner_height", scene)
        _map(below[1], rings.flying, "outer_radius", "inner_height", scene)
        _map(below[2], dipoles.longest_flight, "inner_dipoles", "outer_dipoles", scene)
        style.save(figure, path, dpi, shaded=True)


def _map(axes: "Axes", measure: xr.DataArray, right: str, up: str, scene: Motor) -> None:
    shown = averaged(measure)
    draw_map(axes, shown, measure[right], measure[up])
    axes.plot(
        getattr(scene, right), getattr(scene, up), "*", ms=13, color="white", mec=style.INK, mew=1.0
    )


def _lines(axes: "Axes", barrier: xr.DataArray) -> None:
    for color, number in zip(COLORS, barrier.outer_dipoles.values, strict=False):
        line = barrier.sel(outer_dipoles=number)
        axes.plot(barrier.inner_dipoles, line, "o-", ms=4, color=color, label=f"M = {number}")
    axes.set(xlabel=label_of(meaning_of(barrier.inner_dipoles), barrier.inner_dipoles))
    axes.set(ylabel=label_of(meaning_of(barrier), barrier), yscale="log")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3)
