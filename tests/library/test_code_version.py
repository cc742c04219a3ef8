"""Checksums of source code, and the code that processes get from Numba's disk cache."""

import importlib
import inspect
import io
import linecache
import math
import platform
import re
import shutil
import sys
import threading
import time
import zlib
from pathlib import Path
from typing import Any

import pytest
from numba import njit
from numba.core import config, event, registry
from tqdm import tqdm

import magmotor as mm
from magmotor.commands.movie import timed
from magmotor.common import versions
from magmotor.common.environment import data_folder
from magmotor.common.versions import machine_versions, package_checksum
from magmotor.devices.ball import rigid_kernel
from magmotor.devices.disk import variational as lanes
from magmotor.mjcf import callbacks, memory
from magmotor.mjcf.forces import all_forces
from magmotor.numerics import compilation_notice, dependencies, numba_cache
from magmotor.numerics.c_types import float64, int64, void
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine


def test_every_specialization_of_a_kernel_has_its_own_index():
    kernels: list[Any] = [
        *(lanes.kernel(mm.Disk(), scheme) for scheme in ("euler", "baoab")),
        *(lanes.kernel(mm.Disk(potential=U), "baoab") for U in ("cosine", "asymmetric")),
        lanes.kernel(mm.Disk(friction_ratio=1.0), "baoab"),
        *(rigid_kernel.kernel(scheme) for scheme in ("euler", "cayley", "baoab")),
    ]
    indices = {function._cache.files.stem for function in kernels}
    assert len(indices) == len(kernels)


def test_newer_code_never_opens_the_index_of_older_code(monkeypatch):
    """It may name types that no longer exist, on which Numba fails."""
    checksums = iter((1, 2))
    monkeypatch.setattr(dependencies, "checksum_of", lambda function: next(checksums))
    found = [compiled_once()(_defined)(3) for _ in range(2)]
    older, newer = found
    assert older._cache.files.stem != newer._cache.files.stem
    cells = [sorted(cell.cell_contents for cell in f.py_func.__closure__) for f in found]
    assert cells == [[1, 3], [2, 3]]


KERNEL = """
import numpy as np
import changed.sub.deep
from changed.callee import f
from changed.constants import A, B
from magmotor.numerics.compiled_once import compiled_once

@compiled_once()
def kernel(checksum):
    def compiled():
        _ = checksum
        return {}
    return compiled
"""
FUNCTION = "from magmotor.numerics.deferred import njit\n@njit\ndef f():\n    return {}\n"
CONSTANTS = "import numpy as np\nA, B = {}\n"
PACKAGE = {
    "__init__.py": "",
    "sub/__init__.py": "",
    "sub/deep.py": "C = 1.0\n" + FUNCTION.format(1.0),
    "callee.py": FUNCTION.format(1.0),
    "constants.py": CONSTANTS.format("1.0, 2.0"),
}
NEXT = 1 + 1e-10
CHANGES: dict[str, tuple[str, tuple[float, float], str, str, str, str]] = {
    "constant": ("A", (1, 3), "constants.py", CONSTANTS, "1.0, 2.0", "3.0, 2.0"),
    "constants of one name": (
        "A + 10 * changed.sub.deep.A",
        (21, 12),
        "constants.py",
        CONSTANTS + "import changed.sub.deep\nchanged.sub.deep.A = B\n",
        "1.0, 2.0",
        "2.0, 1.0",
    ),
    "tenth digit": (
        "A[0]",
        (1, NEXT),
        "constants.py",
        CONSTANTS,
        "np.ones(1), 0",
        "np.ones(1) + 1e-10, 0",
    ),
    "one of 2001 elements": (
        "A[1000]",
        (0, 1),
        "constants.py",
        CONSTANTS,
        "np.zeros(2001), 0",
        "1.0 * (np.arange(2001) == 1000), 0",
    ),
    "type": (
        "A[0]",
        (1, 5e-324),
        "constants.py",
        CONSTANTS,
        "np.array([1]), 0",
        "np.array([5e-324]), 0",
    ),
    "shape": (
        "len(A)",
        (2, 3),
        "constants.py",
        CONSTANTS,
        "np.ones((2, 3)), 0",
        "np.ones((3, 2)), 0",
    ),
    "array in a tuple": (
        "A[0][0]",
        (1, NEXT),
        "constants.py",
        CONSTANTS,
        "(np.ones(1),), 0",
        "(np.ones(1) + 1e-10,), 0",
    ),
    "called function": ("f()", (1, 2), "callee.py", FUNCTION, "1.0", "2.0"),
    "function two modules deep": (
        "changed.sub.deep.f()",
        (1, 2),
        "sub/deep.py",
        "C = 1.0\n" + FUNCTION,
        "1.0",
        "2.0",
    ),
    "type of elements": (
        "np.ones(1, A).nbytes",
        (8, 4),
        "constants.py",
        CONSTANTS,
        "np.dtype(np.float64), 0",
        "np.dtype(np.float32), 0",
    ),
    "constant two modules deep": (
        "changed.sub.deep.C",
        (1, 2),
        "sub/deep.py",
        "C = {}\n" + FUNCTION.format(1.0),
        "1.0",
        "2.0",
    ),
}
"""What the kernel returns, its older and newer value, and the file that changes."""


@pytest.fixture
def version(tmp_path, monkeypatch):
    """Import a package after writing a file of it; return its kernel, with one cache for all."""
    folder = tmp_path / "changed"
    (folder / "sub").mkdir(parents=True)
    for name, text in PACKAGE.items():
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # its files change within a second
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))

    def imported(name, text):
        (folder / name).write_text(text)
        for module in [m for m in sys.modules if m.partition(".")[0] == "changed"]:
            monkeypatch.delitem(sys.modules, module)
        linecache.clearcache()
        importlib.invalidate_caches()
        return importlib.import_module("changed.kernel").kernel()

    yield imported
    for module in [m for m in sys.modules if m.partition(".")[0] == "changed"]:
        del sys.modules[module]


@pytest.mark.parametrize("change", CHANGES)
def test_newer_code_is_never_served_from_the_cache_of_older_code(change, version, tmp_path):
    """The kernel's own file stays the same, so that Numba itself does not notice the change."""
    expression, values, name, text, older, newer = CHANGES[change]
    (tmp_path / "changed" / "kernel.py").write_text(KERNEL.format(expression))
    found = [version(name, text.format(part)) for part in (older, newer, older)]
    assert [kernel() for kernel in found] == [*values, values[0]]
    hits = [sum(kernel.stats.cache_hits.values()) for kernel in found]
    assert hits == [0, 0, 1]


@pytest.fixture
def of_two_kernels(version, tmp_path):
    """Import the package, whose module `kernel` has two kernels that call `f`, which reads `C`."""
    kernel = KERNEL.format("f()")
    second = kernel.partition("@")[2].replace("kernel", "second")
    (tmp_path / "changed" / "kernel.py").write_text(f"{kernel}\n@{second}")

    def imported():
        version("callee.py", "C = 1.0\n" + FUNCTION.format("C"))
        return sys.modules["changed.kernel"], sys.modules["changed.callee"]

    return imported


@pytest.mark.parametrize("before", ["definition", "compilation"])
def test_code_with_a_changed_constant_is_not_kept(before, of_two_kernels, monkeypatch):
    """Neither is that of a caller of a subroutine that was compiled while it was changed."""
    kernels, callee = of_two_kernels()
    if before == "compilation":
        kernels.kernel()
    monkeypatch.setattr(callee, "C", 2.0)
    assert kernels.kernel()() == 2.0
    monkeypatch.setattr(callee, "C", 1.0)
    assert kernels.second()() == 2.0  # as whenever Numba has compiled what reads a global value
    kernels, callee = of_two_kernels()
    assert [kernels.kernel()(), kernels.second()()] == [1.0, 1.0]


def test_code_of_before_a_constant_changed_is_not_loaded(of_two_kernels, monkeypatch):
    kernels, _ = of_two_kernels()
    assert kernels.kernel()() == 1.0
    kernels, callee = of_two_kernels()
    kernel = kernels.kernel()
    monkeypatch.setattr(callee, "C", 2.0)
    assert kernel() == 2.0


def test_a_constant_may_change_after_a_subroutine_was_compiled_alone(monkeypatch):
    monkeypatch.setattr(_raised.__wrapped__, "__module__", "magmotor.made")
    monkeypatch.setattr(sys.modules[__name__], "LEVEL", 2.0)
    assert njit(lambda: _raised())() == 2.0
    monkeypatch.setattr(sys.modules[__name__], "LEVEL", 1.0)
    assert not dependencies.are_unchanged(_raised.__wrapped__)


LEVEL = 1.0


@subroutine
def _raised():
    return LEVEL


def test_each_processor_has_its_own_index(version, tmp_path, monkeypatch):
    (tmp_path / "changed" / "kernel.py").write_text(KERNEL.format("A"))

    def index():
        kernel = version("constants.py", PACKAGE["constants.py"])
        return kernel._cache.files.stem

    paths = [index(), index()]
    for name in ("CPU_NAME", "CPU_FEATURES"):
        monkeypatch.setattr(config, name, "another")
        paths.append(index())
    assert paths[0] == paths[1]
    assert len({*paths}) == 3


def _defined(checksum, number):
    def function(x):
        _ = checksum
        return x + number

    return function


def test_a_function_that_does_not_refer_to_its_checksum_is_rejected():
    def forgetful(checksum):
        def function(x):
            return x

        return function

    with pytest.raises(TypeError, match="function does not refer to its checksum"):
        compiled_once()(forgetful)()


def test_the_modules_of_a_kernel_are_those_that_it_reaches():
    """Listed manually: called functions, types of arguments, and modules with constants."""
    ball = {f"devices.ball.rigid_{name}" for name in ("kernel", "steps", "surroundings")}
    of_rigid_bodies = {"dipoles", "noise", *ball}
    of_rigid_bodies |= {"devices.ball.rigid_forces"}
    of_rigid_bodies |= {f"numerics.{name}" for name in ("arrays", "elementary", "rotations")}
    modules, constants = dependencies.reached(inspect.unwrap(rigid_kernel._advance))
    assert modules == {f"magmotor.{name}" for name in of_rigid_bodies}
    assert "magmotor.devices.ball.rigid_forces.NOBODY = -1.0" in constants
    modules, _ = dependencies.reached(inspect.unwrap(all_forces._apply_forces))
    of_forces = "forces.dipole_wrenches", "forces.iron_pieces", "forces.brownian_wrenches", "memory"
    assert {f"magmotor.mjcf.{name}" for name in of_forces} <= modules


def test_what_is_compiled_by_itself_is_known_by_its_signature():
    modules, constants = dependencies.reached(inspect.unwrap(callbacks._callback))
    assert {"magmotor.mjcf.callbacks", "magmotor.mjcf.declarations.why_inert"} <= modules
    assert "magmotor.mjcf.forces.all_forces" not in modules
    numbers = ", ".join(6 * ["int64"])
    signature = f"magmotor_apply_forcesint64({numbers}, boolean, int64)"
    assert f"magmotor.mjcf.callbacks.apply_forces = {signature}" in constants


def test_what_is_compiled_late_is_known_by_its_symbol_and_signature():
    """Else cached code would look for the symbol that a function had before it was renamed."""
    _, constants = dependencies.reached(inspect.unwrap(all_forces._forward))
    number = zlib.crc32(f"magmotor_all_forces_address{all_forces._APPLY}".encode())
    assert f"LateFunction.__init__.<locals>.is_ready.number = {number}" in constants


def test_what_closures_have_is_reached():
    """The symbol of an address, and a subroutine."""
    address, negative = memory.function_at("a_symbol", void(int64)), _negative
    modules, constants = dependencies.reached(lambda x: address(negative(x)))
    symbol = "memory.variable('a_symbol',)"
    assert f"function_at.<locals>.function.address = {symbol}" in constants
    assert __name__ in modules


def test_subroutines_of_other_packages_are_reached(monkeypatch):
    monkeypatch.setattr(_negative.__wrapped__, "__module__", "elsewhere.negative")
    modules, _ = dependencies.reached(lambda x: _negative(x))
    assert "elsewhere.negative" in modules


def test_the_checksum_is_that_of_the_bytes_wherever_they_are(tmp_path, monkeypatch):
    package = Path(mm.__file__).parent
    here = package_checksum()
    ignore = shutil.ignore_patterns("__pycache__", "models")
    installed = shutil.copytree(package, tmp_path / "zebra" / "magmotor", ignore=ignore)
    shutil.copytree(data_folder("models"), installed / "models")
    monkeypatch.setattr(versions, "__file__", str(installed / "run" / "versions.py"))
    monkeypatch.setattr(versions, "data_folder", lambda name: installed / name)
    assert package_checksum.__wrapped__() == here
    (installed / "models" / "added.xml").write_text("<mujoco/>")
    assert package_checksum.__wrapped__() != here


@pytest.mark.parametrize(
    ("kind", "features", "expected"),
    [
        ("x86_64", {"FMA3": True, "AVX2": True}, "x86_64 with FMA"),
        ("x86_64", {"FMA3": True, "AVX2": False}, "x86_64"),
        ("x86_64", {"FMA3": False, "AVX2": True}, "x86_64"),
        ("arm64", {"NEON": True}, "arm64"),
    ],
)
def test_the_machine_type_determines_rounding(kind, features, expected, monkeypatch):
    monkeypatch.setattr(platform, "machine", lambda: kind)
    monkeypatch.setattr(versions, "cpu_features", features)
    assert machine_versions()["machine"] == expected


@pytest.fixture
def made():
    """Return a new function whose module has a name."""

    def make(module):
        def made(number):
            return sum([number, 1.0])

        made.__module__ = module
        return njit(made)

    return make


@pytest.mark.parametrize(("module", "seconds", "lines"), [
    ("magmotor.made", 0.0, 1), ("magmotor.made", 5.0, 0), ("someone.elses", 0.0, 0),
    (None, 0.0, 0),  # as after exec
])  # fmt: skip
def test_a_line_says_once_that_compilation_takes_long(module, seconds, lines, made, capsys):
    notice = compilation_notice.CompilationNotice(after=seconds)
    with event.install_listener("numba:compile", numba_cache.Listener(notice)):
        for _ in range(2):
            assert made(module)(2.0) == 3
    said = capsys.readouterr().err.splitlines()
    assert [line.startswith(compilation_notice.TEXT) for line in said] == lines * [True]
    assert not notice._teller.is_alive()


def test_the_line_says_how_far_it_is(made, capsys):
    notice = compilation_notice.CompilationNotice(after=0.2)
    functions = [made("magmotor.made") for _ in range(3)]
    with event.install_listener("numba:compile", numba_cache.Listener(notice)), notice.running():
        notice.expect({function.py_func for function in functions})
        notice.expect_elsewhere(lambda: 4, 10)
        functions[0](1.0)
        assert notice.progress() == (5, 13)
        until = time.monotonic() + 60
        while not notice._printed and time.monotonic() < until:  # it only waits, as for a process
            time.sleep(0.01)
    assert re.search(r"\([45] of 13 functions\)", capsys.readouterr().err)
    assert 0.2 <= notice.seconds < 60
    notice.expect({function.py_func for function in functions})
    assert notice.progress() == (0, 2)  # the first is compiled already


def test_the_line_says_that_the_library_is_older_than_the_sources(
    version, tmp_path, monkeypatch, capsys
):
    (tmp_path / "changed" / "kernel.py").write_text(KERNEL.format("A"))
    kernel = version("constants.py", PACKAGE["constants.py"])
    notice = compilation_notice.CompilationNotice(after=0.2)
    monkeypatch.setattr(numba_cache, "COMPILATION", notice)
    monkeypatch.setattr(numba_cache.native_library, "has_changed", lambda *_: True)
    with notice.running():
        kernel()
        until = time.monotonic() + 60
        while not notice._printed and time.monotonic() < until:
            time.sleep(0.01)
    assert capsys.readouterr().err.startswith(compilation_notice.CHANGED)


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        """Say so."""
        return True


def test_on_a_terminal_one_line_counts_and_goes(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    notice, counts = compilation_notice.CompilationNotice(after=0.0), iter(range(100))
    with notice.running():
        notice.expect_elsewhere(lambda: next(counts), 100)
        until = time.monotonic() + 60
        while terminal.getvalue().count("\r") < 2 and time.monotonic() < until:
            time.sleep(0.01)
    *shown, last, end = terminal.getvalue().split("\r")[1:]
    assert len(shown) >= 2
    assert [line.split(" (")[1].split()[0] for line in shown] == [*map(str, range(len(shown)))]
    assert {len(line) for line in (*shown, last)} == {79}  # narrower than any terminal
    assert last.strip() == end == ""


def test_the_time_of_a_c_function_counts(tmp_path, monkeypatch):
    """Numba reports no event for it."""
    ended = compilation_notice.COMPILATION.seconds
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    define = compiled_once(float64(float64))(_defined)
    function = define(3.0)
    assert compilation_notice.COMPILATION.seconds > ended  # MuJoCo cannot wait for it
    assert function.ctypes(4.0) == 7.0
    assert define(3.0) is function


def test_what_will_be_compiled_is_known_before(version, tmp_path):
    """All that is compiled is expected, down to what other modules define."""
    (tmp_path / "changed" / "kernel.py").write_text(KERNEL.format("f() + changed.sub.deep.f()"))
    kernel = version("constants.py", PACKAGE["constants.py"])
    expected = dependencies.subroutines_of(sys.modules["changed.kernel"].kernel)
    assert {function.__module__ for function in expected} == {"changed.callee", "changed.sub.deep"}
    recorder = event.RecordingListener()
    with event.install_listener("numba:compile", recorder):
        kernel()
    compiled = {one.data["dispatcher"].py_func for _, one in recorder.buffer}
    assert compiled == expected | {kernel.py_func}


def test_the_line_about_compilation_is_on():
    (notice,) = (
        each._notice for each in event._registered["numba:compile"]
        if isinstance(each, numba_cache.Listener)
    )  # fmt: skip
    assert notice is compilation_notice.COMPILATION
    assert 1.0 <= notice._after <= 10.0  # 5


def test_the_clock_of_a_bar_stops_while_code_is_compiled(monkeypatch):
    compilation = compilation_notice.COMPILATION
    with compilation_notice.Progress(total=4, file=io.StringIO()) as bar:
        began = bar.start_t
        for compiled, expected in ((3.0, 3.0), (0.0, 3.0), (2.0, 5.0)):
            monkeypatch.setattr(compilation, "seconds", compilation.seconds + compiled)
            bar.update()
            assert bar.start_t - began == pytest.approx(expected, abs=1e-6)


def test_compilation_is_listed_apart_from_simulation(monkeypatch):
    compilation, seconds = compilation_notice.COMPILATION, {}
    for compiled in (0.0, 3.0, 2.0):
        with timed(seconds, "simulate"):
            monkeypatch.setattr(compilation, "seconds", compilation.seconds + compiled)
        assert seconds["simulate"] + compiled == pytest.approx(0, abs=0.5)
    assert seconds["compile"] == pytest.approx(5.0)


def test_a_subroutine_called_from_python_is_an_error():
    with pytest.raises(TypeError, match="_copied can be called by compiled code only"):
        _copied(1.0)
    assert njit(lambda x: _copied(x))(1.0) == 1.0


def test_a_subroutine_has_no_machine_code_of_its_own():
    def defined(function):
        (compiled,) = function.overloads.values()
        target: Any = registry.cpu_target.target_context
        return target.codegen()._engine.is_symbol_defined(compiled.fndesc.llvm_func_name)

    plain = njit(lambda x: x)
    assert njit(lambda x: _negative(x) + plain(x))(2.5) == 0.0
    assert (defined(_negative), defined(plain)) == (False, True)


def test_a_subroutine_divides_by_zero_whoever_calls_first():
    first = njit(error_model="python")(lambda x: _reciprocal(x))
    later = njit(error_model="numpy")(lambda x: _reciprocal(x))
    assert (first(2.0), first(0.0), later(0.0)) == (0.5, math.inf, math.inf)


@subroutine
def _copied(x):
    return x


@subroutine
def _negative(x):
    return -x


@subroutine
def _reciprocal(x):
    return 1.0 / x


def test_a_progress_bar_has_the_lock_of_all_bars(monkeypatch):
    """One of its own would stay locked in forks after a process that held it was killed."""
    lock = threading.RLock()
    monkeypatch.setattr(tqdm, "_lock", lock, raising=False)
    bar = compilation_notice.Progress(total=1, disable=True)
    bar.close()
    assert bar.get_lock() is lock
    monkeypatch.delattr(tqdm, "_lock")
    assert compilation_notice.Progress.get_lock() is tqdm.get_lock()
    assert "_lock" not in vars(compilation_notice.Progress)
