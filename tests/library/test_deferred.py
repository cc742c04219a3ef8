"""Numba is imported when something is compiled, and not before."""

import copy
import os
import pickle
import subprocess
import sys
import threading
import time

import pytest
from numba.core.compiler_lock import global_compiler_lock

import magmotor as mm
from magmotor.numerics import rotations, simd
from magmotor.numerics.c_types import boolean, int64, void
from magmotor.numerics.compiler import inference
from magmotor.numerics.deferred import Intrinsic, Subroutine, jitable, njit, subroutine, twofold
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


@twofold(python=lambda x: -x)
def _opposite(x):
    return 2.0 * x


@twofold
def _half(x):
    return _opposite(x) / 4.0


def test_twofold_functions_are_called_by_both():
    @njit
    def caller(x):
        return _half(x), _opposite(x)

    assert caller(1.0) == (0.5, 2.0)
    assert (_half(1.0), _opposite(1.0)) == (-0.25, -1.0)
    assert isinstance(_half, Subroutine)


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


def test_what_many_threads_need_at_once_is_made_once(monkeypatch):
    """Also if one of them is interrupted while it makes it."""
    make = inference.refresh
    monkeypatch.setattr(inference, "refresh", lambda: (time.sleep(1e-3), make()))
    for _ in range(20):
        new, together, found = njit(lambda x: x), threading.Barrier(4), []

        def need(new=new, together=together, found=found):
            together.wait()
            found.append(new.real)

        threads = [threading.Thread(target=need) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(found) == 4
        assert {*map(id, found)} == {id(new.real)}


def test_a_thread_that_compiles_waits_for_no_thread_that_needs_an_object():
    """The latter waits for the compiler."""
    first, second = njit(lambda x: x), njit(lambda x: x)
    waiting, alarm = threading.Thread(target=lambda: first.real), threading.Timer(60, os.abort)
    with global_compiler_lock:
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
        alarm.start()
        second.real  # noqa: B018
        alarm.cancel()
    waiting.join()


BROKEN = """
import sys
sys.path.insert(0, sys.argv[1])
import magmotor as mm
mm.noise.normal(1, 2, 3, 4, 1, 0)
"""


def test_a_numba_that_cannot_be_imported_says_why(tmp_path, monkeypatch):
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "0")
    (tmp_path / "numba.py").write_text("import math\nmath.no_such_thing\n")
    command = [sys.executable, "-c", BROKEN, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "module 'math' has no attribute 'no_such_thing'" in done.stderr.splitlines()[-1]


def test_names_are_copied_and_pickled_as_functions_are():
    for name in (mm.noise.normal, simd.fused, rotations.exponential):
        assert copy.copy(name) is copy.deepcopy(name) is name
    for name in (mm.noise.normal, _thrice, rotations.exponential):
        assert pickle.loads(pickle.dumps(name)) is name
    again = pickle.loads(pickle.dumps(njit(_local).real))
    assert again(1.0) == 2.0
    assert repr(rotations.exponential) == "Subroutine(exponential)"


def _local(x):
    return 2.0 * x


def test_a_use_changes_no_checksum():
    """Else what calls a function would be compiled again where that was used before."""
    before = reached(_draw)
    mm.noise.normal(1, 2, 3, 4, 1, 0)
    assert reached(_draw) == before
    assert "_compiled_normal.<locals>.normal.checksum" in " ".join(before[1])


def _draw():
    return mm.noise.normal(1, 2, 3, 4, 1, 0)
