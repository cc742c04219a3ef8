"""MuJoCo's C library, without importing `mujoco`."""

import ctypes
from functools import cache
from importlib.util import find_spec
from pathlib import Path


@cache
def library() -> ctypes.CDLL:
    """Return MuJoCo's C library.

    Raises
    ------
    ImportError
        MuJoCo is not installed, or its library is missing.
    """
    for folder in _folders():
        for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
            found = [str(path) for path in Path(folder).glob(pattern)]
            if len(found) > 1:  # a downgrade from MuJoCo 4 leaves its library behind
                from importlib.metadata import version

                found = [path for path in found if version("mujoco") in path]
            if found:
                return ctypes.CDLL(found[0])
    raise ImportError("there is no MuJoCo library: pip install mujoco")


def loads_entry_points() -> bool:
    """Whether the installed MuJoCo is 4 or newer, by its header: importlib.metadata is slow."""
    for folder in _folders():
        header = Path(folder) / "include" / "mujoco" / "mujoco.h"
        if header.exists():
            version = header.read_text(encoding="utf-8").partition("mjVERSION_HEADER")[2].split()
            return bool(version) and int(version[0]) >= 4_000_000
    return False


def _folders() -> list[str]:
    """Return the folders of the package mujoco, without importing it."""
    spec = find_spec("mujoco")
    return [*(spec.submodule_search_locations or [])] if spec else []
