"""Any dataset made again, from its attributes and, where one was given, its initial state."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor import sweep
from magmotor.checks import check_kind, reject
from magmotor.dataset import scene_of
from magmotor.ensemble import ensemble
from magmotor.ensemble.plan import plan
from magmotor.noise import path_of
from magmotor.simulation import SimulationDiverged, simulate

RUN = ("method", "timestep", "duration", "record_interval", "seed")

ENSEMBLE = (
    *("method", "timestep", "duration", "replicas", "seed"),
    *("sample_interval", "burn_in", "trajectories"),
)
"""Attributes that are arguments."""

DIMENSIONS = {
    *("time", "replica", "space", "component"),
    *("quantity", "lag", "x_bin", "v_bin", "omega_bin", "flight_duration", "path_replica"),
}


def rerun(run: xr.Dataset) -> xr.Dataset:
    """Run a dataset again; with the same versions and kind of machine it is the same to the bit.

    The attribute `versions` holds those of the packages and of the C library, and the kind of
    machine: all x86-64 processors with AVX2 and FMA are of one kind. On another kind the last
    digits differ, and what is chaotic is another realization of the same law.

    Parameters
    ----------
    run : xarray.Dataset
        Of `simulate` or `ensemble`, also of one that was interrupted or diverged, or the beginning
        of one. It may be in single precision, unless `initial` was given: then it has to hold that.
        Or of `sweep.combine`, which processes of this machine then compute.

    Returns
    -------
    xarray.Dataset
        All of the run or sweep, also if it was interrupted; of a run that diverges what was
        recorded.

    Raises
    ------
    ValueError
        Names what the dataset lacks, or why it is not the whole beginning of one run.
    SimulationInterrupted
        Ctrl-C; holds what was recorded.

    Examples
    --------
    >>> import magmotor as mm
    >>> run = mm.simulate(mm.Disk(), method="variational/baoab", timestep=0.02, duration=10.0)
    >>> mm.rerun(run).identical(run)
    True
    """
    check_kind("run", run, xr.Dataset)
    told = {k: v.item() if isinstance(v, np.generic) else v for k, v in run.attrs.items()}
    if "sweep" in told:
        return _sweep(json.loads(told["sweep"]))
    of_many = "sample_interval" in told
    names = ENSEMBLE if of_many else RUN
    missing = [name for name in ("scene", "scene_fields", *names) if name not in told]
    if missing:
        bound = f"those of a run or an ensemble, and {', '.join(missing)} among them"
        raise reject("attributes", [*told], bound)
    scene = scene_of(run)
    _check_dimensions(run, told)
    arguments = {name: told[name] for name in names}
    arguments["initial"] = _initial(run) if "initial" in told else None
    if not of_many:
        # What was allowed then is allowed now.
        arguments |= {"replicas": told.get("replicas"), "allow_unstable": True}
        arguments["path"] = path_of(told) if "path" in told else None
    again: Callable[..., xr.Dataset] = ensemble if of_many else simulate
    try:
        return again(scene, **arguments)
    except SimulationDiverged as stop:
        return stop.dataset


def _sweep(told: dict[str, Any]) -> xr.Dataset:
    plan = sweep.sweep_from({**told, "versions": None})
    with TemporaryDirectory() as folder:
        sweep.run(plan, Path(folder) / "sweep")
        return sweep.combine(Path(folder) / "sweep")


def _check_dimensions(run: xr.Dataset, told: Mapping[str, Any]) -> None:
    unknown = sorted({*map(str, run.dims)} - DIMENSIONS)
    if unknown or not run.sizes.get("time"):
        raise reject("dimensions", [*run.dims], "those of one run")
    replicas, found = told.get("replicas"), run.sizes.get("replica")
    if replicas != found:
        raise reject("replica", found, f"all {replicas}, as `replicas` in the attributes says")
    times, expected = run.time.values, _times(told)
    whole = len(times) <= len(expected) and np.allclose(times, expected[: len(times)], atol=0)
    if not whole:
        bound = "those of a run's records, all of them from the start on"
        raise reject("time", f"{times[0]:g} to {times[-1]:g}", bound)


def _times(told: Mapping[str, Any]) -> NDArray[np.float64]:
    """When there are records."""
    timestep, duration = told["timestep"], told["duration"]
    if "sample_interval" in told:
        when = plan(timestep, duration, told["sample_interval"], told["burn_in"])
        return timestep * when.interval * when.records
    steps = int(duration / timestep * (1 + 1e-12))
    return timestep * np.arange(0, steps + 1, told["record_interval"])


def _initial(run: xr.Dataset) -> xr.Dataset:
    """The initial state as a dataset of one record: an ensemble's own, or a run's first."""
    first = run.isel(time=[0])
    if "sample_interval" in run.attrs:
        names = [name for name in map(str, run) if name.startswith("initial_")]
        parts = {name.removeprefix("initial_"): run[name] for name in names}
        first = xr.Dataset(parts).expand_dims(time=1)
    for name, values in first.items():
        if values.dtype != np.float64:
            bound = "float64, since the run did not start from the scene's own initial state"
            raise reject(f"{name}.dtype", str(values.dtype), bound)
    return first
