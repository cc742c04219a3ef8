"""Build the library that MuJoCo, Python and C load without a compiler.

For each kind of processor, one process compiles all functions, as Numba does when they are first
used, and links them into an object file. A C compiler adds the rest.

    python -m library.build                      # for this processor
    python -m library.build x86-64-v3 x86-64-v4  # for others of this machine
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from magmotor.numerics.native_library import FOLDER, LEVELS, with_description

HERE = Path(__file__).parent
CPU_NAMES = {"aarch64": "generic"}
"""LLVM's names of those that it names differently."""

LEVEL_NUMBERS = {"x86-64-v3": 3, "x86-64-v4": 4}

FLAGS = (
    "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-Wall", "-Wextra", "-Werror",
    "-Wl,--build-id=none", "-Wl,--no-undefined", "-Wl,-z,noexecstack", "-s",
)  # fmt: skip


def main(arguments: list[str]) -> None:
    """Build the libraries of some kinds of processors, or of the best that this one is."""
    known = LEVELS.get(platform.machine(), ())
    levels = arguments or [level for level in known if runs_here(level)][:1]
    if not levels:
        sys.exit(f"there is no library for this processor ({platform.machine()})")
    for level in levels:
        if level not in known:
            sys.exit(f"unknown kind of processor {level!r}: known here are {', '.join(known)}")
    FOLDER.mkdir(exist_ok=True)
    for level in levels:
        with tempfile.TemporaryDirectory() as folder:
            compile_functions(level, Path(folder))
            path = link(level, Path(folder))
            print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")


def runs_here(level: str) -> bool:
    """Whether the processor has all instructions of a kind."""
    needed = {
        "x86-64-v3": {"avx2", "bmi2", "fma"},
        "x86-64-v4": {"avx512bw", "avx512dq", "avx512vl"},
    }
    found = Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    return needed.get(level, set()) <= {*found}


def compile_functions(level: str, folder: Path) -> None:
    """Compile all functions for a kind of processor into a folder, in two processes."""
    environment = os.environ | {
        "MAGMOTOR_LIBRARY": "0",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "NUMBA_CPU_NAME": CPU_NAMES.get(level, level),
        "NUMBA_CPU_FEATURES": "",
        "PYTHONHASHSEED": "0",
    }
    environment.pop("NUMBA_DISABLE_JIT", None)
    command = [sys.executable, "-m", "library.ahead_of_time", level]
    run_here: Any = {"env": environment, "cwd": HERE.parent}
    with subprocess.Popen(command, **run_here, stdout=subprocess.DEVNULL) as helper:
        try:
            subprocess.run([*command, str(folder)], **run_here, check=True)
        finally:
            helper.kill()


def link(level: str, folder: Path) -> Path:
    """Link the compiled functions in a folder with the C part; return the library."""
    compiler = os.environ.get("CC", "cc")
    result = folder / "library.so"
    sources = [*map(str, sorted(HERE.glob("*.c"))), str(folder / "functions.o")]
    options = [*FLAGS, f"-I{folder}", f"-DLEVEL={LEVEL_NUMBERS.get(level, 0)}", "-o", str(result)]
    subprocess.run([compiler, *options, *sources, "-lm"], check=True)
    description = json.loads((folder / "description.json").read_text(encoding="utf-8"))
    path = FOLDER / f"libmagmotor-{level}.so"
    part = path.with_suffix(".part")
    part.write_bytes(with_description(result.read_bytes(), description))
    part.chmod(0o755)
    part.replace(path)  # a process may have loaded the one before
    return path


if __name__ == "__main__":
    main(sys.argv[1:])
