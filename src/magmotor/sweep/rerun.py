"""Any dataset made again, from its attributes and, where one was given, its initial state."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor import sweep
from magmotor.common.checks import check_integer, check_number, check_type, reject
from magmotor.common.files import parsed_attributes
from magmotor.device.provenance import scene_of
from magmotor.device.stops import SimulationStopped
from magmotor.devices.disk.ensemble.result import plan
from magmotor.noise import LARGEST_STEP, path_of
from magmotor.run.ensemble import ensemble
from magmotor.run.simulate import simulate
from magmotor.sweep.definition import checked_names
from magmotor.sweep.sealed import parsed

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


def rerun(run: xr.Dataset, *, measures: Iterable[str] = ()) -> xr.Dataset:
    """Run a dataset again; with the same versions and kind of machine it is the same to the bit.

    The attribute `versions` holds those of the packages and of the C library, and the kind of
    machine: all x86-64 processors with AVX2 and FMA are of one kind. On another kind, and with
    `scipy/dop853` on another processor, the last digits differ, and what is chaotic is another
    realization of the same law.

    Parameters
    ----------
    run : xarray.Dataset
        Of `simulate` or `ensemble`, also of one that was interrupted or diverged, or the beginning
        of one. It may be in single precision, unless `initial` was given: then it has to hold that.
        Or of `sweep.combine`, which processes of this machine then compute.
    measures : iterable of str
        Of a sweep, those of its measures `package.module:function` that may be imported and called.
        A dataset may be anybody's: nothing is imported because it says so.

    Returns
    -------
    xarray.Dataset
        All of the run or sweep, also if it was interrupted; of a run that diverges what was
        recorded.

    Raises
    ------
    ValueError
        Names what the dataset lacks, why it is not the whole beginning of one run, or a measure
        that is not allowed.
    SimulationInterrupted
        Ctrl-C; holds what was recorded.

    Examples
    --------
    >>> import magmotor as mm
    >>> run = mm.simulate(mm.Disk(), method="variational/baoab", timestep=0.02, duration=10.0)
    >>> mm.rerun(run).identical(run)
    True
    """
    check_type("run", run, xr.Dataset)
    attributes = parsed_attributes(run.attrs)
    if "sweep" in attributes:
        return _sweep(attributes["sweep"], measures)
    if checked_names("measures", measures):
        raise reject("measures", measures, "must be of a sweep, which this dataset is not")
    of_many = "sample_interval" in attributes
    names = ENSEMBLE if of_many else RUN
    missing = [name for name in ("scene", "scene_fields", *names) if name not in attributes]
    if missing:
        sentence = f"must be those of a run or an ensemble, and {', '.join(missing)} among them"
        raise reject("attributes", [*attributes], sentence)
    check_type("method", attributes["method"], str)
    scene = scene_of(run)
    planned = of_many and scene.device.ensemble(scene) is not None
    _check_dimensions(run, attributes, planned)
    arguments = {name: attributes[name] for name in names}
    arguments["initial"] = _initial(run) if "initial" in attributes else None
    if not of_many:
        # What was allowed then is allowed now.
        arguments |= {"replicas": attributes.get("replicas"), "allow_unstable": True}
        arguments["path"] = path_of(attributes) if "path" in attributes else None
    again: Callable[..., xr.Dataset] = ensemble if of_many else simulate
    try:
        return again(scene, **arguments)
    except SimulationStopped as stop:
        return stop.dataset


def _sweep(text: Any, measures: Iterable[str]) -> xr.Dataset:
    try:
        attributes = parsed(text)
    except (TypeError, ValueError) as error:
        raise ValueError(f"sweep in the dataset's attributes: must be JSON ({error})") from None
    if isinstance(attributes, dict):
        attributes = {**attributes, "versions": None}
    plan = sweep.sweep_from(attributes, measures=measures)
    with TemporaryDirectory() as folder:
        sweep.run(plan, Path(folder) / "sweep")
        return sweep.combine(Path(folder) / "sweep")


def _check_dimensions(run: xr.Dataset, attributes: Mapping[str, Any], planned: bool) -> None:
    unknown = sorted({*map(str, run.dims)} - DIMENSIONS)
    if unknown or not run.sizes.get("time"):
        raise reject("dimensions", [*run.dims], "must be those of one run")
    replicas, found = attributes.get("replicas"), run.sizes.get("replica")
    if type(replicas) is not type(found) or replicas != found:
        raise reject(
            "replica", found, f"must be all {replicas}, as `replicas` in the attributes says"
        )
    times = run.time.values
    if times.dtype.kind not in "iuf" or times.ndim != 1:
        raise reject("time.dtype", str(times.dtype), "must be numbers, one for each record")
    expected = _times(attributes, planned, len(times))
    if len(times) > len(expected) or not np.allclose(times, expected, atol=0):
        sentence = "must be those of a run's records, all of them from the start on"
        raise reject("time", f"{times[0]:g} to {times[-1]:g}", sentence)


def _times(attributes: Mapping[str, Any], planned: bool, most: int) -> NDArray[np.floating]:
    """When there are records, so many at the most: as ensembles plan them, or evenly."""
    timestep = check_number("timestep", attributes["timestep"], above=0)
    duration = check_number("duration", attributes["duration"], at_least=timestep)
    if planned:
        when = plan(timestep, duration, attributes["sample_interval"], attributes["burn_in"])
        return timestep * when.interval * when.records[:most]
    name = "sample_interval" if "sample_interval" in attributes else "record_interval"
    interval = check_integer(name, attributes[name], at_least=1)
    if interval >= LARGEST_STEP:
        raise reject(name, interval, "must be less than 2^53")
    records = duration / timestep * (1 + 1e-12) // interval
    return timestep * interval * np.arange(min(most, 1 + records))


def _initial(run: xr.Dataset) -> xr.Dataset:
    """The initial state as a dataset of one record: an ensemble's own, or a run's first."""
    first = run.isel(time=[0])
    if "sample_interval" in run.attrs:
        names = [name for name in map(str, run) if name.startswith("initial_")]
        parts = {name.removeprefix("initial_"): run[name] for name in names}
        first = xr.Dataset(parts).expand_dims(time=1)
    for name, values in first.items():
        if values.dtype != np.float64:
            sentence = (
                "must be float64, since the run did not start from the scene's own initial state"
            )
            raise reject(f"{name}.dtype", str(values.dtype), sentence)
    return first
