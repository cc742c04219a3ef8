"""`rerun`: reproduce a dataset from its attributes and stored initial state."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor import sweep
from magmotor.common.checks import check_integer, check_number, check_type
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.files import parsed_attributes
from magmotor.common.integrity import parsed
from magmotor.device.device import Scene
from magmotor.device.provenance import scene_of
from magmotor.device.stops import SimulationStopped
from magmotor.noise import LARGEST_STEP, path_of
from magmotor.run.ensemble import NOT_KEPT, ensemble
from magmotor.run.simulate import simulate
from magmotor.sweep.definition import checked_names

RUN = ("method", "timestep", "duration", "record_interval", "seed")

ENSEMBLE = (
    *("method", "timestep", "duration", "replicas", "seed"),
    *("sample_interval", "burn_in", "trajectories"),
)
"""Attributes that are arguments of `ensemble`; `RUN` are those of `simulate`."""

DIMENSIONS = {"time", "replica", "space", "component", "quantity"}
"""Dimensions of runs and general ensembles; a device adds those of its own ensembles."""


def rerun(run: xr.Dataset, *, measures: Iterable[str] = ()) -> xr.Dataset:
    """Run a dataset again; with the same versions and machine type, the result is identical.

    The attribute `versions` holds the versions of the packages and of the C library, and the
    machine type: all x86-64 processors with AVX2 and FMA are of one type. On another type, and with
    `scipy/dop853` on another processor, the last digits differ, and chaotic motion becomes another
    realization of the same law.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` or `ensemble`, including one that was interrupted or diverged, or the
        beginning of one. It may be in single precision, unless `initial` was given, whose values it
        then must hold exactly. Or from `sweep.combine`; local processes then run the sweep again.
    measures : iterable of str
        For a sweep, those of its measures `package.module:function` that may be imported and
        called. Datasets are not trusted: no other function is imported.

    Returns
    -------
    xarray.Dataset
        The whole run or sweep, even if the original was interrupted; for a run that diverges, the
        records so far.

    Raises
    ------
    ValueError
        The dataset lacks something, is not the complete beginning of one run, or has a measure that
        is not allowed.
    SimulationInterrupted
        Ctrl-C; holds the records so far.

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
        raise ArgumentError("measures", measures, "must be empty: this dataset is not a sweep")
    is_ensemble = "sample_interval" in attributes
    names = ENSEMBLE if is_ensemble else RUN
    missing = [name for name in ("scene", "scene_fields", *names) if name not in attributes]
    if missing:
        sentence = f"must be those of a run or an ensemble; {', '.join(missing)} are missing"
        raise ArgumentError("attributes", [*attributes], sentence)
    check_type("method", attributes["method"], str)
    scene = scene_of(run)
    _check_dimensions(run, attributes, scene)
    arguments = {name: attributes[name] for name in names}
    if attributes.get("initial") == NOT_KEPT:
        raise ArgumentError(
            "initial", NOT_KEPT, "this ensemble cannot be rerun without its initial state"
        )
    arguments["initial"] = _initial(run) if "initial" in attributes else None
    if not is_ensemble:
        # The original run was allowed.
        arguments |= {"replicas": attributes.get("replicas"), "allow_unstable": True}
        arguments["path"] = path_of(attributes) if "path" in attributes else None
    run_again: Callable[..., xr.Dataset] = ensemble if is_ensemble else simulate
    try:
        return run_again(scene, **arguments)
    except SimulationStopped as stop:
        return stop.dataset


def _sweep(text: Any, measures: Iterable[str]) -> xr.Dataset:
    try:
        attributes = parsed(text)
    except (TypeError, ValueError) as error:
        raise InputError(f"the dataset's attribute sweep must be JSON ({error})") from None
    if isinstance(attributes, dict):
        attributes = {**attributes, "versions": None}
    definition = sweep.sweep_from(attributes, measures=measures)
    with TemporaryDirectory() as folder:
        sweep.run(definition, Path(folder) / "sweep")
        return sweep.combine(Path(folder) / "sweep")


def _check_dimensions(run: xr.Dataset, attributes: Mapping[str, Any], scene: Scene) -> None:
    unknown = {*map(str, run.dims)} - DIMENSIONS - scene.device.ensemble_dimensions
    if unknown or "time" not in run.dims:
        raise ArgumentError("dimensions", [*run.dims], "must be those of one run")
    check_integer("number of records in run", run.sizes["time"], at_least=1)
    replicas, found = attributes.get("replicas"), run.sizes.get("replica")
    if type(replicas) is not type(found) or replicas != found:
        raise ArgumentError(
            "replica", found, f"must be {replicas}, the number `replicas` in the attributes"
        )
    times = run.time.values
    if times.dtype.kind not in "iuf" or times.ndim != 1:
        raise ArgumentError(
            "time.dtype", str(times.dtype), "must be numeric, with one time per record"
        )
    expected = _times(attributes, scene, len(times))
    if len(times) > len(expected) or not np.allclose(times, expected, atol=0):
        sentence = "must be the times of a run's records, complete from the start"
        raise ArgumentError("time", f"{times[0]:g} to {times[-1]:g}", sentence)


def _times(attributes: Mapping[str, Any], scene: Scene, most: int) -> NDArray[np.floating]:
    """Return the expected record times, at most `most`: as the device's ensembles, or evenly."""
    timestep = check_number("timestep", attributes["timestep"], above=0)
    duration = check_number("duration", attributes["duration"], at_least=timestep)
    name = "sample_interval" if "sample_interval" in attributes else "record_interval"
    interval = check_integer(name, attributes[name], at_least=1)
    if interval >= LARGEST_STEP:
        raise ArgumentError(name, interval, "must be less than 2^53")
    if name == "sample_interval":
        burn_in = check_number("burn_in", attributes["burn_in"], at_least=0)
        own = scene.device.ensemble_times(scene, timestep, duration, interval, burn_in)
        if own is not None:
            return own[:most]
    records = duration / timestep * (1 + 1e-12) // interval
    return timestep * interval * np.arange(min(most, 1 + records))


def _initial(run: xr.Dataset) -> xr.Dataset:
    """Return the initial state as a dataset with one record."""
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
            raise ArgumentError(f"{name}.dtype", str(values.dtype), sentence)
    return first
