"""Pictures of a parameter sweep: each measure over the one field or the two that were varied."""

import json
from textwrap import fill
from typing import TYPE_CHECKING

import xarray as xr

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import Picture
from magmotor.common.measure_panels import (
    REPEATS,
    WRAP,
    averaged,
    draw_curve,
    draw_map,
    draw_points,
    meaning_of,
)
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
        sentence = "must be one or two fields that vary: select one value of each other (isel, sel)"
        raise reject("axes", fields, sentence)
    measures = _measures(data, fields)
    if not measures:
        raise reject(
            "measures", [*map(str, data)], f"must be at least one number for each of {fields}"
        )
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
        axes.text(0.5, 0.5, "nothing yet", transform=axes.transAxes, ha="center", color=style.GRAY)
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
        sentence = "must be those of a combined sweep: axes is a JSON list of names"
        raise reject("attributes", [*data.attrs], sentence)
    return axes
