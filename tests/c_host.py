"""A program without Python, which loads the library as a plugin of MuJoCo, and Python beside it.

The environment variable MUJOCO_AARCH64 names a folder with MuJoCo's library for aarch64. Then the
program and the library are those for aarch64, and QEMU emulates that processor.
"""

import os
import shutil
import subprocess
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hosted_models import state_after

import magmotor as mm
from magmotor.numerics import native_library
from magmotor_plugin.library import library as mujoco_library

ROOT = Path(__file__).parents[1]
TOP, LEVITATION = (ROOT / "models" / f"{name}.xml" for name in ("top_magnetic", "levitation"))
FOREIGN = os.environ.get("MUJOCO_AARCH64", "")
CC = shutil.which("aarch64-linux-gnu-gcc" if FOREIGN else os.environ.get("CC", "cc")) or ""
EMULATOR = ["qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu"] if FOREIGN else []
MUJOCO = next(Path(FOREIGN).glob("libmujoco.so*")) if FOREIGN else Path(mujoco_library()._name)
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
def program(*options: str) -> Path:
    """Return the program, compiled once, or what a compiler with other options makes of it."""
    path = Path(_folder.name) / f"c_host{len(options)}"
    source = Path(__file__).with_name("c_host.c")
    options += "-O1", "-Wall", "-Wextra", "-Werror", f"-I{MUJOCO.parent / 'include'}"
    libraries = str(MUJOCO), f"-Wl,-rpath,{MUJOCO.parent}", "-lpthread", "-ldl"
    subprocess.run([CC, *options, source, *libraries, "-o", path], check=True)
    return path


def library_path() -> Path:
    """Return the file of the library."""
    level = "aarch64" if FOREIGN else LIBRARY.description["level"]
    return native_library.FOLDER / f"libmagmotor-{level}.so"


def run(
    task: str,
    count: int,
    models: list[Path],
    *,
    by: tuple[Any, ...] = (),
    library: Any = None,
    **environment: str,
) -> Any:
    """Let the program, or a command that runs it, do a task of `c_host.c` with models."""
    command = [*EMULATOR, *(by or [program()]), library or library_path(), task, str(count)]
    outside = {k: v for k, v in os.environ.items() if k != native_library.SWITCH}
    outside["MAGMOTOR_RESPONSES"] = responses_of(models)
    options: Any = {"cwd": _folder.name, "capture_output": True, "text": True, "check": True}
    return subprocess.run([*command, *models], env=outside | environment, **options)


def responses_of(models: list[Path]) -> str:
    """The path of a file with the responses of the iron of models that are valid."""
    path = Path(_folder.name) / "responses"
    for model in models:
        if b"iron" in model.read_bytes():
            with suppress(ValueError, mujoco.FatalError):
                mm.save_responses(mujoco.MjModel.from_xml_path(str(model)), path)
    return str(path) if path.exists() else ""


def written(folder, texts):
    paths = [folder / f"{k}.xml" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return paths


def agree(found, expected):
    """Whether two states have the same bits; on aarch64, MuJoCo rounds other products.

    Differences were at most 2.2e-12, in a field with a gradient.
    """
    if not FOREIGN:
        return [*found] == [*expected]
    return bool(np.allclose(found, expected, rtol=0, atol=3e-11))


def numbers(line):
    return [float.fromhex(word) for word in line.split()]


def error_of(path):
    """The first error that Python raises for a model."""
    try:
        state_after(mujoco.MjModel.from_xml_path(str(path)), 1)
    except (ValueError, mujoco.FatalError) as error:
        return str(error)
    return "no error"
