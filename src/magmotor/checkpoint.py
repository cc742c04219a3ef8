"""Checkpoints: all that a run needs to go on, in one file that is whole or not there."""

import json
import time
import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.checks import reject
from magmotor.whole_files import whole_file

SECONDS_BETWEEN = 30.0


class Checkpoint:
    """The checkpoint of a task, written now and then; without a path, nothing is.

    Parameters
    ----------
    path : Path or None
    task : dict
        What the run is to do; a file with another task is refused.
    """

    def __init__(self, path: Path | None, task: dict[str, Any]):
        self.path, self.task = path, task
        self.saved_at = time.monotonic()

    @property
    def due(self) -> bool:
        """Whether the last one was half a minute ago."""
        return self.path is not None and time.monotonic() - self.saved_at > SECONDS_BETWEEN

    def load(self) -> dict[str, NDArray] | None:
        """The arrays saved last; None if there is no file; raises as `load` does."""
        return None if self.path is None else load(self.path, self.task)

    def save(self, arrays: Mapping[str, NDArray]) -> None:
        """Save these arrays.

        Warns
        -----
        UserWarning
            They cannot be written; the checkpoint before them stays.
        """
        if self.path is None:
            return
        self.saved_at = time.monotonic()
        try:
            save(self.path, self.task, arrays)
        except OSError as error:
            warnings.warn(
                f"no checkpoint {self.path}: {error.strerror or error}; the one before it stays",
                stacklevel=4,
            )


def save(path: Path, task: dict[str, Any], arrays: Mapping[str, NDArray]) -> None:
    """Write a checkpoint; the file before it stays until the new one is whole.

    Raises
    ------
    OSError
        The file cannot be written; the checkpoint before it is still there.
    """
    with whole_file(path) as part, part.open("wb") as file:
        everything: dict[str, Any] = {"task": np.array(json.dumps(task)), **arrays}
        np.savez(file, **everything)


def load(path: Path, task: dict[str, Any]) -> dict[str, NDArray] | None:
    """The arrays of a checkpoint of the same task; None if there is no file.

    Raises
    ------
    ValueError
        It cannot be read, is no checkpoint, or one of another task: names what differs.
    """
    try:
        with path.open("rb") as file, np.load(file) as saved:
            arrays = {name: saved[name] for name in saved.files}
        told = json.loads(str(arrays.pop("task")))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise reject("checkpoint", str(path), f"a file ({error.strerror})") from None
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise reject("checkpoint", str(path), "a checkpoint, or no file") from None
    for name in {**told, **task}:
        if told.get(name) != task.get(name):
            bound = f"one of {name} = {task.get(name)!r}; it has {told.get(name)!r}"
            raise reject("checkpoint", str(path), bound)
    return arrays
