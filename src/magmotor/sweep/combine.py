"""All results of a sweep as one labeled dataset."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from magmotor.common.arguments import check_flag
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import InputError
from magmotor.common.integrity import Damaged, naming_damage
from magmotor.sweep.axes import numeric_fields
from magmotor.sweep.case import Case
from magmotor.sweep.compute import decoded, recorded
from magmotor.sweep.definition import Sweep
from magmotor.sweep.directory import Directory, open_directory
from magmotor.sweep.measures import TRAJECTORY, measure_of

SHOWN = 5
"""Number of damaged files named in an error; `status` lists all."""


def combine(directory: str | Path, *, skip_damaged: bool = False) -> xr.Dataset:
    """Load the results of a sweep, finished or not, into memory.

    Parameters
    ----------
    directory : str or Path
        The directory of the sweep.
    skip_damaged : bool
        Ignore damaged files instead of raising.

    Returns
    -------
    xarray.Dataset
        One variable per measure, or per recorded quantity of whole runs, over the sweep's axes,
        `seed` and `replica`; NaN where a case failed or is missing. The axis of a field that whole
        runs also record is named `initial_x` etc. Attributes, both JSON: `axes`, the names of the
        axes, and `sweep`, its specification.

    Raises
    ------
    ValueError
        The directory holds no sweep, files are damaged (the message names them), or the results do
        not fit in memory.
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
        raise InputError(
            f"{'; '.join(damaged[:SHOWN])}{more}: run the sweep in {str(directory)!r} again to"
            " recompute these cases, or leave them out by skip_damaged=True (--skip-damaged)"
        )
    data = data.assign_coords(coordinates)
    data.attrs = {
        "axes": json.dumps(axes),
        "sweep": json.dumps(sweep.as_json()),
    }
    return data


def _empty(shape: tuple[int, ...], columns: int) -> np.ndarray:
    """Return an array of NaN; ValueError if that many of them do not fit in memory."""
    memory = physical_memory()
    if (needed := 8 * columns * math.prod(shape)) > memory:
        gigabytes = f"{needed / 1e9:.3g} GB of memory; this machine has {memory / 1e9:.3g} GB"
        raise InputError(f"the sweep's results need {gigabytes}. Read its files one by one")
    return np.full(shape, np.nan)


def _coordinates(sweep: Sweep) -> dict[str, Any]:
    fields = numeric_fields(sweep.scene)
    coordinates: dict[str, Any] = {"seed": ("seed", np.array(sweep.seeds), {"units": "1"})}
    for axis in sweep.axes:
        for field, column in axis.columns().items():
            dimension = _name(sweep, axis.name)
            coordinates[_name(sweep, field)] = (dimension, column, fields[field].attributes)
    return coordinates


def _name(sweep: Sweep, field: str) -> str:
    """Return the name of a field's coordinate, which differs from those of recorded variables."""
    if sweep.measure != (TRAJECTORY,):
        return field
    device = sweep.scene.device
    state = device.initial_state(sweep.scene, None, None)
    variables = device.columns(sweep.scene, state, None)
    return f"initial_{field}" if field in variables else field


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
    measures = {name: measure_of(sweep.scene, name) for name in sweep.measure}
    shape = (*sweep.shape, *each)
    return xr.Dataset(
        {
            str(name): (
                dims,
                columns[name].reshape(shape),
                {"units": measure.unit, "long_name": measure.label},
            )
            for name, measure in measures.items()
        }
    )


def _numbers(store: Directory, case: Case, each: tuple[int, ...]) -> dict[str, Any]:
    """Return a case's values by measure; empty without a result."""
    if (found := store.result(case)) is None:
        return {}
    with naming_damage(store.done(case)):
        values = found.get("values")
        if not isinstance(values, dict) or values.keys() != {*store.sweep.measure}:
            raise Damaged("its measures differ from the sweep's")
        return {name: decoded(value, each) for name, value in values.items()}


def _trajectories(store: Directory, dims: tuple[str, ...], damaged: list[str]) -> xr.Dataset:
    sweep, data = store.sweep, xr.Dataset()
    columns: dict[Any, np.ndarray] = {}
    for index, case in enumerate(sweep):
        try:
            if (content := store.result(case)) is None:
                continue
            with naming_damage(store.done(case)):
                run = recorded(content)
                row = {name: values.values for name, values in run.data_vars.items()}
                shapes = {name: values.shape for name, values in row.items()}
                if columns and shapes != {name: c.shape[1:] for name, c in columns.items()}:
                    raise Damaged("its quantities or records differ from the other files'")
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
