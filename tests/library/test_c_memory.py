"""The library frees all memory, and refuses the wrong processor."""

import ctypes
import shutil

import numpy as np
import pytest
from c_host import NEEDED, TOP, program, run, written

import magmotor as mm
from library.exercise import NEEDLE
from magmotor.devices.motor.energy import _magnetic
from magmotor.devices.motor.variational import magnets
from magmotor.numerics import native_library

pytestmark = NEEDED
VALGRIND = (
    shutil.which("valgrind") or "", "--quiet", "--leak-check=full", "--error-exitcode=9",
)  # fmt: skip
V3, V4 = (native_library.FOLDER / f"libmagmotor-x86-64-v{k}.so" for k in (3, 4))
needs_valgrind = pytest.mark.skipif(not VALGRIND[0], reason="there is no valgrind")


def test_memory_does_not_grow():
    (grown,) = run("leaks", 1000, [TOP]).stdout.split()
    assert int(grown) < 1000


class _Heap(ctypes.Structure):
    """The GNU C library's struct mallinfo2."""

    _fields_ = [
        ("others", ctypes.c_size_t * 7),
        ("uordblks", ctypes.c_size_t),  # bytes in use
        ("more", ctypes.c_size_t * 2),
    ]


def test_arrays_of_compiled_code_are_freed():
    """They are a copy of the dipoles of the ring, in each call."""
    c = ctypes.CDLL(None)
    c.mallinfo2.restype = _Heap
    calls, out, moving = 1000, np.empty((3, 1)), magnets(mm.Motor())
    place, turn = np.array([[0.0, 0.0, 0.1]]), np.array([[1.0, 0.0, 0.0, 0.0]])
    _magnetic()(out, place, place, turn, moving)
    before = c.mallinfo2().uordblks
    for _ in range(calls):
        _magnetic()(out, place, place, turn, moving)
    assert c.mallinfo2().uordblks - before < calls * moving.frame.nbytes / 10


@needs_valgrind
@pytest.mark.skipif(not V3.exists(), reason=f"valgrind knows no AVX-512, and there is no {V3.name}")
def test_valgrind_finds_no_error(tmp_path):
    (path,) = written(tmp_path, [NEEDLE])
    done = run("leaks", 20, [path], by=(*VALGRIND, program()), library=V3)
    assert done.stderr == ""


@needs_valgrind
@pytest.mark.skipif(not V4.exists(), reason=f"there is no {V4.name}")
def test_a_processor_without_the_instructions_is_refused():
    done = run("plugins", 0, [TOP], by=(VALGRIND[0], "--quiet", program()), library=V4)
    needed = "this library needs a processor with AVX-512 (x86-64-v4)"
    assert done.stderr == f"magmotor: nothing is registered: {needed}\n"
