"""The build of the library: what is built, when, and what it refuses."""

import platform

import pytest

from library import build, targets
from library.targets import TARGETS
from magmotor.numerics.native_library import FORMAT, with_description

HERE = targets.here()
pytestmark = pytest.mark.skipif("x86-64-v3" not in HERE, reason="libraries are for Linux on x86-64")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """No library is there, and no compiler."""
    monkeypatch.setattr(build, "FOLDER", tmp_path)
    monkeypatch.setenv("CC", "no-compiler --option")
    return tmp_path


def write(name, functions=(), **changed):
    """Write a file without code, but with a description."""
    functions = {function: {"checksum": 0} for function in functions}
    description = {"format": FORMAT, "machine": TARGETS[name].machine, "functions": functions}
    description |= {"made_from": build.made_from()} | changed
    build.path_of(name).write_bytes(with_description(b"", description))


@pytest.mark.parametrize("name", ["x86-64-v3", "aarch64", "windows"])
def test_what_is_current_needs_no_compiler(name, capsys):
    assert not build.is_current(name)
    write(name)
    assert build.is_current(name)
    build.main([name])
    assert capsys.readouterr().out == f"{build.path_of(name)} is up to date\n"


@pytest.mark.parametrize(
    "changed",
    [
        {"made_from": "another compiler"},
        {"machine": "m68k"},
        {"functions": ["magmotor.numerics.gone.function()"]},
        {"functions": ["magmotor.noise.gone()"]},
        {"functions": ["magmotor.noise._compiled_normal()"]},
    ],
    ids=["sources", "machine", "no module", "no function", "changed"],
)
def test_what_is_older_than_the_sources_is_not_current(changed):
    write("x86-64-v3", **changed)
    assert not build.is_current("x86-64-v3")


def test_a_compiler_that_is_missing_is_named(capsys):
    sentence = "The C compiler no-compiler is not installed."
    with pytest.raises(SystemExit) as found:
        build.main(["x86-64-v3"])
    assert found.value.code == sentence
    build.main([])  # Numba does what the library would
    consequence = "Numba compiles functions when they are first used."
    assert capsys.readouterr().err == f"{sentence} {consequence}\n"


def test_an_unknown_library_is_refused():
    with pytest.raises(SystemExit) as found:
        build.main(["m68k"])
    assert str(found.value.code).startswith("unknown library 'm68k': x86-64-v4, x86-64-v3, ")


COUNTS = """
target triple = "x86_64-unknown-linux-gnu"
declare i8 @llvm.x86.atomic.sub.cc.i64(ptr, i64, i32 immarg) #0
define i8 @count(ptr %place) {{
  %1 = tail call i8 @llvm.x86.{instruction}
  ret i8 %1
}}
attributes #0 = {{ noinline }}
"""


def test_what_other_processors_lack_is_replaced_or_refused(folder):
    call = "atomic.sub.cc.i64(ptr %place, i64 1, i32 {})"
    for name in TARGETS:
        targets.emit(COUNTS.format(instruction=call.format(4)), name, folder / "code.o")
    with pytest.raises(ValueError, match="counts with another condition"):
        targets.emit(COUNTS.format(instruction=call.format(5)), HERE[0], folder / "code.o")
    code = COUNTS.format(instruction="other(ptr %place)")
    with pytest.raises(ValueError, match=r"the code calls llvm\.x86\.other, which not all"):
        targets.emit(code, HERE[0], folder / "code.o")


def test_code_is_optimized_for_this_machine_or_the_oldest_of_its_kind():
    assert targets.optimized_for(HERE[0]) == TARGETS[HERE[0]].processor
    assert targets.optimized_for("aarch64") == targets.optimized_for("windows") == "x86-64-v3"
    assert {TARGETS[name].machine for name in HERE} == {platform.machine()}
