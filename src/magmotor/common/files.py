"""Files that are whole or not there, and the processes that write them."""

import glob
import json
import os
import shutil
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from magmotor.common.checks import reject

STREAMS = {Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd")}
"""Folders whose entries are written to as they are, also where they lead to a file."""


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A path to write to, which takes its name only when it is complete and on the disk.

    Parameters
    ----------
    path : Path
        The file; one that is there stays until the new one is whole. Until then it is a hidden one
        beside it; those that killed processes of this machine left are removed. A symbolic link
        stays, and what it leads to is replaced. A device or a pipe gets the whole content at the
        end, copied from a temporary file, in which formats may seek.

    Raises
    ------
    OSError
        It cannot be written; the hidden file is gone.
    """
    if _is_stream(path):
        with TemporaryDirectory() as folder:
            part = Path(folder) / path.name
            yield part
            with part.open("rb") as content, path.open("ab") as stream:
                shutil.copyfileobj(content, stream)
        return
    path = Path(os.path.realpath(path))
    name = f".{path.stem[:40]}."  # a file's name has an end
    for left in path.parent.glob(f"{glob.escape(name)}*@*{glob.escape(path.suffix)}"):
        if is_dead(left.name.removesuffix(path.suffix).rpartition("@")[2]):
            left.unlink(missing_ok=True)
    own = f"{name}{threading.get_native_id()}@{this_driver()}{path.suffix}"
    with _renamed(path.with_name(own), path) as part:
        part.unlink(missing_ok=True)  # it may be a link
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())


def write_whole(path: Path, content: bytes, part: Path) -> None:
    """Write bytes by way of a part, a path on the same file system; errors as of `whole_file`."""
    with _renamed(part, path), part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def this_driver() -> str:
    """The name of this process among all that may write to a directory."""
    return f"{socket.gethostname()}.{os.getpid()}"


def is_dead(driver: str) -> bool:
    """Whether a process, by its name, was of this machine, and is gone."""
    if os.name == "nt":  # where to ask is to interrupt
        return False
    host, _, number = driver.rpartition(".")
    if host != socket.gethostname() or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, OverflowError, ValueError):  # or no number of a process
        return True
    except PermissionError:
        pass  # it is another user's
    return False


def _is_stream(path: Path) -> bool:
    """Whether something is there that is no file and no folder, or that a process has open."""
    return path.exists() and not path.is_dir() and (path.parent in STREAMS or not path.is_file())


@contextmanager
def _renamed(part: Path, path: Path) -> Iterator[Path]:
    try:
        yield part
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def parsed_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The attributes with NumPy's numbers and arrays as Python's own."""
    numpys = np.generic | np.ndarray
    return {k: v.tolist() if isinstance(v, numpys) else v for k, v in attributes.items()}


def fields_in(attributes: Mapping[str, Any], name: str) -> dict[str, Any]:
    """What an attribute tells as a JSON object.

    Raises
    ------
    ValueError
        It is not there, or no JSON object: names it.
    """
    text = attributes.get(name)
    try:
        fields = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict):
        shown = text[:200] if isinstance(text, str) else text
        raise reject(f"attributes[{name!r}]", shown, "must be a JSON object")
    return fields


def check_fields(attribute: str, fields: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Check that what an attribute tells are all the fields there are, and no others.

    Raises
    ------
    ValueError
        Names the attribute and the first field that is missing or unknown.
    """
    for name in {**fields, **known}:
        if name not in fields:
            raise reject(
                f"attributes[{attribute!r}]", fields, f"must be an object with a field {name!r}"
            )
        if name not in known:
            sentence = f"must be one of {', '.join(known)}"
            raise reject(f"a field in attributes[{attribute!r}]", name, sentence)
