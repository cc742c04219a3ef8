"""On first use, a second process compiles the forces, and nothing depends on it."""

import ctypes
import multiprocessing
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from numba import cfunc, njit, types

import magmotor
from magmotor.mjcf import binding, callbacks, layout, memory
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.forces import all_forces
from magmotor.numerics import c_types, compilation_notice, symbols


@pytest.fixture
def commands(monkeypatch):
    """The commands of processes that are started; the forces are not in the cache."""
    started = []

    class Process:
        def __init__(self, command, **options):
            started.append((command, options))
            self.killed, self.ends = False, iter([None, 0])

        def poll(self):
            return next(self.ends)

        def __enter__(self):
            return self

        def __exit__(self, *error):
            started.append("killed" if self.killed else "waited for")

        def kill(self):
            self.killed = True

    monkeypatch.setattr(subprocess, "Popen", Process)
    monkeypatch.setattr(all_forces, "is_cached", lambda: False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(sys, "executable", "/usr/bin/python3.11")
    return started


@contextmanager
def beside():
    with binding._forces_compiled_beside(all_forces.is_cached()):
        yield


def test_another_process_is_started_and_waited_for(commands):
    with beside():
        assert len(commands) == 1
    (command, _), end = commands
    assert command[0] == "/usr/bin/python3.11"
    assert end == "waited for"


REPORT = """
import sys, magmotor, multiprocessing, numpy, random
print(*(module.__file__ for module in (magmotor, multiprocessing, numpy, random)), sep="\\n")
"""


@pytest.mark.parametrize("entry", ["", "nowhere"])
def test_it_imports_nothing_from_the_working_folder(tmp_path, monkeypatch, entry):
    for name in ("magmotor", "multiprocessing", "numpy", "random"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('hostile')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry, *filter(None, sys.path)])
    monkeypatch.setattr(binding, "HELP", REPORT)
    monkeypatch.setenv("PYTHONPATH", f"{os.pathsep}elsewhere")
    with (tmp_path / "output").open("wb+") as output, binding._helper(output) as helper:
        helper.wait(60)
        output.seek(0)
        own, *others = output.read().decode().splitlines()
    assert own == magmotor.__file__
    assert len(others) == 3
    assert not [path for path in others if Path(path).parent == tmp_path]


def test_ctrl_c_ends_it(commands):
    with pytest.raises(KeyboardInterrupt), beside():
        raise KeyboardInterrupt
    assert commands[1] == "killed"


def test_it_ends_with_the_first_process(monkeypatch, tmp_path):
    """Also if that one is killed, or is interrupted while it starts this one."""
    begin = binding.HELP.partition("from magmotor")[0]
    monkeypatch.setattr(binding, "HELP", f"{begin}import time; time.sleep(120)")
    with (tmp_path / "output").open("wb") as output, binding._helper(output) as helper:
        with pytest.raises(subprocess.TimeoutExpired):
            helper.wait(3)
        assert helper.stdin is not None
        helper.stdin.close()
        assert helper.wait(60) == 1


def test_what_it_has_compiled_is_counted(commands, monkeypatch):
    notice = compilation_notice.CompilationNotice()
    monkeypatch.setattr(binding, "COMPILATION", notice)
    with beside():
        total = notice.progress()[1]
        os.write(commands[0][1]["stdout"].fileno(), b"...")
        assert notice.progress() == (3, total)
    assert 80 < total < 500  # 402


def test_it_tells_what_it_has_compiled(monkeypatch):
    """A byte for each function of the forces, however often it is compiled, and none for others."""
    first, second, other = (lambda x, n=n: x + n for n in range(3))
    written, notice = [], compilation_notice.CompilationNotice()
    monkeypatch.setattr(os, "write", lambda _, content: written.append(content))
    monkeypatch.setattr(binding, "COMPILATION", notice)
    monkeypatch.setattr(binding, "subroutines_of", lambda *_: {first, second})
    monkeypatch.setattr(reader, "compile_alone", lambda: [*map(notice.add, (first, other))])
    monkeypatch.setattr(all_forces, "compile_alone", lambda: [*map(notice.add, (first, second))])
    binding.help_compiling()
    assert written == [b".", b"."]


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (all_forces, "is_cached", lambda: True),
        (os, "cpu_count", lambda: 1),
        (sys, "executable", "/usr/bin/blender"),
        (sys, "executable", ""),
        (multiprocessing, "parent_process", lambda: "a driver"),
    ],
)
def test_none_is_started_where_it_is_of_no_use(commands, monkeypatch, owner, name, value):
    monkeypatch.setattr(owner, name, value)
    with beside():
        pass
    assert commands == []


def test_without_it_the_block_runs(commands, monkeypatch):
    def refuse(*_, **__):
        raise OSError

    monkeypatch.setattr(subprocess, "Popen", refuse)
    done = []
    with beside():
        done.append(True)
    assert done


@pytest.mark.parametrize("cached", [True, False])
def test_only_who_waits_compiles_more(commands, monkeypatch, cached):
    """Loading the callback from the cache would slow down every start with the plugin."""
    called = []
    monkeypatch.setattr(all_forces, "is_cached", lambda: cached)
    monkeypatch.setattr(binding, "_bound", False)
    binding.bind(lambda: called.append(True))
    assert bool(called) == bool(commands) == (not cached)


def test_the_callback_is_what_it_compiles_meanwhile(commands, monkeypatch):
    """By then, all that it calls is bound; otherwise, the process would die in a call."""
    binding.bind()  # so that nothing is compiled below
    names, bound = set(), []

    def compiled(offsets):
        assert offsets == layout.current()
        bound.extend(names)

    monkeypatch.setattr(symbols, "bind", lambda name, _: names.add(name))
    monkeypatch.setattr(callbacks, "_callback", compiled)
    monkeypatch.setattr(binding, "_bound", False)
    callbacks._bind.__wrapped__()
    of_ours = {f"magmotor_{name}" for name in ("apply_forces", "find_error", "report")}
    assert of_ours | {"mj_applyFT", "mj_passive", "mj_warning"} <= set(bound)


def test_a_c_function_may_be_known_after_its_callers():
    """Arguments and result pass as in a call of a symbol, including a Boolean."""
    signature = c_types.int64(c_types.int64, c_types.boolean, c_types.float64)
    address = ctypes.c_int64()
    memory.bind_variable("test_late_function", address)
    late = memory.function_at("test_late_function", signature)

    @njit
    def caller(number, flag, length):
        return late((number, flag, length))

    caller.compile((types.int64, types.boolean, types.double))

    @cfunc(str(signature))
    def callee(number, flag, length):
        return 100 * number + 10 * flag + int(length)

    address.value = callee.address or 0
    assert caller(-7, True, 3.9) == -687
    assert caller(1 << 40, False, 2.0) == (100 << 40) + 2


def test_it_binds_all_that_the_forces_call(monkeypatch):
    """At a missing symbol the process could abort, and this one would compile alone."""
    binding.bind()  # so that nothing is compiled below
    monkeypatch.setattr(all_forces, "_apply_forces", lambda *_: None)
    monkeypatch.setattr(reader, "compiled", lambda _: None)

    def bound(function):
        names = set()
        with monkeypatch.context() as patch:
            patch.setattr(symbols, "bind", lambda name, _: names.add(name))
            function()
        return names

    here, there = bound(all_forces.bind_others), bound(all_forces.compile_alone)
    there |= bound(reader.compile_alone)
    of_callers = {"magmotor_apply_forces", "magmotor_forces_address", "magmotor_reader_address"}
    of_callers |= {"magmotor_all_forces_address", "magmotor_check_elements_address"}
    of_callers |= {"magmotor_compute_response", "magmotor_responses_address"}
    of_callers |= {"magmotor_eddy_address", "magmotor_hysteresis_address"}
    assert there == here - of_callers
    assert len(here) == 25


def test_what_it_compiles_is_what_this_process_loads(tmp_path, monkeypatch):
    """The first program puts the forces into the cache, so that the second only loads them."""
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "0")
    waiting, _ = os.pipe()  # else it would end

    def run(code, **environment):
        command = [sys.executable, "-c", code]
        environment = os.environ | environment
        done = subprocess.run(
            command, env=environment, check=True, capture_output=True, text=True, stdin=waiting
        )
        return done.stdout

    ask = "print(all_forces._apply_forces(layout.current(), False).cache_hits)"
    imports = "from magmotor.mjcf import layout; from magmotor.mjcf.forces import all_forces"
    run("from magmotor.mjcf import binding; binding.bind()")
    assert run(f"{binding.HELP}\n{imports}; {ask}") == "1\n"
    ask = "from magmotor.mjcf.forces import all_forces; print(all_forces.is_cached())"
    assert run(ask) == "True\n"
    assert run(ask, NUMBA_CACHE_DIR=str(tmp_path)) == "False\n"
