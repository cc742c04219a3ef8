"""Checkpoints: all that a run needs to go on, in one file that is whole or not there."""

import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.checks import reject


def save(path: Path, task: dict[str, Any], arrays: dict[str, NDArray]) -> None:
    """Write a checkpoint; the file before it stays until the new one is whole.

    Raises
    ------
    OSError
        The file cannot be written; the checkpoint before it is still there.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with part.open("wb") as file:
            everything: dict[str, Any] = {"task": np.array(json.dumps(task)), **arrays}
            np.savez(file, **everything)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def load(path: Path, task: dict[str, Any]) -> dict[str, NDArray] | None:
    """The arrays of a checkpoint of the same task; None if there is no file.

    Raises
    ------
    ValueError
        The file is no checkpoint, or one of another task: names what differs.
    """
    if not path.exists():
        return None
    try:
        with path.open("rb") as file, np.load(file) as saved:
            arrays = {name: saved[name] for name in saved.files}
        told = json.loads(str(arrays.pop("task")))
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise reject("checkpoint", str(path), "a checkpoint of an ensemble, or no file") from None
    for name in {**told, **task}:
        if told.get(name) != task.get(name):
            bound = f"one of {name} = {task.get(name)!r}; it has {told.get(name)!r}"
            raise reject("checkpoint", str(path), bound)
    return arrays
