"""Versions: of magmotor, the packages that it computes with, and the machine."""

import platform
import zlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding as llvm

from magmotor.common.environment import models_folder

NEEDED = {
    "mujoco": ("mujoco", "numba", "numpy"),
    "variational": ("numba", "numpy"),
    "scipy": ("numba", "numpy", "scipy"),
}
"""Beside magmotor itself, by engine."""


@cache
def versions_that_matter(method: str) -> dict[str, str]:
    """Versions of what a method computes with, and the kind of machine.

    Of magmotor there is also a checksum of its code.
    """
    own = f"{version('magmotor')}+{package_checksum():08x}"
    engine = method.partition("/")[0]
    return {"magmotor": own} | {name: version(name) for name in NEEDED[engine]} | machine_versions()


def machine_versions() -> dict[str, str]:
    """What of a machine results depend on: its C library, and its kind of processor.

    The kind is the architecture, and whether an x86-64 is of the third level; see `eights`.
    """
    kind, features = platform.machine(), llvm.get_host_cpu_features()
    if features.get("fma") and features.get("avx2"):
        kind += " with FMA"
    return {"libc": " ".join(platform.libc_ver()).strip(), "machine": kind}


@cache
def package_checksum() -> int:
    """Checksum of all of magmotor's code and MJCF parts, the same wherever it is installed."""
    package, models = Path(__file__).parents[1], models_folder()
    code = sorted(package.rglob("*.py"), key=lambda file: file.relative_to(package).parts)
    parts = sorted(models.glob("*.xml"), key=lambda file: file.name)
    return zlib.crc32(b"".join(file.read_bytes() for file in (*code, *parts)))
