"""Checksums of source code: for the keys of Numba's disk cache, and for what is told of results.

Numba's keys hold a function's own bytecode and closure cells, but not the functions that are
compiled into it from other modules: a checksum of these in a closure cell makes up for that.
Numba locks no index while it adds an entry, so that two processes that do so at once may exchange
their code: functions that differ in closure cells have an index each, by `specialised`, and so has
each processor. Else, of two machines with one home, one may get code that it cannot run.
"""

import inspect
import platform
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite.binding as llvm
from numba.core import config
from numba.core.codegen import get_host_cpu_features

from magmotor.models_folder import models_folder


def code_version(*modules: ModuleType) -> int:
    """Checksum of the source of some modules."""
    return zlib.crc32("".join(inspect.getsource(module) for module in modules).encode())


def target() -> tuple[str, str]:
    """Name and features of the processor that Numba compiles for."""
    settings: Any = config
    name, features = settings.CPU_NAME, settings.CPU_FEATURES
    return name or llvm.get_host_cpu_name(), _host() if features is None else features


_host = cache(get_host_cpu_features)


def machine_versions() -> dict[str, str]:
    """What of a machine results depend on: its C library, and its kind of processor.

    The kind is the architecture, and whether an x86-64 is of the third level; see `eights`.
    """
    kind, features = platform.machine(), llvm.get_host_cpu_features()
    if features.get("fma") and features.get("avx2"):
        kind += " with FMA"
    return {"libc": " ".join(platform.libc_ver()).strip(), "machine": kind}


def specialised(*by: object) -> Callable[[Callable], Callable]:
    """Give what is compiled for these closure cells an index of its own in Numba's disk cache.

    So has each processor that code is compiled for. Numba names the index by the function's
    qualified name. The checksum is not to be among `by`: newer code is to replace older code's
    files.
    """

    def rename(function: Callable) -> Callable:
        function.__qualname__ += f"_{zlib.crc32(repr((by, target())).encode()):08x}"
        return function

    return rename


@cache
def package_checksum() -> int:
    """Checksum of all of magmotor's code and MJCF parts, the same wherever it is installed."""
    package, models = Path(__file__).parent, models_folder()
    code = sorted(package.rglob("*.py"), key=lambda file: file.relative_to(package).parts)
    parts = sorted(models.glob("*.xml"), key=lambda file: file.name)
    return zlib.crc32(b"".join(file.read_bytes() for file in (*code, *parts)))
