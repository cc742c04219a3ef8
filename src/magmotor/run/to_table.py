"""Datasets as tables: one row for each record, one column for each component."""

import json
import math
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.common.optional import extra

QUATERNION = {"component": ("w", "x", "y", "z")}
"""Names of components that datasets do not label."""

TABLE_FILES = ".csv", ".parquet"
"""Endings of the files to which tables can be written."""

REPLICAS = "replica"
"""Dimensions whose name contains this are rows, with or without coordinates."""


@checked
def to_table(data: xr.Dataset, *, rows: Sequence[str] | None = None) -> pd.DataFrame:
    """Return a dataset as a table for pandas.

    A run has a row for each record, or for each replica and record; a single record of it,
    `run.isel(time=0)`, has one row; a sweep has a row for each case, an ensemble for each time.
    Vectors are split into columns `position_x`, `position_y`, `position_z`, quaternions into
    `orientation_w` and so on, statistics of an ensemble by quantity into `mean_x`, `mean_v`, ...,
    and what is not labeled by number, from 0 on: `qpos_0`.

    Parameters
    ----------
    data : xarray.Dataset
        From `simulate`, `ensemble`, `sweep.combine` or `Langevin.sample`, or a part of it.
    rows : sequence of str, optional
        The dimensions along which the rows run, the last one fastest; by default those of the first
        variable. An ensemble also has variables by `["replica"]`, `["lag"]` etc.

    Returns
    -------
    pandas.DataFrame
        First the coordinates, then the variables, without a row index. A variable that lacks one of
        the dimensions is repeated along it. `attrs["units"]` is a dict of each column's unit, "1"
        if it is dimensionless; `attrs["left_out"]` lists the variables that have other dimensions.

    Raises
    ------
    ValueError
        The dataset has no variables, or `rows` names something else than its dimensions.

    Examples
    --------
    >>> import magmotor as mm
    >>> run = mm.simulate(mm.Top(), method="variational/euler", timestep=0.01, duration=1.0)
    >>> table = mm.to_table(run)
    >>> table.shape
    (101, 23)
    >>> table.columns[:4].to_list(), table.attrs["units"]["position_x"]
    (['time', 'step', 'position_x', 'position_y'], 'm')
    """
    if not data.data_vars:
        raise ArgumentError("data", dict(data.sizes), "must have variables")
    lines = [str(dim) for dim in data.dims if _runs_along_rows(data, dim)]
    if rows is None:
        first = next(iter(data.data_vars.values()))
        rows = [str(dim) for dim in first.dims if dim in lines]
    else:
        for dim in rows:
            check_choice("rows", dim, tuple(lines))
        if len({*rows}) < max(1, len(rows)):
            raise ArgumentError(
                "rows", [*rows], "must name at least one dimension, and each only once"
            )
    if empty := [dim for dim in rows if data.sizes[dim] == 0]:
        raise ArgumentError("data", dict(data.sizes), f"must have at least one {empty[0]}")
    data = data.assign_coords({d: np.arange(data.sizes[d]) for d in rows if d not in data.coords})
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    left_out: list[str] = []
    coordinates = [*rows, *[name for name in data.coords if name not in rows]]
    for name in [*coordinates, *data.data_vars]:
        values = data[name]
        others = [dim for dim in values.dims if dim not in rows]
        if name in data.coords and others:
            continue  # labels of components
        if any(dim in lines for dim in others):
            left_out.append(str(name))
            continue
        for column, numbers in _columns(data, str(name), rows, others):
            if column in columns:
                raise ArgumentError(
                    "data", column, "must be the name of one column only: rename one"
                )
            columns[column] = numbers
            units[column] = str(values.attrs.get("units", "1")) or "1"
    table = pd.DataFrame(columns)
    table.attrs = {"units": units, "left_out": left_out}
    return table


def _runs_along_rows(data: xr.Dataset, dim: Any) -> bool:
    """Whether a dimension counts records, cases or replicas, and not the components of a vector."""
    along = [c for c in data.coords.values() if c.dims == (dim,)]
    return REPLICAS in str(dim) or any(c.dtype.kind in "iuf" for c in along)


def _columns(
    data: xr.Dataset, name: str, rows: Sequence[str], components: list[Any]
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the name and the values of each component of a variable."""
    values = data[name].variable
    missing = {dim: data.sizes[dim] for dim in rows if dim not in values.dims}
    values = values.set_dims({**missing, **values.sizes}).transpose(*rows, *components)
    count = math.prod(data.sizes[dim] for dim in rows)
    table = values.values.reshape(count, -1)
    labels = [_labels(data, dim) for dim in components]
    for k, index in enumerate(np.ndindex(*map(len, labels))):
        parts = [of[i] for of, i in zip(labels, index, strict=True)]
        yield "_".join([name, *parts]), table[:, k].copy()


def _labels(data: xr.Dataset, dim: Any) -> list[str]:
    """Return the names of a vector's components: its labels, or numbers."""
    known = QUATERNION.get(dim, ())
    if dim not in data.coords and len(known) == data.sizes[dim]:
        return [*known]
    return [str(label) for label in data[dim].values]


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table that `to_table` returned as CSV or Parquet.

    The first line of a CSV file is a comment with the columns' units as JSON, the second one has
    their names. `pandas.read_csv(path, comment="#")` reads it. Numbers have the fewest digits that
    give back the same bits; pandas before 3.1 needs `float_precision="round_trip"` for that. In a
    Parquet file, the units are in the attributes, which `pandas.read_parquet` restores.

    Raises
    ------
    ValueError
        The name of the file ends in neither .csv nor .parquet.
    MissingExtra
        Parquet needs pyarrow, which the extra `parquet` installs.
    OSError
        The file cannot be written, or only in part.
    """
    check_table_file(path)
    if path.suffix.lower() == ".parquet":
        table.to_parquet(path, index=False)
        return
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# units: {json.dumps(table.attrs['units'], ensure_ascii=False)}\n")
        table.to_csv(file, index=False, lineterminator="\n")


def check_table_file(path: Path) -> None:
    """Check that a table can be written to a file of this name; raises as `write_table` does."""
    suffix = path.suffix.lower()
    if suffix not in TABLE_FILES:
        raise ArgumentError("path", str(path), "must end in .csv or .parquet")
    if suffix == ".parquet":
        with extra("parquet"):
            import_module("pyarrow")
