"""What is compiled separately, bound to symbols; on first use, two processes compile it."""

import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from magmotor.mjcf import error_reports
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.forces import all_forces
from magmotor.numerics import native_library
from magmotor.numerics.compilation_notice import COMPILATION
from magmotor.numerics.dependencies import subroutines_of

HELP = f"""
import os, threading

def end_with_first():
    os.read(0, 1)
    os._exit(1)

threading.Thread(target=end_with_first, daemon=True).start()
from {__name__} import help_compiling
help_compiling()
"""
"""What the second process runs. It ends if the first one no longer waits, which closes stdin."""

_bound = False


def bind(meanwhile: Callable[[], Any] | None = None) -> None:
    """Bind the forces and the reports of errors to the symbols by which compiled code calls them.

    If the forces are not on the disk and a processor is free, another process compiles them, while
    this one compiles what they call and then calls `meanwhile`, which may compile what calls them.
    Compiling then takes two thirds of the time.
    """
    global _bound
    if _bound:
        return
    is_cached = all_forces.is_cached() and reader.is_cached()
    with ExitStack() as stack:
        if not is_cached:
            stack.enter_context(COMPILATION.running())
            callers = error_reports.bind, all_forces.bind_others, *filter(None, [meanwhile])
            # A library has the forces, and all that they need, unless sources have changed.
            COMPILATION.expect(subroutines_of(*callers), native_library.library() is not None)
        with _forces_compiled_beside(is_cached) as waiting:
            error_reports.bind()
            all_forces.bind_others()
            if waiting and meanwhile is not None:
                meanwhile()
        reader.bind()
        all_forces.bind()
    _bound = True


@contextmanager
def _forces_compiled_beside(is_cached: bool) -> Iterator[bool]:
    """Let another process compile the forces during the block, if that is of use; yield whether."""
    if is_cached or not _may_start_python():
        yield False
        return
    with ExitStack() as stack:
        try:
            counted = stack.enter_context(tempfile.TemporaryFile())
            helper = stack.enter_context(_helper(counted))
        except OSError:
            yield False
            return
        total = len(subroutines_of(reader.bind, all_forces.bind))
        COMPILATION.expect_elsewhere(lambda: os.fstat(counted.fileno()).st_size, total)
        stack.callback(COMPILATION.expect_elsewhere, lambda: total, total)  # before it is closed
        try:
            yield True
            while helper.poll() is None:  # nothing would end a wait in another thread
                time.sleep(0.05)
        except BaseException:
            helper.kill()
            raise


def _helper(output: Any) -> subprocess.Popen:
    """Start the second process. What this one cannot import, that one cannot, wherever it is."""
    package = str(Path(__file__).parents[2])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([*filter(None, sys.path), package])}
    return subprocess.Popen(
        [sys.executable, "-P", "-c", HELP], env=environment, stdin=subprocess.PIPE, stdout=output,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip


def help_compiling() -> None:
    """Compile the forces, in a process that does nothing else; write a byte for each function."""
    functions = subroutines_of(reader.bind, all_forces.bind)
    COMPILATION.when_added = lambda function: function in functions and os.write(1, b".")
    reader.compile_alone()
    all_forces.compile_alone()


def _may_start_python() -> bool:
    """Whether a processor is free, and the running program is known to be Python.

    Workers of a pool keep all processors busy by themselves.
    """
    is_python = Path(sys.executable or "").stem.startswith("python")
    return (os.cpu_count() or 1) > 1 and is_python and multiprocessing.parent_process() is None
