"""Checksums of source code: for the keys of Numba's disk cache, and for what is told of results.

Numba's keys hold a function's own bytecode and closure cells, but not the functions that are
compiled into it from other modules: a checksum of these in a closure cell makes up for that.
"""

import inspect
import zlib
from functools import cache
from pathlib import Path
from types import ModuleType

from magmotor.models_folder import models_folder


def code_version(*modules: ModuleType) -> int:
    """Checksum of the source of some modules."""
    return zlib.crc32("".join(inspect.getsource(module) for module in modules).encode())


@cache
def package_checksum() -> int:
    """Checksum of all of magmotor's code and MJCF parts."""
    files = [*Path(__file__).parent.rglob("*.py"), *models_folder().glob("*.xml")]
    return zlib.crc32(b"".join(file.read_bytes() for file in sorted(files)))
