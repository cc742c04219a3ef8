"""Build the libraries of compiled functions that are missing, or whose sources have changed.

    python -m library.build            # for this processor
    python -m library.build x86-64-v3  # for others, which library/targets.py lists

Two processes compile all functions, as Numba does when they are first used. One of them links them
into a module, of which machine code is made for each library. A C compiler adds the rest.
"""

import hashlib
import inspect
import json
import os
import subprocess
import sys
import tempfile
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from library import tables, targets
from library.targets import TARGETS
from magmotor.numerics.dependencies import checksum_of
from magmotor.numerics.native_library import (
    FOLDER,
    UnfitLibraryError,
    described,
    with_description,
)

HERE = Path(__file__).parent


def main(names: list[str]) -> None:
    """Build some libraries, by default the best one for this processor, if that is possible."""
    here = targets.here()
    known = TARGETS if "x86-64-v3" in here else here
    if unknown := [name for name in names if name not in known]:
        sys.exit(f"unknown library {unknown[0]!r}: {', '.join(known)} can be built here")
    wanted = names or [name for name in here if targets.runs_here(name)][:1]
    old = [name for name in wanted if not is_current(name)]
    for name in wanted:
        if name not in old:
            print(f"{path_of(name)} is up to date")
    try:
        if not wanted:
            raise FileNotFoundError("There is no library for this processor or system.")
        compilers = [targets.compiler(name) for name in old]
    except FileNotFoundError as error:
        if names:
            sys.exit(str(error))
        print(f"{error} Numba compiles functions when they are first used.", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as folder:
        for name, compiler in zip(old, compilers, strict=True):
            link(name, compiled(targets.optimized_for(name), Path(folder)), compiler)
            print(f"{path_of(name)} ({path_of(name).stat().st_size / 1e3:.0f} kB)")


def path_of(name: str) -> Path:
    """Return the file of a library."""
    return FOLDER / TARGETS[name].file


def is_current(name: str) -> bool:
    """Whether a library has been built from the present sources, by the present compiler."""
    try:
        description = described(path_of(name), TARGETS[name].machine)
        if description.get("made_from") != made_from():
            return False
        functions = description["functions"].items()
        return all(checksum_of(definition(each)) == one["checksum"] for each, one in functions)
    except (UnfitLibraryError, ImportError, AttributeError):  # or a function is not there any more
        return False


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


def compiled(processor: str, folder: Path) -> Path:
    """Compile all functions, optimized for a processor, into a folder in this one, once."""
    inner = folder / processor
    if inner.exists():
        return inner
    inner.mkdir()
    environment = os.environ | {
        "MAGMOTOR_LIBRARY": "0",
        "NUMBA_CACHE_DIR": str(inner / "cache"),
        "NUMBA_CPU_NAME": processor,
        "NUMBA_CPU_FEATURES": "",
        "PYTHONHASHSEED": "0",
    }
    environment.pop("NUMBA_DISABLE_JIT", None)
    command = [sys.executable, "-m", "library.ahead_of_time", str(inner)]
    subprocess.run(command, env=environment, cwd=HERE.parent, check=True)
    return inner


def link(name: str, folder: Path, compiler: tuple[str, ...]) -> None:
    """Link the compiled functions in a folder with the C part."""
    target, path = TARGETS[name], path_of(name)
    result, code = folder / target.file, folder / f"{name}.o"
    targets.emit((folder / "functions.ll").read_text(encoding="utf-8"), name, code)
    sources = [*map(str, sorted(HERE.glob("*.c"))), str(code)]
    options = [*target.flags, f"-I{folder}", f"-DLEVEL={target.level}", "-o", str(result)]
    subprocess.run([*compiler, *sources, *options], check=True)
    description = json.loads((folder / "description.json").read_text(encoding="utf-8"))
    description |= {"made_from": made_from(), "level": name, "machine": target.machine}
    path.parent.mkdir(exist_ok=True)
    part, content = path.with_suffix(f".{os.getpid()}"), result.read_bytes()
    if path.suffix != ".dylib":  # whose signature is at its end
        content = with_description(content, description)
    part.write_bytes(content)
    part.chmod(0o755)
    part.replace(path)  # a process may have loaded the one before


if __name__ == "__main__":
    main(sys.argv[1:])
