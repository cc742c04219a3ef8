"""Pictures of a parameter sweep: each measure over the one field or the two that were varied."""

import json
import re
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.common.arguments import Picture, checked
from magmotor.common.checks import check_array, reject
from magmotor.common.style import save_small

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@checked
def sweep(data: xr.Dataset, path: Picture) -> None:
    """Write one picture of a sweep, a panel for each measure.

    Over one field a curve, over a grid of two a map; a random design is drawn as points. Of
    several seeds or replicas the mean, over one field with two standard errors.

    Parameters
    ----------
    data : xarray.Dataset
        Its attribute `axes` is a JSON list of the varied dimensions: fields with their values as
        coordinates, or `sample`, over which the fields of a design are coordinates. Measures are
        variables over these, `seed` and `replica`, NaN where a case is missing or failed; others,
        such as trajectories, are not drawn. Units and names stand in the attributes.
    path : str or Path
        The .png to write.

    Raises
    ------
    ValueError
        More than two fields have several values, or none; or there is no measure.
    """
    fields = varied_fields(data)
    if len(fields) not in (1, 2):
        bound = "one or two fields with several values: select one value of each other (isel, sel)"
        raise reject("axes", fields, bound)
    measures = _measures(data, fields)
    if not measures:
        raise reject("measures", [*map(str, data)], f"at least one number for each of {fields}")
    columns = 2 if len(measures) in (2, 4) else min(3, len(measures))
    rows = -(-len(measures) // columns)
    with style.figure(max(6.4, 4.6 * columns), 0.3 + 3.6 * rows) as figure:
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, measure in zip(grid, measures, strict=False):
            _draw(axes, measure, fields)
        for axes in grid[len(measures) :]:
            axes.remove()
        _legend(figure)
        save_small(figure, path, dpi=100)


def _measures(data: xr.Dataset, fields: list[str]) -> list[xr.DataArray]:
    """Numbers for each value of the fields; along axes they rise."""
    drawn = {dim for field in fields for dim in data[field].dims}
    single = {dim: 0 for dim, size in data.sizes.items() if size == 1}
    data = data.isel(single).sortby([field for field in fields if field in drawn])
    return [
        measure
        for measure in data.values()
        if set(measure.dims) - {*REPEATS} == drawn and measure.dtype.kind in "fiu"
    ]


def _draw(axes: "Axes", measure: xr.DataArray, fields: list[str]) -> None:
    axes.set_title(fill(meaning_of(measure), WRAP))
    shown = averaged(measure)
    if shown.mean.isnull().all():
        axes.text(0.5, 0.5, "nothing yet", transform=axes.transAxes, ha="center", color=style.GREY)
        axes.set_axis_off()
    elif len(fields) == 1:
        draw_curve(axes, shown, measure[fields[0]])
    elif all(field in measure.dims for field in fields):
        draw_map(axes, shown, *(measure[field] for field in fields))
    else:
        draw_points(axes, shown, *(measure[field] for field in fields))


def _legend(figure: "Figure") -> None:
    """Of what is drawn in any panel, each label once."""
    handles = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        place = {"loc": "outside lower center", "ncols": len(handles)}
        figure.legend(handles.values(), handles.keys(), **place)


Array = NDArray[np.float64]

WRAP = 38
"""Letters in a line of a label."""

FEW = 8
"""An axis has its ticks at the values if each is further from the next than 1/8 of its length."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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


def varied_fields(data: xr.Dataset) -> list[str]:
    """Names of the fields with more than one value: of the axes, and of designs over `sample`."""
    dims = [dim for dim in _axes(data) if data.sizes.get(dim, 1) > 1]
    over = [
        [dim] if dim in data.coords else [name for name in data.coords if data[name].dims == (dim,)]
        for dim in dims
    ]
    return [str(name) for names in over for name in names]


def _axes(data: xr.Dataset) -> list[str]:
    try:
        axes = json.loads(data.attrs["axes"])
    except (KeyError, TypeError, ValueError):
        axes = None
    if not isinstance(axes, list) or not all(isinstance(name, str) for name in axes):
        bound = "those of a combined sweep: axes is a JSON list of names"
        raise reject("attributes", [*data.attrs], bound)
    return axes


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
