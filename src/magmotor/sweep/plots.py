"""Pictures of a parameter sweep: each measure over the one or two fields that vary."""

import json
from textwrap import fill
from typing import TYPE_CHECKING

import xarray as xr

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Dpi, Picture
from magmotor.common.measure_panels import (
    REPEATS,
    WRAP,
    averaged,
    draw_curve,
    draw_map,
    draw_points,
    meaning_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@checked
def sweep(data: xr.Dataset, path: Picture, dpi: Dpi = style.DPI) -> None:
    """Write one picture of a sweep, with one panel per measure.

    One field gives a curve, a grid of two fields a map, and a random design points. Several seeds
    or replicas are averaged; curves show two standard errors.

    Parameters
    ----------
    data : xarray.Dataset
        Its attribute `axes` is a JSON list of the varied dimensions: fields with their values as
        coordinates, or `sample`, along which the fields of a design are coordinates. Measures are
        numbers over these, `seed` and `replica`, with NaN where a case is missing or failed; other
        variables, like trajectories, are not drawn. Attributes hold units and names.
    path : str or Path
        The file to write; its suffix sets the format, such as .png, .pdf or .svg.
    dpi : int
        Dots per inch of the picture.

    Raises
    ------
    ValueError
        The number of fields that vary is not one or two, or there is no measure.
    """
    fields = varied_fields(data)
    if len(fields) not in (1, 2):
        sentence = "must be one or two varying fields: select one value of every other (isel, sel)"
        raise ArgumentError("axes", fields, sentence)
    measures = _measures(data, fields)
    if not measures:
        raise ArgumentError(
            "measures", [*map(str, data)], f"must include a number over the dimensions of {fields}"
        )
    columns = 2 if len(measures) in (2, 4) else min(3, len(measures))
    rows = -(-len(measures) // columns)
    with style.figure(max(6.4, 3.8 * columns), 0.3 + 3.2 * rows) as figure:
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, measure in zip(grid, measures, strict=False):
            _draw(axes, measure, fields)
        for axes in grid[len(measures) :]:
            axes.remove()
        _legend(figure)
        style.save(figure, path, dpi)


def _measures(data: xr.Dataset, fields: list[str]) -> list[xr.DataArray]:
    """Return the numeric measures over the fields, sorted by ascending values of the fields."""
    drawn = {dim for field in fields for dim in data[field].dims}
    single = {dim: 0 for dim, size in data.sizes.items() if size == 1}
    data = data.isel(single).sortby([field for field in fields if field in drawn])
    return [
        measure
        for measure in data.values()
        if set(measure.dims) - {*REPEATS} == drawn and measure.dtype.kind in "fiu"
    ]


def _draw(axes: "Axes", measure: xr.DataArray, fields: list[str]) -> None:
    shown = averaged(measure)
    if shown.mean.isnull().all():
        axes.set_title(fill(meaning_of(measure), WRAP))
        axes.text(0.5, 0.5, "nothing yet", transform=axes.transAxes, ha="center", color=style.GRAY)
        axes.set_axis_off()
    elif len(fields) == 1:
        draw_curve(axes, shown, measure[fields[0]])
    elif all(field in measure.dims for field in fields):
        draw_map(axes, shown, *(measure[field] for field in fields))
    else:
        draw_points(axes, shown, *(measure[field] for field in fields))


def _legend(figure: "Figure") -> None:
    """Add a legend with every label of any panel once."""
    handles = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        figure.legend(
            handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles)
        )


def varied_fields(data: xr.Dataset) -> list[str]:
    """Return the names of the fields with more than one value, including those of designs."""
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
        sentence = "must be those of a combined sweep, where axes is a JSON list of names"
        raise ArgumentError("attributes", [*data.attrs], sentence)
    return axes
