"""Files that are whole or not there."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A path to write to, which takes its name only when it is complete and on the disk.

    Parameters
    ----------
    path : Path
        The file; one that is there stays until the new one is whole. Until then it is a hidden one
        beside it.

    Raises
    ------
    OSError
        It cannot be written; the hidden file is gone.
    """
    with _renamed(path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}"), path) as part:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())


def write_whole(path: Path, content: bytes, part: Path) -> None:
    """Write bytes by way of a part, a path on the same file system; errors as of `whole_file`."""
    with _renamed(part, path), part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def _renamed(part: Path, path: Path) -> Iterator[Path]:
    try:
        yield part
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise
