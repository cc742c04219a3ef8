"""One measure of a sweep in one panel: over one varied field, or over two."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.plots import style
from magmotor.plots.sweep_axes import Axis, axis_of, label_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

REPEATS = ("seed", "replica")
"""Dimensions over which a measure is averaged."""

DOTS = 1000
"""More single values than that are not drawn."""

SIGNED_PART = 0.05
"""A map in which either sign has at least this part of the largest size is centred on zero."""

PALE = "#dfe3e7"
"""Zero between two signs, to be told from missing cells and from the background."""

LACKING: dict[str, Any] = {"label": "missing or failed"}
HATCHED: dict[str, Any] = {"fc": "white", "ec": style.GREY, "hatch": "////", "lw": 0} | LACKING
CROSSED: dict[str, Any] = {"marker": "x", "color": style.GREY, "s": 16, "lw": 1.0} | LACKING


class Averaged(NamedTuple):
    """A measure, its mean over seeds and replicas, and that mean's standard error.

    The error is NaN where there are fewer than two values, the mean where there is none.
    """

    single: xr.DataArray
    mean: xr.DataArray
    error: xr.DataArray


def averaged(measure: xr.DataArray) -> Averaged:
    """The mean over seeds and replicas of those values that there are."""
    single = measure.astype(float)
    single = single.where(np.isfinite(single))
    over = [dim for dim in REPEATS if dim in single.dims]
    count = single.notnull().sum(over)
    mean = single.sum(over) / count.where(count > 0)
    square = ((single - mean) ** 2).sum(over)
    return Averaged(single, mean, (square / (count * (count - 1)).where(count > 1)) ** 0.5)


def draw_curve(axes: "Axes", shown: Averaged, field: xr.DataArray) -> None:
    """Over one field: the mean with two standard errors, and single values as faint dots.

    The points are joined unless they are a design's.
    """
    x = axis_of(field)
    looks: dict[str, Any] = {"color": style.BLUE, "marker": "o", "ms": 4}
    looks["ls"] = "-" if field.name in field.dims else ""
    if shown.error.notnull().any():
        looks |= {"label": "mean, ± 2 standard errors", "elinewidth": 1.2, "capsize": 2}
        if shown.single.size <= DOTS:
            place, single = _flat(x.over(field), shown.single)
            axes.scatter(place, single, 12, style.BLUE, lw=0, alpha=0.25, label="single run")
    axes.errorbar(x.values, shown.mean.values, 2 * shown.error.values, **looks)
    missing = x.values[shown.mean.isnull()]
    if len(missing):
        foot = np.full(len(missing), 0.03)
        axes.scatter(missing, foot, transform=axes.get_xaxis_transform(), **CROSSED)
    axes.set_ylabel(label_of(str(shown.single.name), shown.single))
    x.show(axes, "x")


def draw_map(axes: "Axes", shown: Averaged, *fields: xr.DataArray) -> None:
    """Over a grid of two fields: the mean in colours, missing cells hatched."""
    from matplotlib.patches import Rectangle

    x, y = map(axis_of, fields)
    mean = shown.mean.transpose(*(field.name for field in reversed(fields))).values
    if np.isnan(mean).any():
        axes.add_patch(Rectangle((0, 0), 1, 1, transform=axes.transAxes, **HATCHED))
    right, up = x.edges(), y.edges()
    mesh = axes.pcolormesh(right, up, mean, **_colours(mean))
    axes.set(xlim=right[[0, -1]], ylim=up[[0, -1]])
    _finish(axes, mesh, shown, x, y)


def draw_points(axes: "Axes", shown: Averaged, *fields: xr.DataArray) -> None:
    """Over a design of two fields: the mean in the colours of points, missing ones as crosses."""
    x, y = map(axis_of, fields)
    right, up, mean = _flat(x.over(fields[0]), y.over(fields[1]), shown.mean)
    there = np.isfinite(mean)
    size = np.clip(12000 / len(mean), 8, 50)
    looks = {"lw": 0, "antialiased": len(mean) < DOTS} | _colours(mean)
    points = axes.scatter(right[there], up[there], size, mean[there], **looks)
    if not there.all():
        axes.scatter(right[~there], up[~there], **CROSSED)
    _finish(axes, points, shown, x, y)


def _flat(*quantities: xr.DataArray) -> list[Array]:
    """Quantities over all the dimensions that any of them has, as vectors."""
    return [quantity.values.ravel() for quantity in xr.broadcast(*quantities)]


def _colours(mean: Array) -> dict[str, Any]:
    """From the least to the largest, or centred on zero where both signs are there."""
    from matplotlib.colors import LinearSegmentedColormap

    least, largest = float(np.nanmin(mean)), float(np.nanmax(mean))
    reach = max(-least, largest)
    if min(-least, largest) < SIGNED_PART * reach:
        return {"cmap": "viridis", "vmin": least, "vmax": largest}
    signed = LinearSegmentedColormap.from_list("signed", (style.BLUE, PALE, style.ORANGE))
    return {"cmap": signed, "vmin": -reach, "vmax": reach}


def _finish(axes: "Axes", drawn: Any, shown: Averaged, x: Axis, y: Axis) -> None:
    axes.figure.colorbar(drawn, ax=axes, aspect=30).set_label(
        label_of(str(shown.single.name), shown.single)
    )
    axes.grid(visible=False)
    x.show(axes, "x")
    y.show(axes, "y")
