"""Files that are written atomically, the processes that write them, and dataset attributes."""

import glob
import json
import os
import shutil
import socket
import stat
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from magmotor.common.exceptions import ArgumentError

STREAMS = {Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd")}
"""Folders whose entries are written to directly, even if they are links to a file."""


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Write a file atomically: yield a temporary path that is renamed once it is complete.

    Parameters
    ----------
    path : Path
        The file. An existing one stays until the new one is complete and on the disk. Until then
        the content is in a hidden file next to it; hidden files that killed processes of this
        machine left behind are removed. A symbolic link stays, and its target is replaced. A device
        or a pipe receives the whole content at the end, from a temporary file that allows seeking.

    Raises
    ------
    OSError
        The file cannot be written. The hidden file has been removed.
    """
    if _is_stream(path):
        with TemporaryDirectory() as folder:
            part = Path(folder) / path.name
            yield part
            with part.open("rb") as content, path.open("ab") as stream:
                shutil.copyfileobj(content, stream)
        return
    path = Path(os.path.realpath(path))
    name = f".{path.stem[:40]}."  # the length of file names is limited
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
    """Write bytes atomically by way of `part`, a path on the same file system.

    Raises the errors of `whole_file`.
    """
    with _renamed(part, path), part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def this_driver() -> str:
    """Return a name of this process that is unique among those that may write to a directory."""
    return f"{socket.gethostname()}.{os.getpid()}"


def is_dead(driver: str) -> bool:
    """Whether `driver` names a process of this machine that no longer runs."""
    if os.name == "nt":  # where os.kill(..., 0) interrupts the process
        return False
    host, _, number = driver.rpartition(".")
    if host != socket.gethostname() or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, OverflowError, ValueError):  # or not a valid process number
        return True
    except PermissionError:
        pass  # it belongs to another user
    return False


def _is_stream(path: Path) -> bool:
    """Whether a path is a device, a pipe, or an open file of a process."""
    return path.exists() and not path.is_dir() and (path.parent in STREAMS or not path.is_file())


@contextmanager
def _renamed(part: Path, path: Path) -> Iterator[Path]:
    try:
        yield part
        part.replace(path)
    except BaseException as error:
        with suppress(OSError):
            part.unlink()
        if isinstance(error, OSError) and error.filename == str(part):
            raise OSError(error.errno, error.strerror, str(path)) from None  # the name asked for
        raise


def parsed_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes with NumPy scalars and arrays converted to Python numbers and lists."""
    numpys = np.generic | np.ndarray
    return {k: v.tolist() if isinstance(v, numpys) else v for k, v in attributes.items()}


def fields_in(attributes: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Parse an attribute that holds a JSON object.

    Raises
    ------
    ValueError
        The attribute is missing or is not a JSON object. The message names it.
    """
    text = attributes.get(name)
    try:
        fields = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict):
        shown = text[:200] if isinstance(text, str) else text
        raise ArgumentError(f"attributes[{name!r}]", shown, "must be a JSON object")
    return fields


def check_fields(attribute: str, fields: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Check that an attribute has exactly the known fields.

    Raises
    ------
    ValueError
        A field is missing or unknown. The message names the attribute and the first such field.
    """
    for name in {**fields, **known}:
        if name not in fields:
            raise ArgumentError(
                f"attributes[{attribute!r}]", fields, f"must be an object with the field {name!r}"
            )
        if name not in known:
            sentence = f"must be one of {', '.join(known)}"
            raise ArgumentError(f"a field in attributes[{attribute!r}]", name, sentence)


def is_private(path: str, like: str | None = None) -> bool:
    """Whether nobody but this user and the system's can change what a path leads to.

    With `like`, those who can change what that leads to may, too, but not everybody.
    """
    trusted: set[Writer] = {0, os.getuid(), os.stat("/").st_uid}  # noqa: PTH116
    if like is not None:
        trusted |= _writers(like) - {"everybody"}
    return _writers(path) <= trusted


Writer = int | str
"""Who can change a file: the number of a user, "group" and its number, or "everybody"."""


def _writers(path: str, sticky: int = 0) -> set[Writer]:
    """Return who can change what a path leads to.

    With `sticky`, who can only add entries to it, but not replace those that it has, is left out.
    """
    path = os.path.abspath(path)  # noqa: PTH100
    parent = os.path.dirname(path)  # noqa: PTH120
    found = os.lstat(path)
    writers: set[Writer] = {found.st_uid}
    if stat.S_ISLNK(found.st_mode):
        target = os.path.join(os.path.realpath(parent), os.readlink(path))  # noqa: PTH115, PTH118
        writers |= _writers(target, sticky)
    elif not found.st_mode & sticky:
        if found.st_mode & stat.S_IWGRP and not _has_alone(found.st_uid, found.st_gid):
            writers.add(f"group {found.st_gid}")
        if found.st_mode & stat.S_IWOTH:
            writers.add("everybody")
    return writers if parent == path else writers | _writers(parent, stat.S_ISVTX)


def _has_alone(user: int, group: int) -> bool:
    """Whether a group is a user's own, which has the user's name, as most Linux systems make it."""
    import grp
    import pwd

    try:
        name, found = pwd.getpwuid(user).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == name and not {*found.gr_mem} - {name}
