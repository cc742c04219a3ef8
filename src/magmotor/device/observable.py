"""Observables, which carry a unit and a label, and the measures that reduce them to numbers."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import xarray as xr


class Measure(NamedTuple):
    """A number that a sweep records for each run, or for each replica of a run."""

    function: Callable[[xr.Dataset, Any], Any]
    unit: str
    label: str
    observable: "Observable | None" = None
    """The observable that the measure reduces, if there is one."""


class Observable(NamedTuple):
    """A quantity over time that is computed from a run, with its unit and its label."""

    function: Callable[[xr.Dataset, Any], xr.DataArray]
    unit: str
    label: str

    def __call__(self, run: xr.Dataset, scene: Any) -> xr.DataArray:
        """Return the values over time, with the unit and the label in their attributes."""
        return self.function(run, scene).assign_attrs(units=self.unit, long_name=self.label)

    def measure(
        self, label: str, reduction: Callable[[xr.DataArray], Any], unit: str | None = None
    ) -> Measure:
        """Return the measure that reduces the values over time to one number.

        Parameters
        ----------
        label : str
            The measure's label; `{}` stands for the label of the observable.
        reduction : callable
            Maps the values over time to a number, or to one number for each replica.
        unit : str, optional
            The measure's unit if it differs from that of the observable.
        """
        return Measure(
            lambda run, scene: reduction(self(run, scene)),
            self.unit if unit is None else unit,
            label.format(self.label),
            self,
        )


def labeled(data: xr.Dataset, labels: Mapping[str, tuple[str, str]]) -> xr.Dataset:
    """Return a dataset with `units` and `long_name` set on each variable.

    Parameters
    ----------
    data : xarray.Dataset
    labels : mapping
        Unit and label of each variable; names that the dataset lacks are ignored.

    Returns
    -------
    xarray.Dataset
        The other attributes of the variables are kept.
    """
    data = data.copy()
    for name, (unit, label) in labels.items():
        if name in data:
            data[name].attrs |= {"units": unit, "long_name": label}
    return data
