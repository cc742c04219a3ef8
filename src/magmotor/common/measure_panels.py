"""Figure panels that show a measure as a function of one or two fields.

Measures and fields are data arrays with the attributes `units` and `long_name`.
"""

import re
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


WRAP = 34
"""Maximum number of characters in a line of a label."""

FEW = 8
"""Ticks are at the values if all gaps between these exceed 1/8 of the axis."""

REPEATS = ("seed", "replica")
"""Dimensions over which a measure is averaged."""

MOST_DOTS = 1000
"""Single values are drawn if there are at most this many."""

SIGNED_FRACTION = 0.05
"""Maps whose values of both signs reach this fraction of the largest size center on zero."""

PALE = "#dfe3e7"
"""Color of zero in a map with both signs, unlike that of missing cells and the background."""

MISSING: dict[str, Any] = {"label": "missing or failed"}
HATCHED: dict[str, Any] = {"fc": "white", "ec": style.GRAY, "hatch": "////", "lw": 0} | MISSING
CROSSED: dict[str, Any] = {"marker": "x", "color": style.GRAY, "s": 16, "lw": 1.0} | MISSING


class Axis(NamedTuple):
    """A varied field along an axis.

    Attributes
    ----------
    values : ndarray, shape (N,)
        Values of the field.
    label : str
        Name and unit.
    scale : str
        "log" if the ratios of the values are more even than their differences, else "linear".
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
        fit = which == "y" or len(" ".join(labels)) <= WRAP
        if fit and gaps.min(initial=np.inf) * FEW > gaps.sum() > 0:
            axis.set_ticks(values, labels)
            axis.set_minor_locator(NullLocator())
        elif self.scale == "log" and 1e-3 <= self.values.min() < self.values.max() < 1e4:
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
            if self.values.max() < 100 * self.values.min():
                axis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))

    def over(self, field: xr.DataArray) -> xr.DataArray:
        """Return the values as an array over the field's dimensions."""
        return xr.DataArray(self.values, dims=field.dims)

    def edges(self) -> Array:
        """Return the edges of cells around N increasing values, halfway on the axis's scale.

        The shape is (N + 1,).
        """
        values = self._even(self.values)
        middle = (values[1:] + values[:-1]) / 2
        ends = values[[0, -1]] + (values[[0, -1]] - middle[[0, -1]])
        edges = np.concatenate([ends[:1], middle, ends[1:]])
        return np.exp(edges) if self.scale == "log" else edges

    def _even(self, values: Array) -> Array:
        return np.log(values) if self.scale == "log" else values


def axis_of(field: xr.DataArray) -> Axis:
    """Return the axis that shows a field."""
    values = check_array(str(field.name), field.values, "values")
    scale = "log" if _is_geometric(field.values) else "linear"
    return Axis(values, label_of(meaning_of(field), field), scale)


def label_of(name: str, quantity: xr.DataArray) -> str:
    """Return the label of a field or measure: `name`, with the unit of `quantity`."""
    unit = quantity.attrs.get("units", "1")
    raised = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(style.SUPERSCRIPTS), unit)
    return fill(name if unit == "1" else f"{name} ({raised})", WRAP)


def meaning_of(quantity: xr.DataArray) -> str:
    """Return the description of a field or measure, or else its name in words."""
    return str(quantity.attrs.get("long_name", str(quantity.name).replace("_", " ")))


def _is_geometric(values: Array) -> bool:
    """Whether the logarithms of the values are spaced at least twice as evenly as the values."""
    values = np.unique(values)
    if len(values) < 3 or values[0] <= 0:
        return False
    even, ratio = (np.diff(v).std() / np.diff(v).mean() for v in (values, np.log(values)))
    return bool(ratio < even / 2)


class Averaged(NamedTuple):
    """A measure, its mean over seeds and replicas, and the standard error of the mean.

    The error is NaN where there are fewer than two values, and the mean where there are none.
    """

    single: xr.DataArray
    mean: xr.DataArray
    error: xr.DataArray


def averaged(measure: xr.DataArray) -> Averaged:
    """Average a measure over seeds and replicas, ignoring missing values."""
    single = measure.astype(float)
    single = single.where(np.isfinite(single))
    over = [dim for dim in REPEATS if dim in single.dims]
    count = single.notnull().sum(over)
    mean = single.sum(over) / count.where(count > 0)
    square = ((single - mean) ** 2).sum(over)
    return Averaged(single, mean, (square / (count * (count - 1)).where(count > 1)) ** 0.5)


def draw_curve(axes: "Axes", shown: Averaged, field: xr.DataArray) -> None:
    """Draw the mean with two standard errors over one field, and single values as faint dots.

    A line joins the points unless they belong to a design of several fields.
    """
    x = axis_of(field)
    look: dict[str, Any] = {"color": style.BLUE, "marker": "o", "ms": 4}
    look["ls"] = "-" if field.name in field.dims else ""
    if shown.error.notnull().any():
        look |= {"label": "mean, ± 2 standard errors", "elinewidth": 1.2, "capsize": 2}
        if shown.single.size <= MOST_DOTS:
            abscissa, single = _flat(x.over(field), shown.single)
            axes.scatter(abscissa, single, 12, style.BLUE, lw=0, alpha=0.25, label="single run")
    axes.errorbar(x.values, shown.mean.values, 2 * shown.error.values, **look)
    missing = x.values[shown.mean.isnull()]
    if len(missing):
        bottom = np.full(len(missing), 0.03)
        axes.scatter(missing, bottom, transform=axes.get_xaxis_transform(), **CROSSED)
    axes.set_ylabel(_label(shown))
    x.show(axes, "x")


def _label(shown: Averaged) -> str:
    return label_of(meaning_of(shown.single), shown.single)


def draw_map(axes: "Axes", shown: Averaged, *fields: xr.DataArray) -> None:
    """Draw the mean over a grid of two fields as a color map, with missing cells hatched."""
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
    """Draw the mean over a design of two fields as colored points, with missing ones as crosses."""
    x, y = map(axis_of, fields)
    right, up, mean = _flat(x.over(fields[0]), y.over(fields[1]), shown.mean)
    found = np.isfinite(mean)
    size = np.clip(12000 / len(mean), 8, 50)
    look = {"lw": 0, "antialiased": len(mean) < MOST_DOTS} | _colors(mean)
    points = axes.scatter(right[found], up[found], size, mean[found], **look)
    if not found.all():
        axes.scatter(right[~found], up[~found], **CROSSED)
    _finish(axes, points, shown, x, y)


def _flat(*quantities: xr.DataArray) -> list[Array]:
    """Broadcast quantities against each other and return them as vectors."""
    return [quantity.values.ravel() for quantity in xr.broadcast(*quantities)]


def _colors(mean: Array) -> dict[str, Any]:
    """Return a colormap and its range, centered on zero if both signs occur."""
    from matplotlib.colors import LinearSegmentedColormap

    least, largest = float(np.nanmin(mean)), float(np.nanmax(mean))
    reach = max(-least, largest)
    if min(-least, largest) < SIGNED_FRACTION * reach:
        return {"cmap": "viridis", "vmin": least, "vmax": largest}
    signed = LinearSegmentedColormap.from_list("signed", (style.BLUE, PALE, style.ORANGE))
    return {"cmap": signed, "vmin": -reach, "vmax": reach}


def _finish(axes: "Axes", drawn: Any, shown: Averaged, x: Axis, y: Axis) -> None:
    axes.figure.colorbar(drawn, ax=axes, aspect=30).set_label(_label(shown))
    axes.grid(visible=False)
    x.show(axes, "x")
    y.show(axes, "y")
