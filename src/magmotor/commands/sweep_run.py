"""Running a sweep from the command line: its workers, messages and exit codes."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

import magmotor as mm
from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    UNWRITTEN,
    fail,
    printable,
    refuse_file,
    write_netcdf,
)
from magmotor.sweep import NoWorkers, OtherVersions, Sweep, SweepFailed, SweepInterrupted

SHOWN = 5
"""Number of errors printed at the end of a sweep; `magmotor sweep status` prints all."""


@dataclass
class RunOptions:
    workers: int | None = None
    """number of processes; by default one per core"""
    scheduler: str | None = None
    """address of a Dask scheduler to use instead, for example tcp://127.0.0.1:8786"""
    retry: bool = False
    """run failed cases again"""


def headline(plan: Sweep) -> str:
    step, last = f"h = {plan.timestep:g}", f"T = {plan.duration:g}"
    return f"{len(plan)} case{'s' * (len(plan) > 1)} by {plan.method}, {step}, {last}"


def print_plan(plan: Sweep, folder: Path, workers: int | None) -> None:
    """Print what `run` would do, and how long it would take."""
    print(headline(plan), flush=True)
    for index in range(min(SHOWN, len(plan))):
        print(f"  {plan.label(index)}")
    if len(plan) > SHOWN:
        print(f"  ... and {len(plan) - SHOWN} more")
    cost = mm.sweep.estimate(plan, workers=workers)
    cores = f"{cost.workers} core{'s' * (cost.workers > 1)}"
    probes = f"{cost.probed} case{'s' * (cost.probed > 1)}"
    print(
        f"about {duration(cost.seconds)} on {cores}, {duration(cost.seconds_per_case)} per case"
        f" (measured on this machine by short runs of {probes}), after a few seconds of start-up"
    )
    print(
        f"about {size(cost.size)} in {folder} and {beside(folder, '.nc')}; nothing is written yet"
    )


def duration(seconds: float) -> str:
    """Return a time in the largest unit of which it is at least two."""
    for unit, length in (("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"


def size(count: float) -> str:
    """Return a number of bytes in GB, MB or kB."""
    unit, length = next((u for u in (("GB", 1e9), ("MB", 1e6)) if count >= u[1]), ("kB", 1e3))
    return (
        f"{count / length:.2g} {unit}" if count < 100 * length else f"{count / length:.0f} {unit}"
    )


def run(plan: Sweep, folder: Path, options: RunOptions) -> mm.sweep.Tally:
    """Run the cases of a sweep that have no result yet."""
    refuse_file(folder)
    print(headline(plan), flush=True)
    began = time.perf_counter()
    try:
        with executor(options) as given:
            tally = mm.sweep.run(plan, folder, retry=options.retry, **given)
    except SweepFailed as failure:
        tally = failure.tally
    except SweepInterrupted as stop:
        fail(f"{stop}; the same command resumes it", INTERRUPTED)
    except OSError as error:
        reason = f"cannot write to {error.filename or folder}: {error.strerror or error}"
        fail(f"{reason}; written files are complete, and the same command resumes", UNWRITTEN)
    except (NoWorkers, OtherVersions) as error:
        fail(f"{error}; written files are complete", DIVERGED)
    print(f"{tally}; {tally.computed} computed in {time.perf_counter() - began:.1f} s")
    return tally


@contextmanager
def executor(options: RunOptions) -> Iterator[dict[str, Any]]:
    if options.scheduler is None:
        yield {"workers": options.workers}
        return
    with mm.sweep.dask_workers(options.scheduler) as (executor, workers):
        # Its errors are reported in one line of ours.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        yield {"executor": executor, "workers": workers}


def print_status(folder: Path, most: int | None = None) -> None:
    found = mm.sweep.status(folder)
    print(f"{found.cases} cases: {found.done} done, {found.failed} failed, {found.missing} missing")
    for damage in found.damaged:
        print(f"  {printable(damage)}; running the sweep again repairs it")
    errors = [
        f"  {case}: {printable(error)}" for error, cases in found.errors.items() for case in cases
    ]
    for line in errors[:most]:
        print(line)
    if most is not None and len(errors) > most:
        print(f"  ... and {len(errors) - most} more: magmotor sweep status {folder}")


def combined(folder: Path) -> xr.Dataset:
    """Combine all results into one dataset and write it beside the folder."""
    return write_beside(folder, mm.sweep.combine(folder))


def write_beside(folder: Path, data: xr.Dataset) -> xr.Dataset:
    """Write the dataset of a sweep beside its folder, and return it."""
    path = beside(folder, ".nc")
    write_netcdf(data, path)
    print(f"wrote {path}")
    return data


def beside(folder: Path, suffix: str) -> Path:
    """Return the path of a file beside a sweep's folder, with its name and a suffix."""
    folder = folder.resolve() if folder.name in {"", ".."} else folder
    return folder.with_name(f"{folder.name}{suffix}")
