"""The varied fields of a sweep, and how an axis of a picture shows one."""

import json
import re
from textwrap import fill
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.checks import check_array, reject

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
