"""Panels of a picture: a measure drawn over one field or two, which need not be a sweep's.

Both are data arrays; their names, units and meanings stand in their attributes.
"""

import re
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.common.checks import check_array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

WRAP = 38
"""Letters in a line of a label."""

FEW = 8
"""An axis has its ticks at the values if each is further from the next than 1/8 of its length."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

REPEATS = ("seed", "replica")
"""Dimensions over which a measure is averaged."""

DOTS = 1000
"""More single values than that are not drawn."""

SIGNED_PART = 0.05
"""A map in which either sign has at least this part of the largest size is centered on zero."""

PALE = "#dfe3e7"
"""Zero between two signs, to be told from missing cells and from the background."""

LACKING: dict[str, Any] = {"label": "missing or failed"}
HATCHED: dict[str, Any] = {"fc": "white", "ec": style.GRAY, "hatch": "////", "lw": 0} | LACKING
CROSSED: dict[str, Any] = {"marker": "x", "color": style.GRAY, "s": 16, "lw": 1.0} | LACKING


class Axis(NamedTuple):
    """A varied field along an axis.

    Attributes
    ----------
    values : ndarray
        Of the field, shape (N,).
    label : str
        Name and unit.
    scale : str
        linear, or log where the values are spaced more evenly by ratio.
    """

    values: Array
    label: str
    scale: Literal["linear", "log"]

    def show(self, axes: "Axes", which: Literal["x", "y"]) -> None:
        """Label and scale one axis of a panel."""
        from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

        axes.set(**{f"{which}label": self.label, f"{which}scale": self.scale})
        axis = axes.xaxis if which == "x" else axes.yaxis
        values = np.unique(self.values)
        gaps = np.diff(self._even(values))
        labels = [f"{value:.3g}" for value in values]
        fit = which == "y" or len("".join(labels)) <= WRAP
        if fit and gaps.min(initial=np.inf) * FEW > gaps.sum() > 0:
            axis.set_ticks(values, labels)
            axis.set_minor_locator(NullLocator())
        elif self.scale == "log" and 1e-3 <= self.values.min() < self.values.max() < 1e4:
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
            if self.values.max() < 100 * self.values.min():
                axis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))

    def over(self, field: xr.DataArray) -> xr.DataArray:
        """Its values over the field's dimension."""
        return xr.DataArray(self.values, dims=field.dims)

    def edges(self) -> Array:
        """Edges of cells about N rising values, shape (N + 1,), halfway on the axis's scale."""
        values = self._even(self.values)
        middle = (values[1:] + values[:-1]) / 2
        ends = values[[0, -1]] + (values[[0, -1]] - middle[[0, -1]])
        edges = np.concatenate([ends[:1], middle, ends[1:]])
        return np.exp(edges) if self.scale == "log" else edges

    def _even(self, values: Array) -> Array:
        return np.log(values) if self.scale == "log" else values


def axis_of(field: xr.DataArray) -> Axis:
    """How an axis shows a field."""
    values = check_array(str(field.name), field.values, "values")
    scale = "log" if _is_geometric(field.values) else "linear"
    return Axis(values, label_of(meaning_of(field), field), scale)


def label_of(name: str, quantity: xr.DataArray) -> str:
    """A name of a field or measure, with its unit."""
    unit = quantity.attrs.get("units", "1")
    raised = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(SUPERSCRIPTS), unit)
    return fill(name if unit == "1" else f"{name} ({raised})", WRAP)


def meaning_of(quantity: xr.DataArray) -> str:
    """What a field or measure is, in words."""
    return str(quantity.attrs.get("long_name", quantity.name))


def _is_geometric(values: Array) -> bool:
    """Whether the logarithms of some values are spaced at least twice as evenly as the values."""
    values = np.unique(values)
    if len(values) < 3 or values[0] <= 0:
        return False
    even, ratio = (np.diff(v).std() / np.diff(v).mean() for v in (values, np.log(values)))
    return bool(ratio < even / 2)


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
    style_of: dict[str, Any] = {"color": style.BLUE, "marker": "o", "ms": 4}
    style_of["ls"] = "-" if field.name in field.dims else ""
    if shown.error.notnull().any():
        style_of |= {"label": "mean, ± 2 standard errors", "elinewidth": 1.2, "capsize": 2}
        if shown.single.size <= DOTS:
            place, single = _flat(x.over(field), shown.single)
            axes.scatter(place, single, 12, style.BLUE, lw=0, alpha=0.25, label="single run")
    axes.errorbar(x.values, shown.mean.values, 2 * shown.error.values, **style_of)
    missing = x.values[shown.mean.isnull()]
    if len(missing):
        foot = np.full(len(missing), 0.03)
        axes.scatter(missing, foot, transform=axes.get_xaxis_transform(), **CROSSED)
    axes.set_ylabel(label_of(str(shown.single.name), shown.single))
    x.show(axes, "x")


def draw_map(axes: "Axes", shown: Averaged, *fields: xr.DataArray) -> None:
    """Over a grid of two fields: the mean in colors, missing cells hatched."""
    from matplotlib.patches import Rectangle

    x, y = map(axis_of, fields)
    mean = shown.mean.transpose(*(field.name for field in reversed(fields))).values
    if np.isnan(mean).any():
        axes.add_patch(Rectangle((0, 0), 1, 1, transform=axes.transAxes, **HATCHED))
    right, up = x.edges(), y.edges()
    mesh = axes.pcolormesh(right, up, mean, **_colors(mean))
    axes.set(xlim=right[[0, -1]], ylim=up[[0, -1]])
    _finish(axes, mesh, shown, x, y)


def draw_points(axes: "Axes", shown: Averaged, *fields: xr.DataArray) -> None:
    """Over a design of two fields: the mean in the colors of points, missing ones as crosses."""
    x, y = map(axis_of, fields)
    right, up, mean = _flat(x.over(fields[0]), y.over(fields[1]), shown.mean)
    there = np.isfinite(mean)
    size = np.clip(12000 / len(mean), 8, 50)
    style_of = {"lw": 0, "antialiased": len(mean) < DOTS} | _colors(mean)
    points = axes.scatter(right[there], up[there], size, mean[there], **style_of)
    if not there.all():
        axes.scatter(right[~there], up[~there], **CROSSED)
    _finish(axes, points, shown, x, y)


def _flat(*quantities: xr.DataArray) -> list[Array]:
    """Quantities over all the dimensions that any of them has, as vectors."""
    return [quantity.values.ravel() for quantity in xr.broadcast(*quantities)]


def _colors(mean: Array) -> dict[str, Any]:
    """From the least to the largest, or centered on zero where both signs are there."""
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
