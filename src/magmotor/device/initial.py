"""Initial states as users give them: a mapping of parts, or a run that is to continue."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from magmotor.common.arrays import Array
from magmotor.common.checks import check_array, check_choice
from magmotor.common.exceptions import ArgumentError


def initial_parts(
    initial: Mapping[str, Any] | xr.Dataset | None, names: Sequence[str]
) -> dict[str, Any]:
    """Return the given parts of an initial state by name; the caller checks their values.

    Parameters
    ----------
    initial : mapping, xarray.Dataset or None
        Some of the parts, or a run whose last record has all of them, or nothing.
    names : sequence of str
        The parts of a state.

    Raises
    ------
    ValueError
        `initial` is of another type, names an unknown part, or is a run that lacks a part.
    """
    if initial is None:
        return {}
    if isinstance(initial, xr.Dataset):
        return _last_record(initial, names)
    if not isinstance(initial, Mapping):
        raise ArgumentError("initial", initial, "must be a mapping or a dataset")
    for name in initial:
        check_choice("initial", name, tuple(names))
    return dict(initial)


def initial_row(name: str, value: Any, replicas: int) -> Array:
    """Return a part that is one number per replica as a row, shape (1, replicas).

    Parameters
    ----------
    name : str
        The part's name.
    value : array_like
        One finite number for all replicas, or one for each.
    replicas : int

    Raises
    ------
    ValueError
        The value is anything else; the message names the part, its value and the bound.
    """
    label = f"initial[{name!r}]"
    row = check_array(label, value)
    if row.shape not in {(), (replicas,)}:
        raise ArgumentError(label, value, f"must be a finite number or {replicas} of them")
    return np.broadcast_to(row, (1, replicas)).copy()


def _last_record(run: xr.Dataset, names: Sequence[str]) -> dict[str, Any]:
    missing = [name for name in names if name not in run]
    if missing:
        raise ArgumentError(
            "initial", [*run.data_vars], f"the dataset must also have {', '.join(missing)}"
        )
    for name in names:
        if not run[name].sizes.get("time"):
            raise ArgumentError(
                f"initial.{name}", run[name].dims, "must have a dimension time, as in a run"
            )
    return {name: run[name].isel(time=-1).values for name in names}
