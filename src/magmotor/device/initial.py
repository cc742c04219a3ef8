"""Parts of an initial state as a user gives them: a mapping, or a run of which the end counts."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_choice, reject

Array = NDArray[np.float64]


def last_record(run: xr.Dataset, names: Sequence[str]) -> dict[str, Array]:
    """These variables of a run at its last time.

    Raises
    ------
    ValueError
        Names those that it does not have.
    """
    missing = [name for name in names if name not in run]
    if missing:
        raise reject(
            "initial", [*run.data_vars], f"must be a dataset that has {', '.join(missing)}, too"
        )
    for name in names:
        if not run[name].sizes.get("time"):
            raise reject(
                f"initial.{name}", run[name].dims, "must be of a run, with a dimension time"
            )
    return {name: run[name].isel(time=-1).values for name in names}


def as_given(initial: Any, known: Iterable[str]) -> dict[str, Any]:
    """The parts that a mapping names, or none.

    Raises
    ------
    ValueError
        It is no mapping, or names a part that is not known.
    """
    if initial is None:
        return {}
    if not isinstance(initial, Mapping):
        raise reject("initial", initial, "must be a mapping or a dataset")
    for name in initial:
        check_choice("initial", name, tuple(known))
    return dict(initial)
