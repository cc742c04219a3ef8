"""MuJoCo's stopwatch, which fills `mjData.timer` and takes some 0.7 us of every step."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

from magmotor.engines.mujoco.memory import library


@contextmanager
def stopped() -> Iterator[None]:
    """Stop the stopwatch, which the Python bindings start whenever an MjData is made."""
    clock = ctypes.c_void_p.in_dll(library(), "mjcb_time")
    running, clock.value = clock.value, None
    try:
        yield
    finally:
        clock.value = running
