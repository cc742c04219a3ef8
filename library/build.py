"""Build the library of compiled functions, if it is missing or its sources have changed.

    python -m library.build                      # for this processor
    python -m library.build x86-64-v3 x86-64-v4  # for others of this machine

Two processes compile all functions, as Numba does when they are first used. One of them links them
into an object file, to which a C compiler adds the rest.
"""

import hashlib
import inspect
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from library import tables
from magmotor.numerics.dependencies import checksum_of
from magmotor.numerics.native_library import (
    FOLDER,
    LEVELS,
    UnfitLibraryError,
    described,
    with_description,
)

HERE = Path(__file__).parent
CPU_NAMES = {"aarch64": "generic"}
"""LLVM's names of kinds of processors that it names differently."""

NEEDED = {
    "x86-64-v3": {"avx2", "bmi2", "fma"},
    "x86-64-v4": {"avx512bw", "avx512dq", "avx512vl"},
}
"""Flags in /proc/cpuinfo that processors of a kind have, besides those of lower ones."""

LEVEL_NUMBERS = {"x86-64-v3": 3, "x86-64-v4": 4}

FLAGS = (
    "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-Wall", "-Wextra", "-Werror",
    "-Wl,--build-id=none", "-Wl,--no-undefined", "-Wl,-z,noexecstack", "-Wl,-z,nodelete", "-s",
)  # fmt: skip


def main(arguments: list[str]) -> None:
    """Build the libraries of some kinds of processors, or of the best that this one is."""
    known = LEVELS.get(platform.machine(), ()) if sys.platform == "linux" else ()
    levels = arguments or [level for level in known if runs_here(level)][:1]
    compiler = os.environ.get("CC", "cc")
    if not levels or shutil.which(compiler) is None:
        lacking = f"a C compiler ({compiler})" if levels else "a processor of a kind that it knows"
        print(f"no library, which needs {lacking}: Numba compiles what is used", file=sys.stderr)
        return
    for level in levels:
        if level not in known:
            sys.exit(f"unknown kind of processor {level!r}: known here are {', '.join(known)}")
        path = FOLDER / f"libmagmotor-{level}.so"
        if is_current(path):
            print(f"{path.name} is up to date")
            continue
        with tempfile.TemporaryDirectory() as folder:
            compile_functions(level, Path(folder))
            link(level, Path(folder), path, compiler)
        print(f"{path.name} ({path.stat().st_size / 1e3:.0f} kB)")


def runs_here(level: str) -> bool:
    """Whether the processor has all instructions of a kind."""
    found = Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    return NEEDED.get(level, set()) <= {*found}


def is_current(path: Path) -> bool:
    """Whether a library has been built from the present sources, by the present compiler."""
    try:
        description = described(path)
    except UnfitLibraryError:
        return False
    if description.get("made_from") != made_from():
        return False
    functions = description["functions"].items()
    return all(checksum_of(definition(name)) == one["checksum"] for name, one in functions)


def definition(name: str) -> Any:
    """Return what defines a function of a library."""
    module, _, function = name.partition("(")[0].rpartition(".")
    return inspect.unwrap(getattr(import_module(module), function))


def made_from() -> str:
    """Return a text that changes with the files in this folder, sentences, and the compiler."""
    files = sorted(path for path in HERE.iterdir() if path.suffix in (".py", ".c", ".h", ".json"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in files))
    digest.update(tables.sentences().encode())
    return f"numba {version('numba')}, llvmlite {version('llvmlite')}, {digest.hexdigest()}"


def compile_functions(level: str, folder: Path) -> None:
    """Compile all functions for a kind of processor into a folder."""
    environment = os.environ | {
        "MAGMOTOR_LIBRARY": "0",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "NUMBA_CPU_NAME": CPU_NAMES.get(level, level),
        "NUMBA_CPU_FEATURES": "",
        "PYTHONHASHSEED": "0",
    }
    environment.pop("NUMBA_DISABLE_JIT", None)
    command = [sys.executable, "-m", "library.ahead_of_time", level, str(folder)]
    subprocess.run(command, env=environment, cwd=HERE.parent, check=True)


def link(level: str, folder: Path, path: Path, compiler: str) -> None:
    """Link the compiled functions in a folder with the C part."""
    result = folder / "library.so"
    sources = [*map(str, sorted(HERE.glob("*.c"))), str(folder / "functions.o")]
    options = [*FLAGS, f"-I{folder}", f"-DLEVEL={LEVEL_NUMBERS.get(level, 0)}", "-o", str(result)]
    subprocess.run([compiler, *options, *sources, "-lm", "-ldl"], check=True)
    description = json.loads((folder / "description.json").read_text(encoding="utf-8"))
    description["made_from"] = made_from()
    path.parent.mkdir(exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}")
    part.write_bytes(with_description(result.read_bytes(), description))
    part.chmod(0o755)
    part.replace(path)  # a process may have loaded the one before


if __name__ == "__main__":
    main(sys.argv[1:])
