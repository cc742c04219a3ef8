"""Driver of the tests' sweep, also a program to kill: DIRECTORY, and options as JSON."""

import json
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import numpy as np

import magmotor as mm
from magmotor.sweep import Sweep
from magmotor.sweep.directory import Directory
from magmotor.sweep.process_pool import ONE_THREAD

SWEEP = Sweep(
    scene=mm.Disk(),
    vary={"noise": np.linspace(1, 4, 12)},
    seeds=2,
    measure=["sweep_measures:waited", "temperature"],
    method="variational/baoab",
    timestep=0.05,
    duration=5.0,
)

FEW = 4
"""Number of results, of 24, after which a test intervenes."""


def contents(directory):
    """Return the contents of all files in a sweep's directory by name."""
    files = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_bytes() for path in files}


def environment():
    """Return the environment variables that limit this process's threads."""
    return {name: os.environ.get(name) for name in ONE_THREAD}


def drive(directory, workers=2, threads=None, scheduler=None):
    """Run the sweep by processes, threads, or a cluster; return the tally."""
    if threads:
        with ThreadPoolExecutor(threads) as executor:
            return mm.sweep.run(SWEEP, directory, workers=threads, executor=executor)
    found = mm.sweep.dask_workers(scheduler) if scheduler else nullcontext((None, workers))
    with found as (executor, count):
        return mm.sweep.run(SWEEP, directory, workers=count, executor=executor)


def hold(until):
    """Make the driver wait after `FEW` results until a file exists."""
    keep, kept = Directory.keep, []

    def held(self, case, outcome):
        keep(self, case, outcome)
        kept.append(case)
        while len(kept) >= FEW and not Path(until).exists():
            time.sleep(0.01)

    Directory.keep = held


if __name__ == "__main__":
    options = json.loads(sys.argv[2])
    if until := options.pop("until", None):
        hold(until)
    try:
        tally = drive(sys.argv[1], **options)
    except OSError as error:
        raise SystemExit(f"OSError: {error.strerror}") from None
    print(tally.done, tally.computed)
