"""Numba is imported when something is compiled, and not before."""

import subprocess
import sys

import pytest

import magmotor as mm
from magmotor.numerics.c_types import boolean, int64, void
from magmotor.numerics.deferred import Intrinsic, Subroutine, jitable, njit, subroutine
from magmotor.numerics.dependencies import reached

IMPORTS = """
import sys
import magmotor as mm
for name in dir(mm):
    getattr(mm, name)
from magmotor.numerics.demagnetization import demagnetizing_factors
assert demagnetizing_factors(2.0, 2.0, 2.0) == (1 / 3, 1 / 3, 1 / 3)  # Python's function
print(*sorted({"numba", "llvmlite"} & {*sys.modules}))
"""


def test_no_name_of_the_package_imports_numba():
    """That takes a third of a second."""
    command = [sys.executable, "-c", IMPORTS]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "\n"


def test_a_signature_is_written_as_numba_writes_it():
    from numba.core.sigutils import normalize_signature

    signature = void(int64, boolean)
    assert str(signature) == "void(int64, boolean)"
    arguments, result = normalize_signature(str(signature))
    assert (result and result.name, [each.name for each in arguments]) == (
        "none",
        ["int64", "bool"],
    )


@jitable
def _twice(x):
    return 2.0 * x


@njit
def _thrice(x):
    return _twice(x) + x


@subroutine
def _sixfold(x):
    return 2.0 * _thrice(x)


def test_what_a_name_stands_for_is_made_once():
    assert _thrice(1.0) == 3.0
    assert _thrice.real is _thrice.real
    assert _thrice.py_func is _thrice.__wrapped__
    assert isinstance(_sixfold, Subroutine)
    assert not hasattr(_sixfold, "__array__")


def test_compiled_code_calls_each_kind():
    @njit
    def caller(x):
        return _sixfold(x)

    assert caller(1.0) == 6.0


def test_an_intrinsic_that_is_not_there_is_named():
    with pytest.raises(ImportError, match="'nothing'"):
        Intrinsic("memory", "nothing").real  # noqa: B018


_three_words = Intrinsic("memory", "on_stack", 3)


def _use():
    return _three_words()


def test_an_intrinsic_is_known_by_what_it_was_made_with():
    """Else code compiled for one would be taken for that of another."""
    assert "test_deferred._three_words = memory.on_stack(3,)" in reached(_use)[1]


THREADS = """
import threading
import magmotor as mm

found, together = set(), threading.Barrier(8)

def draw():
    together.wait()
    found.add(float(mm.noise.normal(1, 2, 3, 4, 1, 0)))

threads = [threading.Thread(target=draw) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(len(found))
"""


def test_many_threads_may_need_numba_at_once():
    command = [sys.executable, "-W", "error", "-c", THREADS]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("1\n", "")


def test_a_use_changes_no_checksum():
    """Else what calls a function would be compiled again where that was used before."""
    before = reached(_draw)
    mm.noise.normal(1, 2, 3, 4, 1, 0)
    assert reached(_draw) == before
    assert "_compiled_normal.<locals>.normal.checksum" in " ".join(before[1])


def _draw():
    return mm.noise.normal(1, 2, 3, 4, 1, 0)
