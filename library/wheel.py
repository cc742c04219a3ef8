"""What the build of a wheel does for the library, with MAGMOTOR_LIBRARY=1 in the environment.

The wheel then contains the library for all kinds of processors of this machine, and needs no Numba.
Otherwise it is pure Python, which Numba compiles, and so it is in an installation from a clone.
"""

import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

LEVELS = {"x86_64": ("x86-64-v3", "x86-64-v4"), "aarch64": ("aarch64",)}
FOLDER = "src/magmotor/numerics/native"
COMPILER = "numba>=0.63"
GLIBC = (2, 17)
"""The oldest C library of the wheel, as in its tag."""


def wanted() -> bool:
    """Whether the wheel shall contain the library."""
    mode = os.environ.get("MAGMOTOR_LIBRARY") or "0"
    if mode not in ("0", "1"):
        raise RuntimeError(f"MAGMOTOR_LIBRARY = {mode!r}: must be 0 or 1, in the environment")
    return mode == "1"


class Dependencies(MetadataHookInterface):
    """Requires Numba, unless the wheel contains what Numba would compile."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the dependencies."""
        listed = self.config["dependencies"]
        metadata["dependencies"] = listed if wanted() else sorted([*listed, COMPILER])


class Library(BuildHookInterface):
    """Builds the library into a wheel."""

    def dependencies(self) -> list[str]:
        """Return what the build of the library imports."""
        needed = self.metadata.core.optional_dependencies["scenes"]
        return [*self.metadata.core.dependencies, *needed, COMPILER] if wanted() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the library, and add its files and the tag of the platform.

        Raises
        ------
        RuntimeError
            There is no library for this machine, or it needs a newer C library than the tag says.
        """
        if not wanted() or version == "editable":
            return
        machine = platform.machine()
        if sys.platform != "linux" or machine not in LEVELS:
            here = f"{sys.platform} on {machine}"
            raise RuntimeError(f"MAGMOTOR_LIBRARY=1: there is no library for {here}")
        command = [sys.executable, "-m", "library.build", *LEVELS[machine]]
        subprocess.run(command, cwd=self.root, check=True)
        for level in LEVELS[machine]:
            file = Path(self.root, FOLDER, f"libmagmotor-{level}.so")
            check_symbols(file)
            build_data["force_include"][str(file)] = f"magmotor/numerics/native/{file.name}"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-manylinux_{GLIBC[0]}_{GLIBC[1]}_{machine}"


def check_symbols(file: Path) -> None:
    """Raise RuntimeError if a library needs a newer C library than the tag of the wheel says."""
    found = re.findall(rb"GLIBC_(\d+)\.(\d+)", file.read_bytes())
    newest = max(tuple(map(int, each)) for each in found)
    if newest > GLIBC:
        raise RuntimeError(f"{file.name} needs glibc {newest}, which is newer than {GLIBC}")
