"""Files that are whole or not there."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path, part: Path | None = None) -> Iterator[Path]:
    """A path to write to, which takes its name only when it is complete and on the disk.

    Parameters
    ----------
    path : Path
        The file; one that is there stays until the new one is whole.
    part : Path, optional
        The path to write to, on the same file system; by default a hidden one beside the file.

    Raises
    ------
    OSError
        It cannot be written; the part is gone.
    """
    part = part or path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink()
