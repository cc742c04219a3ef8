"""Running a sweep from the command line: who computes, what is said, how it ends."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr
from command_line import DIVERGED, INTERRUPTED, UNWRITTEN, fail, printable, write_netcdf

import magmotor as mm
from magmotor.sweep import NoWorkers, OtherVersions, Sweep, SweepInterrupted

SHOWN = 5
"""Errors that are told at the end of a sweep; `sweep.py status` tells all."""


@dataclass
class RunOptions:
    workers: int | None = None
    """processes; by default one for each core"""
    scheduler: str | None = None
    """address of a Dask scheduler that takes the cases instead, such as tcp://127.0.0.1:8786"""
    retry: bool = False
    """run failed cases again"""


def run(plan: Sweep, folder: Path, options: RunOptions) -> mm.sweep.Tally:
    """Run a sweep; what was done before is not done again."""
    step, last = f"h = {plan.timestep:g}", f"T = {plan.duration:g}"
    print(f"{len(plan)} cases by {plan.method}, {step}, {last}", flush=True)
    began = time.perf_counter()
    try:
        with executor(options) as given:
            tally = mm.sweep.run(plan, folder, retry=options.retry, **given)
    except SweepInterrupted as stop:
        fail(f"{stop}; the same command goes on", INTERRUPTED)
    except OSError as error:
        why = f"cannot write to {folder}: {error.strerror or error}"
        fail(f"{why}; what is written is complete, and the same command goes on", UNWRITTEN)
    except (NoWorkers, OtherVersions) as error:
        fail(f"{error}; what is written is complete", DIVERGED)
    print(f"{tally}; {tally.computed} computed in {time.perf_counter() - began:.1f} s")
    return tally


@contextmanager
def executor(options: RunOptions) -> Iterator[dict[str, Any]]:
    if options.scheduler is None:
        yield {"workers": options.workers}
        return
    with mm.sweep.dask_workers(options.scheduler) as (executor, workers):
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # we say it in one line
        yield {"executor": executor, "workers": workers}


def tell_status(folder: Path, most: int | None = None) -> None:
    found = mm.sweep.status(folder)
    print(f"{found.cases} cases: {found.done} done, {found.failed} failed, {found.missing} missing")
    for damage in found.damaged:
        print(f"  {printable(damage)}; the sweep, run again, mends it")
    told = [
        f"  {case}: {printable(error)}" for error, cases in found.errors.items() for case in cases
    ]
    for line in told[:most]:
        print(line)
    if most is not None and len(told) > most:
        print(f"  ... and {len(told) - most} more: scripts/sweep.py status {folder}")


def combined(folder: Path, skip_damaged: bool = False) -> xr.Dataset:
    """All results as one dataset, also written beside the folder."""
    data = mm.sweep.combine(folder, skip_damaged=skip_damaged)
    path = beside(folder, ".nc")
    write_netcdf(data, path)
    print(f"wrote {path}")
    return data


def beside(folder: Path, suffix: str) -> Path:
    """The file of a sweep that stands beside its folder."""
    return folder.with_name(f"{folder.name}{suffix}")
