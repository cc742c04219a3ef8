"""A driver of the tests' sweep, also as a program to be killed: DIRECTORY, options as JSON."""

import json
import os
import sys
from contextlib import nullcontext

import numpy as np

import magmotor as mm
from magmotor.sweep import Sweep
from magmotor.sweep.workers import ONE_THREAD

SWEEP = Sweep(
    scene=mm.Disk(),
    vary={"noise": np.linspace(1, 4, 12)},
    seeds=2,
    measure=["sweep_measures:waited", "temperature"],
    method="variational/baoab",
    timestep=0.05,
    duration=5.0,
)


def contents(directory):
    """All files in a sweep's directory, by name."""
    files = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_bytes() for path in files}


def environment():
    """How many threads this process is told to take."""
    return {name: os.environ.get(name) for name in ONE_THREAD}


def drive(directory, workers=2, scheduler=None):
    """Run the sweep; return the tally."""
    found = mm.sweep.dask_workers(scheduler) if scheduler else nullcontext((None, workers))
    with found as (executor, count):
        return mm.sweep.run(SWEEP, directory, workers=count, executor=executor)


if __name__ == "__main__":
    try:
        tally = drive(sys.argv[1], **json.loads(sys.argv[2]))
    except OSError as error:
        raise SystemExit(f"OSError: {error.strerror}") from None
    print(tally.done, tally.computed)
