"""Versions of magmotor, of the packages that it computes with, and of the machine."""

import platform
import zlib
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from numpy._core._multiarray_umath import (  # pyright: ignore[reportMissingModuleSource]
    __cpu_features__ as cpu_features,  # NumPy has no public name for what its kernels ask
)

from magmotor.common.environment import data_folder

PACKAGES = {
    "mujoco": ("mujoco", "numba", "numpy"),
    "variational": ("numba", "numpy"),
    "scipy": ("numba", "numpy", "scipy"),
}
"""Packages that affect results, by engine."""


@cache
def versions_that_matter(method: str) -> dict[str, str]:
    """Return the versions of all software that affects a method's results, and of the machine.

    The version of magmotor includes a checksum of its code.
    """
    own = f"{version('magmotor')}+{package_checksum():08x}"
    engine = method.partition("/")[0]
    return {"magmotor": own} | versions_of(*PACKAGES[engine]) | machine_versions()


def versions_of(*names: str) -> dict[str, str]:
    """Return the versions of those packages that are installed, as Numba need not be."""
    found = {}
    for name in names:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def machine_versions() -> dict[str, str]:
    """Return the properties of the machine that affect results: C library and processor type.

    The type is the architecture and, for x86-64, whether the processor has AVX2 and FMA; see
    `magmotor.numerics.simd`.
    """
    kind = platform.machine()
    if cpu_features.get("FMA3") and cpu_features.get("AVX2"):
        kind += " with FMA"
    return {"libc": " ".join(platform.libc_ver()).strip(), "machine": kind}


@cache
def package_checksum() -> int:
    """Return a checksum of magmotor's code and MJCF parts, which does not depend on the path."""
    package, models = Path(__file__).parents[1], data_folder("models")
    code = sorted(
        (file for file in package.rglob("*.py") if package / "examples" not in file.parents),
        key=lambda file: file.relative_to(package).parts,
    )
    parts = sorted(models.glob("*.xml"), key=lambda file: file.name)
    return zlib.crc32(b"".join(file.read_bytes() for file in (*code, *parts)))
