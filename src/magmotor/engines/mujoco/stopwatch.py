"""MuJoCo's stopwatch, which fills `mjData.timer` and takes some 0.7 us of every step."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from magmotor.engines.mujoco.hooks import Hook
from magmotor.engines.mujoco.memory import library


@contextmanager
def stopped() -> Iterator[None]:
    """Stop the stopwatch, which the Python bindings start whenever an MjData is made.

    Blocks may be nested and may overlap in several threads: the last that ends starts it again.
    """
    with _hook:
        _clock().value = None
        yield


@cache
def _clock() -> ctypes.c_void_p:
    return ctypes.c_void_p.in_dll(library(), "mjcb_time")


def _start(clock: int | None) -> None:
    _clock().value = clock


_hook = Hook(lambda: _clock().value, _start)
