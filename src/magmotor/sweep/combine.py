"""All results of a sweep as one labeled dataset."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from magmotor.common.arguments import check_flag
from magmotor.common.environment import physical_memory
from magmotor.devices.disk.states import DiskStates
from magmotor.sweep.axes import numeric_fields
from magmotor.sweep.case import Case
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory, open_directory
from magmotor.sweep.measures import TRAJECTORY, measure_of
from magmotor.sweep.sealed import Damaged, naming
from magmotor.sweep.worker import decoded, recorded

SHOWN = 5
"""Damaged files that an error names; `status` names all."""


def combine(directory: str | Path, *, skip_damaged: bool = False) -> xr.Dataset:
    """The results of a sweep, also of one that is not finished, all in memory.

    Parameters
    ----------
    directory : str or Path
        Of the sweep.
    skip_damaged : bool
        Go on without files that do not hold what was written to them.

    Returns
    -------
    xarray.Dataset
        A variable for each measure, or of whole runs for each recorded quantity, over the sweep's
        axes, `seed` and `replica`; NaN where a case failed or is missing. The axis of a field that
        whole runs record, too, is `initial_x` and so on. In the attributes `axes`,
        the names of what varies, and `sweep`, all that tells it, both JSON.

    Raises
    ------
    ValueError
        There is no sweep, files are damaged, which are named, or it is larger than the memory.
    """
    skip_damaged = check_flag("skip_damaged", skip_damaged)
    store = open_directory(directory)
    sweep, damaged = store.sweep, []
    coordinates = _coordinates(sweep)
    read = _trajectories if sweep.measure == (TRAJECTORY,) else _measures
    axes = [_name(sweep, axis.name) for axis in sweep.axes]
    data = read(store, (*axes, "seed"), damaged)
    if damaged and not skip_damaged:
        more = f" and {len(damaged) - SHOWN} more" if len(damaged) > SHOWN else ""
        raise ValueError(
            f"{'; '.join(damaged[:SHOWN])}{more}: run the sweep in {str(directory)!r} again, which"
            " computes these cases again, or leave them out by skip_damaged=True (--skip-damaged)"
        )
    data = data.assign_coords(coordinates)
    data.attrs = {
        "axes": json.dumps(axes),
        "sweep": json.dumps(sweep.as_json()),
    }
    return data


def _empty(shape: tuple[int, ...], columns: int) -> np.ndarray:
    """NaN everywhere; ValueError if as many columns do not fit in this machine's memory."""
    memory = physical_memory()
    if (needed := 8 * columns * math.prod(shape)) > memory:
        gigabytes = f"{needed / 1e9:.3g} GB in memory, where there are {memory / 1e9:.3g} GB"
        raise ValueError(f"the sweep's results take {gigabytes}: read its files one by one")
    return np.full(shape, np.nan)


def _coordinates(sweep: Sweep) -> dict[str, Any]:
    known = numeric_fields(sweep.scene)
    coordinates: dict[str, Any] = {"seed": ("seed", np.array(sweep.seeds), {"units": "1"})}
    for axis in sweep.axes:
        for field, column in axis.columns().items():
            place = _name(sweep, axis.name)
            coordinates[_name(sweep, field)] = (place, column, known[field].attributes)
    return coordinates


def _name(sweep: Sweep, field: str) -> str:
    """Of a field's dimension or coordinate: where runs record a quantity of that name, another."""
    recorded = sweep.measure == (TRAJECTORY,) and field in DiskStates._fields
    return f"initial_{field}" if recorded else field


def _measures(store: Directory, dims: tuple[str, ...], damaged: list[str]) -> xr.Dataset:
    sweep = store.sweep
    each = () if sweep.replicas is None else (sweep.replicas,)
    dims += ("replica",) * len(each)
    names = tuple(sweep.measure)
    columns = {name: _empty((len(sweep), *each), len(names)) for name in names}
    for index, case in enumerate(sweep):
        try:
            row = _numbers(store, case, each)
        except Damaged as damage:
            damaged.append(str(damage))
            continue
        for name, value in row.items():
            columns[name][index] = value
    told = {name: measure_of(sweep.scene, name) for name in sweep.measure}
    shape = (*sweep.shape, *each)
    return xr.Dataset(
        {
            str(name): (
                dims,
                columns[name].reshape(shape),
                {"units": measure.unit, "long_name": measure.label},
            )
            for name, measure in told.items()
        }
    )


def _numbers(store: Directory, case: Case, each: tuple[int, ...]) -> dict[str, Any]:
    """A case's values by measure; none where there is no result."""
    if (found := store.result(case)) is None:
        return {}
    with naming(store.done(case)):
        values = found.get("values")
        if not isinstance(values, dict) or values.keys() != {*store.sweep.measure}:
            raise Damaged("it has other measures")
        return {name: decoded(value, each) for name, value in values.items()}


def _trajectories(store: Directory, dims: tuple[str, ...], damaged: list[str]) -> xr.Dataset:
    sweep, data = store.sweep, xr.Dataset()
    columns: dict[Any, np.ndarray] = {}
    for index, case in enumerate(sweep):
        try:
            if (content := store.result(case)) is None:
                continue
            with naming(store.done(case)):
                run = recorded(content)
                row = {name: values.values for name, values in run.data_vars.items()}
                shapes = {name: values.shape for name, values in row.items()}
                if columns and shapes != {name: c.shape[1:] for name, c in columns.items()}:
                    raise Damaged("it holds other quantities or records than the others")
        except Damaged as damage:
            damaged.append(str(damage))
            continue
        if not columns:
            data = run
            columns = {
                name: _empty((len(sweep), *values.shape), len(row)) for name, values in row.items()
            }
        for name, column in columns.items():
            column[index] = row[name]
    return xr.Dataset(
        {
            name: (
                (*dims, *data[name].dims),
                column.reshape(*sweep.shape, *data[name].shape),
                data[name].attrs,
            )
            for name, column in columns.items()
        },
        {name: data[name] for name in data.coords},
    )
