"""How many threads a call may use."""

import os


def thread_count() -> int:
    """OMP_NUM_THREADS, by which workers and clusters share out processors, else all of them."""
    told = os.environ.get("OMP_NUM_THREADS", "")
    return int(told) if told.isdecimal() and int(told) > 0 else os.cpu_count() or 1
