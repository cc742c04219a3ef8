"""Agreement of two ensembles of the same scene within their statistical errors."""

from collections.abc import Iterator

import numpy as np
import xarray as xr


def scores(first: xr.Dataset, second: xr.Dataset) -> Iterator[xr.DataArray]:
    """Yield the differences of all means and mean squares, in standard errors, by quantity."""
    for name in ("mean", "mean_square"):
        error = np.hypot(first[f"{name}_error"], second[f"{name}_error"])
        yield abs(first[name] - second[name]) / error
