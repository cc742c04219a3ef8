"""A program without Python, which loads the library as a plugin of MuJoCo, and Python beside it."""

import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import pytest
from hosted_models import state_after

from magmotor.numerics import native_library
from magmotor_plugin.library import library as mujoco_library

ROOT = Path(__file__).parents[1]
TOP, LEVITATION = (ROOT / "models" / f"{name}.xml" for name in ("top_magnetic", "levitation"))
CC = shutil.which(os.environ.get("CC", "cc")) or ""
LIBRARY: Any = native_library.library()
NEEDED = [
    pytest.mark.skipif(LIBRARY is None, reason="there is no library: python -m library.build"),
    pytest.mark.skipif(not CC, reason="there is no C compiler"),
]
"""Marks of tests that run the program."""

END = "\n\f\n"
"""What the program prints after an error."""

_folder = tempfile.TemporaryDirectory()


@cache
def program() -> Path:
    """Return the program, compiled once."""
    path, library = Path(_folder.name) / "c_host", Path(mujoco_library()._name)
    source = Path(__file__).with_name("c_host.c")
    options = "-O1", "-Wall", "-Wextra", "-Werror", f"-I{library.parent / 'include'}"
    libraries = str(library), f"-Wl,-rpath,{library.parent}", "-lpthread", "-ldl"
    subprocess.run([CC, *options, source, *libraries, "-o", path], check=True)
    return path


def library_path() -> Path:
    """Return the file of the library."""
    return native_library.FOLDER / f"libmagmotor-{LIBRARY.description['level']}.so"


def run(task: str, count: int, models: list[Path], **environment: str) -> Any:
    """Let the program do a task of `c_host.c` with models."""
    command = [program(), library_path(), task, str(count), *models]
    outside = {k: v for k, v in os.environ.items() if k != native_library.SWITCH}
    return subprocess.run(
        command, env=outside | environment, cwd=_folder.name, capture_output=True, text=True,
        check=True,
    )  # fmt: skip


def written(folder, texts):
    paths = [folder / f"{k}.xml" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return paths


def numbers(line):
    return [float.fromhex(word) for word in line.split()]


def error_of(path):
    """The first error that Python raises for a model."""
    try:
        state_after(mujoco.MjModel.from_xml_path(str(path)), 1)
    except (ValueError, mujoco.FatalError) as error:
        return str(error)
    return "no error"
