"""What is compiled separately, bound to symbols; on first use, two processes compile it."""

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from magmotor.mjcf import reports
from magmotor.mjcf.forces import all_forces

HELP = f"from {all_forces.__name__} import compile_alone; compile_alone()"
"""What the second process runs."""

_bound = False


def bind(meanwhile: Callable[[], Any] | None = None) -> None:
    """Bind the forces and the reports of errors to the symbols by which compiled code calls them.

    If the forces are not in Numba's cache and a processor is free, another process compiles them
    into it, while this one compiles what they call and then calls `meanwhile`, which may compile
    what calls them. Compiling then takes two thirds of the time.
    """
    global _bound
    if _bound:
        return
    with _forces_compiled_beside() as waiting:
        reports.bind()
        all_forces.bind_others()
        if waiting and meanwhile is not None:
            meanwhile()
    all_forces.bind()
    _bound = True


@contextmanager
def _forces_compiled_beside() -> Iterator[bool]:
    """Let another process compile the forces during the block, if that is of use; yield whether."""
    if all_forces.is_cached() or not _may_start_python():
        yield False
        return
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    silent = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        helper = subprocess.Popen([sys.executable, "-c", HELP], env=environment, **silent)
    except OSError:
        yield False
        return
    with helper:  # waits for its end
        try:
            yield True
        except BaseException:
            helper.kill()
            raise


def _may_start_python() -> bool:
    """Whether a processor is free, and the running program is known to be Python.

    Workers of a pool keep all processors busy by themselves.
    """
    is_python = Path(sys.executable or "").stem.startswith("python")
    return (os.cpu_count() or 1) > 1 and is_python and multiprocessing.parent_process() is None
