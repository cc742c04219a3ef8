"""The work of a case, in a worker process: the run, its measures, and the bytes to be kept."""

import io
import tempfile
import threading
import time
import warnings
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import reject
from magmotor.common.interrupts import uninterrupted
from magmotor.common.versions import versions_that_matter
from magmotor.device.provenance import scene_from
from magmotor.device.stops import SimulationStopped
from magmotor.run.simulate import simulate
from magmotor.sweep.case import Case
from magmotor.sweep.measures import TRAJECTORY, measure_of
from magmotor.sweep.sealed import Damaged, sealed, sealed_bytes

ARGUMENTS = ("method", "timestep", "duration", "record_interval", "replicas", "seed")

ALONE = threading.Lock()
"""Held by the one case that a process runs: warnings and standard error are the process's."""


class Outcome(NamedTuple):
    """What came of a case: a file's content, or an error and what was recorded until then."""

    content: bytes | None
    error: str | None
    seconds: float


class OtherVersions(RuntimeError):
    """A worker computes with other versions than the driver."""


def compute(case: Case, measure: tuple[str, ...]) -> Outcome:
    """Run a case; whatever goes wrong in it is its outcome.

    Raises
    ------
    OtherVersions
        This process has other versions than the case asks for.
    """
    own = versions_that_matter(case.spec["method"])
    if own != case.spec["versions"]:
        raise OtherVersions(f"a worker has {own}, where the sweep has {case.spec['versions']}")
    began = time.perf_counter()
    content = error = None
    try:
        content = _content(case, measure)
    except SimulationStopped as stop:
        error = str(stop)
        content = None
        if measure == (TRAJECTORY,):
            content = sealed_bytes(netcdf(stop.dataset), case.key)
    except (Exception, SystemExit) as mistake:
        error = _told(mistake)
    return Outcome(content, error, time.perf_counter() - began)


def _told(mistake: BaseException) -> str:
    """An error in words, whatever it does when it is asked for them."""
    kind = type(mistake).__name__
    try:
        return str(mistake) if isinstance(mistake, ValueError) else f"{kind}: {mistake}"
    except Exception:
        return kind


def _content(case: Case, measure: tuple[str, ...]) -> bytes:
    # Progress bars and recommendations of single cases are not for the sweep's terminal.
    quiet, recorded = redirect_stderr(io.StringIO()), warnings.catch_warnings(record=True)
    with ALONE, quiet, recorded as caught:
        warnings.simplefilter("always")
        scene = scene_from(case.spec["scene"], case.spec["scene_fields"])
        run = simulate(scene, **{name: case.spec[name] for name in ARGUMENTS})
        if measure == (TRAJECTORY,):
            return sealed_bytes(netcdf(run), case.key)
        each = tuple(run.sizes[dim] for dim in run.dims if dim == "replica")
        found = {name: measure_of(scene, name).function(run, scene) for name in measure}
        values = {name: encoded(value, each) for name, value in found.items()}
    said = sorted({str(warning.message) for warning in caught})
    return sealed({"case": case.spec, "values": values, "warnings": said})


FORMAT: Any = "NETCDF3_64BIT_DATA"  # which xarray's own hints lack
CLASSIC = b"CDF\x05"
"""How a file of the classic format of netCDF begins, whose data are inside it.

A file of netCDF-4 may have them in any other file that the reader can read.
"""

COUNTED = ("step", "replica")
"""Coordinates that are integers, which xarray writes to the classic format as doubles only."""


def netcdf(run: xr.Dataset) -> bytes:
    """A dataset as a file of netCDF, in its classic format."""
    import netCDF4

    run = run.assign_coords({name: run[name].astype(float) for name in COUNTED if name in run})
    attributes, run.attrs = run.attrs, {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        run.to_netcdf(path, engine="netcdf4", format=FORMAT)
        with netCDF4.Dataset(path, "a") as file:  # xarray would cut seeds down to 32 bits
            file.setncatts(attributes)
        return path.read_bytes()


def recorded(content: bytes) -> xr.Dataset:
    """The dataset that `netcdf` was given, all in memory; Damaged if it cannot have been."""
    import netCDF4
    from xarray.backends import NetCDF4DataStore

    if not content.startswith(CLASSIC):
        raise Damaged("it is no run in netCDF's classic format")
    try:
        with uninterrupted(), netCDF4.Dataset("run.nc", memory=content) as file:
            run = xr.open_dataset(NetCDF4DataStore(file))
            if run.nbytes > len(content):
                raise ValueError("it tells of more than it can hold")
            run.load()
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Damaged(f"it is no run in netCDF ({error})") from None
    if any(values.dtype != np.float64 for values in run.values()):
        raise Damaged("it holds other than numbers")
    counted = [name for name in COUNTED if name in run]
    if not all(run[name].dtype.kind == "f" and np.isfinite(run[name]).all() for name in counted):
        raise Damaged(f"its {' or '.join(counted)} is not finite")
    return run.assign_coords({name: run[name].astype(int) for name in counted})


def encoded(values: ArrayLike, each: tuple[int, ...]) -> Any:
    """A number, or one of each replica, as JSON: null where it is not a number.

    Parameters
    ----------
    values : array_like
        Of shape () or `each`.
    each : tuple of int
        (replicas,) of a run with replicas, else ().

    Raises
    ------
    ValueError
        It has another shape: a measure is a number.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise reject("value of a measure", values, "must be a number, or one of each replica")
    if array.shape not in ((), each):
        sentence = (
            "must be () or (replicas,)"
            if each
            else "must be (): a run without replicas has one number"
        )
        raise reject("shape of a measure", array.shape, sentence)
    if array.ndim:
        return [encoded(value, ()) for value in array]
    number = float(array)
    return number if np.isfinite(number) else None if np.isnan(number) else str(number)


def decoded(content: Any, each: tuple[int, ...]) -> NDArray[np.float64]:
    """What `encoded` was given; Damaged if it cannot have been."""
    try:
        found = np.array(content, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise Damaged("a value is no number") from None
    if found.shape not in ((), each):
        raise Damaged(f"values have shape {found.shape}, not {each}")
    return found
