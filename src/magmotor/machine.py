"""What the machine has."""

import math
import os


def physical_memory() -> float:
    """In bytes; infinite where the system does not say."""
    if not hasattr(os, "sysconf"):  # Windows
        return math.inf
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
