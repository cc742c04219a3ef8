"""A checksum of source code, for the keys of Numba's disk cache.

Those keys hold a function's own bytecode and closure cells, but not the functions that are compiled
into it from other modules: a checksum of these in a closure cell makes up for that.
"""

import inspect
import zlib
from types import ModuleType


def code_version(*modules: ModuleType) -> int:
    """Checksum of the source of some modules."""
    return zlib.crc32("".join(inspect.getsource(module) for module in modules).encode())
