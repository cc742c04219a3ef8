"""All results of a sweep as one labelled dataset."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from magmotor.interrupts import uninterrupted
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory, open_directory
from magmotor.sweep.fields import numeric_fields
from magmotor.sweep.measures import TRAJECTORY, measure_of
from magmotor.sweep.work import decoded, measured


def combine(directory: str | Path) -> xr.Dataset:
    """The results of a sweep, also of one that is not finished, all in memory.

    Parameters
    ----------
    directory : str or Path
        Of the sweep.

    Returns
    -------
    xarray.Dataset
        A variable for each measure, or of whole runs for each recorded quantity, over the sweep's
        axes, `seed` and `replica`; NaN where a case failed or is missing. In the attributes `axes`,
        the names of what varies, and `sweep`, all that tells it, both JSON.

    Raises
    ------
    ValueError
        There is no sweep.
    """
    store = open_directory(directory)
    sweep = store.sweep
    coordinates = _coordinates(sweep)
    read = _trajectories if sweep.measure == (TRAJECTORY,) else _measures
    data = read(store, (*[axis.name for axis in sweep.axes], "seed")).assign_coords(coordinates)
    data.attrs = {
        "axes": json.dumps([axis.name for axis in sweep.axes]),
        "sweep": json.dumps(sweep.as_json()),
    }
    return data


def _coordinates(sweep: Sweep) -> dict[str, Any]:
    known = numeric_fields(sweep.scene)
    coordinates: dict[str, Any] = {"seed": ("seed", np.array(sweep.seeds), {"units": "1"})}
    for axis in sweep.axes:
        for field, column in axis.columns().items():
            coordinates[field] = (axis.name, column, known[field].attributes)
    return coordinates


def _measures(store: Directory, dims: tuple[str, ...]) -> xr.Dataset:
    sweep = store.sweep
    each = () if sweep.replicas is None else (sweep.replicas,)
    dims += ("replica",) * len(each)
    columns = {name: np.full((len(sweep), *each), np.nan) for name in sweep.measure}
    for index, case in enumerate(sweep):
        if path := store.found(case):
            for name, value in measured(path.read_bytes()).items():
                columns[name][index] = decoded(value)
    told = {name: measure_of(sweep.scene, name) for name in sweep.measure}
    shape = (*sweep.shape, *each)
    return xr.Dataset(
        {
            name: (
                dims,
                columns[name].reshape(shape),
                {"units": measure.unit, "long_name": measure.label},
            )
            for name, measure in told.items()
        }
    )


def _trajectories(store: Directory, dims: tuple[str, ...]) -> xr.Dataset:
    sweep, data = store.sweep, xr.Dataset()
    columns: dict[Any, np.ndarray] = {}
    for index, case in enumerate(sweep):
        path = store.found(case)
        if path is None:
            continue
        with uninterrupted(), xr.open_dataset(path) as run:
            if not columns:
                data = run.load()
                columns = {
                    name: np.full((len(sweep), *values.shape), np.nan)
                    for name, values in data.data_vars.items()
                }
            for name, column in columns.items():
                column[index] = run[name].values
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
