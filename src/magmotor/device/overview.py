"""The default overview of a run: its scalar variables over time."""

from pathlib import Path

import xarray as xr

from magmotor.common import style
from magmotor.common.exceptions import ArgumentError
from magmotor.common.measure_panels import label_of, meaning_of

MOST = 12
"""Largest number of replicas that are drawn; more would hide one another."""


def draw_variables(run: xr.Dataset, path: str | Path, dpi: int = style.DPI) -> None:
    """Write a picture with a panel for each scalar variable.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`; at most its first twelve replicas are drawn.
    path : str or Path
        File to write; its suffix sets the format.
    dpi : int
        Dots per inch.

    Raises
    ------
    ValueError
        No variable is a number over time.
    """
    names = [k for k in run.data_vars if {"time"} <= {*run[k].dims} <= {"time", "replica"}]
    if not names:
        raise ArgumentError("run", [*map(str, run.data_vars)], "must have variables over time")
    rows = -(-len(names) // 2)
    with style.figure(11.0, 1.0 + 2.2 * rows) as figure:
        for number, name in enumerate(names, start=1):
            variable = run[name]
            if "replica" in variable.dims:
                variable = variable.isel(replica=slice(MOST)).transpose("time", "replica")
            axes = figure.add_subplot(rows, 2, number)
            axes.plot(run.time, variable, color=style.BLUE, lw=0.8)
            axes.set_ylabel(label_of(meaning_of(variable), variable))
            axes.set_xlabel("t (s)" if run.time.attrs.get("units") == "s" else "t")
        style.save(figure, path, dpi)
