"""Computation of a case in a worker process: the run, its measures, and the bytes to store."""

import errno
import io
import threading
import time
import warnings
from contextlib import redirect_stderr
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.exceptions import ArgumentError, InputError, MagmotorError
from magmotor.common.integrity import Damaged, bytes_with_checksum, with_checksum
from magmotor.common.interrupts import uninterrupted
from magmotor.common.versions import versions_that_matter
from magmotor.device.provenance import scene_from
from magmotor.device.stops import SimulationStopped
from magmotor.numerics.compilation_notice import COMPILATION
from magmotor.run.simulate import simulate
from magmotor.sweep.case import Case
from magmotor.sweep.measures import TRAJECTORY, is_own, measure_of

ARGUMENTS = ("method", "timestep", "duration", "record_interval", "replicas", "seed")

ONE_CASE = threading.Lock()
"""Held while a process runs a case, since it redirects warnings and standard error globally."""


OF_THE_MACHINE = {errno.ENOSPC, errno.EDQUOT, errno.EMFILE, errno.ENFILE, errno.ENOMEM}
"""Errors that say nothing about a case, which can succeed once the machine has room again."""


class Outcome(NamedTuple):
    """The outcome of a case: a file's content, or an error and the records so far."""

    content: bytes | None
    error: str | None
    seconds: float
    """Wall time without compilation."""


class OtherVersions(MagmotorError, RuntimeError):
    """A worker has other versions than the driver."""


def compute(case: Case, measure: tuple[str, ...]) -> Outcome:
    """Run a case; an error in it becomes its outcome.

    Raises
    ------
    OtherVersions
        This process has other versions than the case requires.
    OSError
        The machine has no room, for example on a disk.
    """
    own = versions_that_matter(case.spec["method"])
    if own != case.spec["versions"]:
        raise OtherVersions(f"a worker has {own}, but the sweep has {case.spec['versions']}")
    began, compiled = time.perf_counter(), COMPILATION.seconds
    content = error = None
    try:
        content = _content(case, measure)
    except SimulationStopped as stop:
        error = str(stop)
        content = None
        if measure == (TRAJECTORY,):
            content = bytes_with_checksum(netcdf(stop.dataset), case.key)
    except (Exception, SystemExit) as exception:
        if isinstance(exception, OSError) and exception.errno in OF_THE_MACHINE:
            raise
        error = _reason(exception)
    compiled = COMPILATION.seconds - compiled
    return Outcome(content, error, time.perf_counter() - began - compiled)


def _reason(error: BaseException) -> str:
    """Return the text of an error, even if its own `__str__` fails."""
    kind = type(error).__name__
    try:
        return str(error) if isinstance(error, ValueError) else f"{kind}: {error}"
    except Exception:
        return kind


def _content(case: Case, measure: tuple[str, ...]) -> bytes:
    # Progress bars and recommendations of single cases would clutter the terminal.
    quiet, recorded = redirect_stderr(io.StringIO()), warnings.catch_warnings(record=True)
    with ONE_CASE, quiet, recorded as caught:
        warnings.simplefilter("always")
        scene = scene_from(case.spec["scene"], case.spec["scene_fields"])
        run = simulate(scene, **{name: case.spec[name] for name in ARGUMENTS})
        if measure == (TRAJECTORY,):
            return bytes_with_checksum(netcdf(run), case.key)
        each = tuple(run.sizes[dim] for dim in run.dims if dim == "replica")
        found = {}
        for name in measure:  # one of the user's may change its run
            its_run = run.copy(deep=is_own(name))
            found[name] = measure_of(scene, name).function(its_run, scene)
        values = {name: encoded(value, each) for name, value in found.items()}
    messages = sorted({str(warning.message) for warning in caught})
    return with_checksum({"case": case.spec, "values": values, "warnings": messages})


FORMAT: Any = "NETCDF3_64BIT_DATA"  # missing from xarray's type hints
CLASSIC = b"CDF\x05"
"""First bytes of a file in netCDF's classic format, which contains all of its data.

A netCDF-4 file may refer to data in any other file that its reader can access.
"""

COUNTED = ("step", "replica")
"""Integer coordinates, which xarray can write to the classic format only as doubles."""


def netcdf(run: xr.Dataset) -> bytes:
    """Return a dataset as the bytes of a file in netCDF's classic format."""
    import netCDF4
    from xarray.backends import NetCDF4DataStore

    run = run.assign_coords({name: run[name].astype(float) for name in COUNTED if name in run})
    attributes, run.attrs = run.attrs, {}
    file = netCDF4.Dataset("run.nc", "w", format=FORMAT, memory=run.nbytes)
    run.dump_to_store(NetCDF4DataStore(file))
    file.setncatts(attributes)  # xarray would cut seeds down to 32 bits
    return bytes(file.close())


def recorded(content: bytes) -> xr.Dataset:
    """Return the dataset that was passed to `netcdf`, in memory; Damaged if there is none."""
    import netCDF4
    from xarray.backends import NetCDF4DataStore

    if not content.startswith(CLASSIC):
        raise Damaged("it is not a run in netCDF's classic format")
    try:
        with uninterrupted(), netCDF4.Dataset("run.nc", memory=content) as file:
            run = xr.open_dataset(NetCDF4DataStore(file))
            if run.nbytes > len(content):
                raise InputError("it declares more data than it contains")
            run.load()
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Damaged(f"it is not a run in netCDF ({error})") from None
    if any(values.dtype != np.float64 for values in run.values()):
        raise Damaged("its values are not all numbers")
    counted = [name for name in COUNTED if name in run]
    if not all(run[name].dtype.kind == "f" and np.isfinite(run[name]).all() for name in counted):
        raise Damaged(f"its {' or '.join(counted)} is not finite")
    return run.assign_coords({name: run[name].astype(int) for name in counted})


def encoded(values: ArrayLike, each: tuple[int, ...]) -> Any:
    """Return a number, or one per replica, as JSON, with null for NaN.

    Parameters
    ----------
    values : array_like
        Shape () or `each`.
    each : tuple of int
        (replicas,) for a run with replicas, else ().

    Raises
    ------
    ValueError
        It has another shape or is not a number.
    """
    if np.ma.isMaskedArray(values):
        values = np.ma.filled(np.ma.array(values, dtype=float), np.nan)
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ArgumentError("value of a measure", values, "must be a number, or one per replica")
    if array.shape not in ((), each):
        sentence = (
            "must be () or (replicas,)"
            if each
            else "must be (): a run without replicas has one value"
        )
        raise ArgumentError("shape of a measure", array.shape, sentence)
    if array.ndim:
        return [encoded(value, ()) for value in array]
    number = float(array)
    return number if np.isfinite(number) else None if np.isnan(number) else str(number)


def decoded(content: Any, each: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the values that were passed to `encoded`; Damaged if that is impossible."""
    try:
        found = np.array(content, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise Damaged("a value is not a number") from None
    if found.shape not in ((), each):
        raise Damaged(f"values have shape {found.shape}, not {each}")
    return found
