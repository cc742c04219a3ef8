"""Run a dataset again from its own attributes, and check whether the result is identical.

Values that the file holds in single precision are compared in single precision; of a run that ended
early, only its records are compared, and of a sweep only the cases in the file. Exit code 0 means
identical, 1 different; the differences are printed.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
import xarray as xr

import magmotor as mm
from magmotor.commands.output import MISTAKE, fail, read_netcdf, warn_in_one_line, write_netcdf
from magmotor.commands.parsing import parse_options

DIFFERENT = 1


@dataclass
class Options:
    file: tyro.conf.Positional[Path]
    """dataset of a run, an ensemble or a sweep (NetCDF)"""
    out: Path | None = None
    """file to write the new dataset to"""
    allow_measure: Annotated[list[str], tyro.conf.UseAppendAction] = field(default_factory=list)
    """MODULE:FUNCTION, a measure of a sweep that may be imported and called (repeatable); files are
    not trusted to choose which code runs"""


def main() -> None:
    warn_in_one_line()
    options = parse_options(Options, __doc__)
    kept = read_netcdf(options.file)
    try:
        again = mm.rerun(kept, measures=options.allow_measure)
    except (ValueError, mm.sweep.NoWorkers, mm.sweep.SweepFailed) as error:
        fail(f"{options.file}: {error}", MISTAKE)
    if options.out:
        write_netcdf(again, options.out)
    compared = comparable(kept, again)
    if not any(values.notnull().any() for values in compared.data_vars.values()):
        fail(f"{options.file}: it has no values to compare", MISTAKE)
    found = [*differences(compared, again)]
    if found:
        print(f"different: {'; '.join([*found, *other_versions(kept, again)])}")
        raise SystemExit(DIFFERENT)
    unit, records = "records", compared.sizes.get("time")
    if "sweep" in kept.attrs:
        unit = "cases"
        records = max(int(values.notnull().sum()) for values in compared.data_vars.values())
    print(f"identical: {len(compared.data_vars)} variables, {records} {unit}")


def comparable(kept: xr.Dataset, again: xr.Dataset) -> xr.Dataset:
    """Select what can be compared: for an ensemble that ended early, only its records over time."""
    if str(kept.attrs.get("time_reached")) == str(again.attrs.get("time_reached")):
        return kept
    return kept[[name for name in kept.variables if "time" in kept[name].dims]]


def differences(kept: xr.Dataset, again: xr.Dataset) -> Iterator[str]:
    """Describe what differs, by how much, and from which time."""
    if "sweep" in kept.attrs:
        again = again.where(kept.notnull())
    elif again.sizes["time"] < kept.sizes["time"]:
        yield f"it ends at t = {again.time[-1]:g}, not {kept.time[-1]:g}"
    times = range(min(kept.sizes.get("time", 0), again.sizes.get("time", 0)))
    kept, again = (run.isel(time=times, missing_dims="ignore") for run in (kept, again))
    for name, values in kept.variables.items():
        new = again.variables.get(name)
        if new is None or new.sizes != values.sizes:
            yield f"{name} ({'missing' if new is None else 'of another shape'})"
        elif new.dtype.kind == "f" != values.dtype.kind:
            yield f"{name} (not in floating point)"
        else:
            yield from difference(str(name), values, new.astype(values.dtype), kept)


def difference(name: str, old: xr.Variable, new: xr.Variable, kept: xr.Dataset) -> Iterator[str]:
    different = (old != new) & (old.notnull() | new.notnull())
    if not different.any():
        return
    extent = ""
    if old.dtype.kind in "iuf":
        apart = abs(old - new).values[different.values]
        finite = apart[np.isfinite(apart)]
        extent += f" by at most {finite.max():.2g}" if finite.size else ""
        extent += " (NaN or infinite in one of them)" if finite.size < apart.size else ""
    if "time" in old.dims:
        rows = different.any([dim for dim in old.dims if dim != "time"]).values
        extent += f" from t = {kept.time[rows.argmax()]:g} on"
    yield name + extent


def other_versions(kept: xr.Dataset, again: xr.Dataset) -> Iterator[str]:
    then, now = (versions(run) for run in (kept, again))
    for name in now:
        if then.get(name) != now[name]:
            yield f"{name} was {then.get(name)}, is {now[name]}"


def versions(run: xr.Dataset) -> dict[str, Any]:
    """Return the versions in a dataset's attributes; empty if these are malformed."""
    name = "sweep" if "sweep" in run.attrs else "versions"
    try:
        attribute = json.loads(run.attrs.get(name, "{}"))
        return dict(attribute["versions"] if name == "sweep" else attribute)
    except (TypeError, ValueError, KeyError, RecursionError):
        return {}
