"""Units and labels of the variables of a dataset."""

from collections.abc import Mapping

import xarray as xr


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
