"""The library that is compiled ahead of time: which one is taken, and how Python calls it."""

import os
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest

import magmotor as mm
from library import layouts, tables
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf import layout
from magmotor.mjcf.declarations import reader
from magmotor.numerics import native_library
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.native_library import (
    NativeLibrary,
    UnfitLibraryError,
    described,
    with_description,
)

TESTS = Path(__file__).parents[1]
LIBRARY = native_library.library()
BUILT = pytest.mark.skipif(LIBRARY is None, reason="there is no library: python -m library.build")
DESCRIPTION = {
    "format": native_library.FORMAT, "machine": os.uname().machine, "level": "", "offsets": [],
    "functions": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda content: content[:-1], "damaged"),
        (lambda content: content[: len(content) // 2], "damaged"),
        (lambda content: content[:9] + bytes([content[9] ^ 1]) + content[10:], "damaged"),
        (lambda _: b"", "damaged"),
        (lambda _: b"a text of someone else", "damaged"),
        (lambda _: with_description(b"", DESCRIPTION | {"format": 0}), "its format is 0"),
        (lambda _: with_description(b"", DESCRIPTION | {"machine": "m68k"}), "it is for m68k"),
    ],
)
def test_a_file_that_is_no_library_is_not_loaded(change, reason, tmp_path):
    path = tmp_path / "library.so"
    content = with_description(b"content of a library", DESCRIPTION)
    path.write_bytes(content)
    assert described(path) == DESCRIPTION
    path.write_bytes(change(content))
    with pytest.raises(UnfitLibraryError) as found:  # refused before anything of it runs
        described(path)
    assert reason in str(found.value)


def test_a_file_that_others_can_write_to_is_not_loaded(tmp_path):
    path = tmp_path / "library.so"
    path.write_bytes(with_description(b"", DESCRIPTION))
    assert described(path) == DESCRIPTION
    path.chmod(0o666)
    with pytest.raises(UnfitLibraryError) as found:
        described(path)
    assert "others can write to it" in str(found.value)
    path.chmod(0o644)
    tmp_path.chmod(0o777)
    with pytest.raises(UnfitLibraryError):
        described(path)


@pytest.mark.parametrize(
    ("spoil", "is_refused"),
    [
        (lambda code, library: [os.chown(each, 4321, 0) for each in (code, library)], False),
        (lambda _, library: os.chown(library, 4321, 0), True),
        (lambda code, _: os.chown(code, 4321, 0), False),
        (lambda code, library: [_open_to_group(each) for each in (code, library)], False),
        (lambda _, library: _open_to_group(library), True),
        (lambda code, library: [each.chmod(0o666) for each in (code, library)], True),
    ],
    ids=[
        "installed by another user", "of another user", "in the package of another user",
        "installed by a group", "of a group", "of everybody",
    ],
)  # fmt: skip
def test_who_can_change_the_package_may_change_the_library(
    spoil, is_refused, tmp_path, monkeypatch
):
    """Such users need no library to run code in this process."""
    path, code = tmp_path / "library.so", tmp_path / "code.py"
    path.write_bytes(with_description(b"", DESCRIPTION))
    code.touch()
    monkeypatch.setattr(native_library, "__file__", str(code))
    try:
        spoil(code, path)
    except PermissionError:
        pytest.skip("only root can give a file away")
    if is_refused:
        with pytest.raises(UnfitLibraryError):
            described(path)
    else:
        assert described(path) == DESCRIPTION


def _open_to_group(path):
    """Let a group write that no user has alone."""
    os.chown(path, -1, 4321)
    path.chmod(0o664)


def test_what_is_no_object_is_named_and_the_rest_works(tmp_path, monkeypatch):
    folder = tmp_path / "native"
    folder.mkdir()
    level = native_library.LEVELS[os.uname().machine][0]
    path = folder / f"libmagmotor-{level}.so"
    path.write_bytes(with_description(b"no object", DESCRIPTION))
    program = f"""
    from pathlib import Path
    from magmotor.numerics import native_library
    native_library.FOLDER = Path({str(folder)!r})
    import magmotor as mm
    print(mm.noise.normal(1, 2, 3, 4, 1, 0))
    assert native_library.library() is None
    """
    done = _run(program)
    assert float(done.stdout) == mm.noise.normal(1, 2, 3, 4, 1, 0)
    assert f"magmotor: {path} is not used: " in done.stderr


@BUILT
def test_the_library_is_not_used_if_its_sources_or_the_layout_are_others(monkeypatch):
    define, by = reader.compiled.__wrapped__, (layout.current(),)
    assert native_library.versions(define, by)
    other = layout.current()._replace(nbody=layout.current().nbody + 8)
    assert not native_library.versions(define, (other,))
    assert not native_library.has_changed(define, by)
    monkeypatch.setattr(native_library.dependencies, "checksum_of", lambda _: 0)
    assert not native_library.versions(define, by)
    assert native_library.has_changed(define, by)
    assert not native_library.has_changed(define, (*by, "unknown"))


@pytest.mark.parametrize("before", [None, "1"])
def test_a_library_registers_no_plugins_in_python_whatever_is_visible(before, monkeypatch):
    visible = SimpleNamespace(mjp_registerPlugin=None)
    monkeypatch.setattr(native_library.ctypes, "CDLL", lambda _: visible)
    monkeypatch.delenv(native_library.SWITCH, raising=False)
    if before is not None:
        monkeypatch.setenv(native_library.SWITCH, before)
    with native_library._registering_nothing():
        assert os.environ[native_library.SWITCH] == "0"
    assert os.environ.get(native_library.SWITCH) == before


@BUILT
def test_offsets_in_another_order_are_those_of_another_layout():
    """Otherwise, code would read a number of the layout for another one."""
    assert LIBRARY is not None
    define, by = reader.compiled.__wrapped__, (layout.current(),)
    again = NativeLibrary(LIBRARY.path)
    assert again.versions(define, by)
    again = NativeLibrary(LIBRARY.path)
    again.description["offsets"].reverse()
    assert not again.versions(define, by)


@pytest.mark.parametrize(
    ("built", "supported", "taken"),
    [
        (("v3", "v4"), ("v3", "v4"), "v4"),
        (("v3", "v4"), ("v3",), "v3"),
        (("v3",), ("v3", "v4"), "v3"),
        (("v4",), ("v3",), None),
        (("v3", "damaged v4"), ("v3", "v4"), "v3"),
        ((), ("v3", "v4"), None),
    ],
)
def test_the_best_library_is_taken_that_the_processor_supports(
    built, supported, taken, tmp_path, monkeypatch
):
    class Library:
        def __init__(self, path):
            self.level = path.stem.removeprefix("libmagmotor-x86-64-")
            if self.level not in built:
                raise UnfitLibraryError("it is damaged")

        def runs_here(self):
            return self.level in supported

    for level in built:
        (tmp_path / f"libmagmotor-x86-64-{level.split()[-1]}.so").touch()
    bound = []
    monkeypatch.setattr(native_library, "FOLDER", tmp_path)
    monkeypatch.setattr(native_library, "NativeLibrary", Library)
    monkeypatch.setattr(native_library.symbols, "bind_in", bound.append)
    monkeypatch.setattr(native_library.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(native_library.sys, "platform", "linux")
    monkeypatch.delenv(native_library.SWITCH, raising=False)
    found: Any = native_library.library.__wrapped__()
    assert (found.level if found else None) == taken
    assert bound == [found] * (found is not None)


def test_the_switch_of_the_library_is_0_or_1(monkeypatch):
    monkeypatch.setenv(native_library.SWITCH, "off")
    with pytest.raises(ArgumentError) as found:
        native_library.library.__wrapped__()
    assert str(found.value) == "MAGMOTOR_LIBRARY = 'off': must be 0 or 1, in the environment"
    monkeypatch.setenv(native_library.SWITCH, "0")
    assert native_library.library.__wrapped__() is None


@BUILT
def test_programs_need_no_numba(tmp_path):
    """Magnets by the plugin and by the callback, fields, noise, a thermostat, rigid bodies."""
    program = """
    import sys
    sys.modules["numba"] = sys.modules["llvmlite"] = None
    import magmotor as mm
    import mujoco
    import numpy as np
    path = sys.argv[1]
    model = mujoco.MjModel.from_xml_path(path + "/models/top_magnetic.xml")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=10)
    model = mujoco.MjModel.from_xml_path(path + "/models/levitation.xml")
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=10)
    mm.field(model, data, [[0.0, 0.0, 1.0]])
    points = np.frombuffer(np.ones(3).tobytes())  # read-only
    assert np.array_equal(mm.field(model, data, points), mm.field(model, data, [1, 1, 1]))
    mm.magnetic_energy(model, data)
    mm.dipoles.field([0, 0, 0.1], [[0, 0, 0]], [[0, 0, 1]])
    tree = "<mujoco><worldbody><body><joint type='hinge' damping='1'/><geom size='1'/></body>"
    tree = mujoco.MjModel.from_xml_string(tree + "</worldbody></mujoco>")
    mm.Langevin(tree, kT=1.0).sample(4 * tree.opt.timestep, replicas=2)
    for scene in (mm.Top(), mm.Motor(), mm.Motor(drag=1e-3)):
        for method in mm.methods(scene):
            if method != "scipy/dop853":
                mm.simulate(scene, method=method, timestep=1e-3, duration=1e-2)
    """
    _run(program, str(TESTS.parent))


def test_without_library_and_numba_the_error_of_a_model_says_what_is_missing():
    program = """
    import sys
    sys.modules["numba"] = None
    from magmotor_plugin.library import loads_entry_points
    if not loads_entry_points():
        import magmotor  # without which MuJoCo 3 does not know its plugins
    import mujoco
    try:
        mujoco.MjModel.from_xml_path(sys.argv[1] + "/models/levitation.xml")
    except ValueError as error:
        print(error)
    """
    done = _run(program, str(TESTS.parent), MAGMOTOR_LIBRARY="0")
    assert 'numba is not installed: pip install "magmotor[numba]"' in done.stdout
    assert done.stderr == ""


@BUILT
def test_the_library_has_the_bits_of_numba():
    """Each program prints checksums of what depends on every kernel; one compiles all by Numba."""
    program = """
    import sys, zlib
    import numpy as np
    sys.path.append(sys.argv[1])
    from hosted_models import FILES, MANY, MODELS, states
    import magmotor as mm
    import mujoco
    found = dict(zip([*MODELS, *FILES, *MANY], states()))
    for path in FILES:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        found["energy", path] = mm.magnetic_energy(model, data)
        found["field", path] = mm.field(model, data, [[1.0, 2.0, 3.0]])
    for view in [(factor, level) for factor in (1, 3) for level in (0, 1, 5, 40)]:
        found["noise", view] = mm.noise.normal(1, 2, 3, 4, *view)
    found["path"] = mm.noise.BrownianPath(timestep=1e-3, seed=1).increments(9)
    for scene in (mm.Top(), mm.Motor(), mm.Motor(drag=1e-3, rotational_drag=1e-6)):
        for method in mm.methods(scene):
            run = mm.simulate(scene, method=method, timestep=1e-3, duration=0.05)
            found |= {(scene, method, name): run[name].values for name in run}
    tree = "<mujoco><worldbody><body><joint type='hinge' damping='1'/><geom size='1'/></body>"
    tree = mujoco.MjModel.from_xml_string(tree + "</worldbody></mujoco>")
    run = mm.Langevin(tree, kT=1.0, seed=3).sample(0.1, replicas=2, burn_in=0.1)
    found |= {("Langevin", name): run[name].values for name in run}
    for name, value in found.items():
        if (numbers := np.asarray(value)).dtype.kind in "fi":
            print(name, zlib.crc32(numbers.tobytes()))
    """
    programs = _run(program, str(TESTS)), _run(program, str(TESTS), MAGMOTOR_LIBRARY="0")
    here, there = ({*each.stdout.splitlines()} for each in programs)
    assert len(here) > 100
    assert here ^ there == set()


def test_a_thread_that_looks_into_the_library_lets_others_go_on(monkeypatch):
    """With a lock, a process that is forked meanwhile would wait forever."""
    looking, found = threading.Event(), threading.Event()

    def versions(_, by):
        if by == (1,):
            looking.set()
            assert found.wait(60)
        return []

    monkeypatch.setattr(native_library, "versions", versions)
    one, other = (compiled_once()(_shifted)(by) for by in (1, 2))
    thread = threading.Thread(target=one, args=(1.0,))
    thread.start()
    assert looking.wait(60)
    caller = threading.Thread(target=other.compile_for, args=(1.0,), daemon=True)
    caller.start()
    caller.join(30)
    is_waiting = caller.is_alive()
    found.set()
    thread.join()
    assert not is_waiting


def _shifted(checksum, number):
    def function(x):
        _ = checksum
        return x + number

    return function


def _run(program: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    """Run a program in a new process, which must not fail."""
    lines = program.splitlines()
    indented = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
    text = "\n".join(line[indented:] for line in lines)
    done = subprocess.run(
        [sys.executable, "-c", text, *arguments], env=os.environ | environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done


def test_the_table_of_versions_has_the_one_that_is_installed(monkeypatch):
    monkeypatch.setattr(layouts, "known", dict)
    (row,) = tables.versions().splitlines()
    assert row.startswith(f'VERSION({mujoco.mj_version()}, "{mujoco.mj_versionString()}", ')
